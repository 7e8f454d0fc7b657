"""Why, and what would have changed it."""

import msgspec

from services.arbiter.braking.act import Permission
from services.arbiter.decide import decide
from services.arbiter.explain import LEVERS, explain
from tests.unit.services.arbiter.support import CALIBRATED, PAPER, fused, mirror, request, track

AHEAD = request(track(gap_m=45.0, closing_mps=12.0), fused=fused(new_information=False))


def test_the_named_change_flips_the_decision_and_a_hair_less_does_not() -> None:
    inputs = mirror(AHEAD)
    flips = explain(AHEAD, inputs, CALIBRATED).flips
    assert flips
    before = decide(AHEAD, inputs, CALIBRATED).decision.kind
    levers = {lever.name: lever for lever in LEVERS}
    for flip in flips:
        put = levers[flip.quantity].put
        after = decide(*put(AHEAD, inputs, flip.to_value), CALIBRATED).decision.kind
        hair = (flip.from_value - flip.to_value) * 1e-4
        short = decide(*put(AHEAD, inputs, flip.to_value + hair), CALIBRATED).decision.kind
        assert (after, short) == (flip.becomes, before), flip.quantity


def test_the_smallest_change_stands_first() -> None:
    shares = [flip.share_of_span for flip in explain(AHEAD, mirror(AHEAD), CALIBRATED).flips]
    assert shares == sorted(shares)


def test_it_says_what_speaks_against_acting() -> None:
    asked = msgspec.structs.replace(AHEAD, tool_timed_out=True)
    told = explain(asked, mirror(asked), CALIBRATED)
    assert "a routed tool timed out" in told.objections
    assert "timed out" in told.text


def test_under_the_papers_constants_it_says_that_act_cannot_be_reached() -> None:
    told = explain(AHEAD, mirror(AHEAD, profile=PAPER, permission=Permission()), PAPER)
    assert "cannot be reached" in told.reach
    assert all("ACT" not in flip.becomes for flip in told.flips)
