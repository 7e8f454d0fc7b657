"""A wall clock that is set back makes no hazard silent and no braking longer."""

import msgspec
from hypothesis import given
from hypothesis import strategies as st

from proto.decision import DecisionKind
from services.arbiter.decide import decide
from services.arbiter.state import fresh
from tests.unit.services.arbiter.support import CALIBRATED, FEW, SECOND, fused, mirror, request, track

TICK = SECOND // 10
START = 10**15
back_s = st.one_of(st.floats(0.0, 0.5), st.floats(0.5, 1e5))
"""By how much the clock is set back: less than a tick, or more than a day."""


def kinds(back: dict[int, float], ticks: int, *, watched: bool = False) -> list[DecisionKind]:
    """What is decided tick by tick on a hazard that stands, by a clock that is set back in some of the ticks."""
    state, now_ns, found = fresh(CALIBRATED), START, []
    for tick in range(ticks):
        now_ns += TICK - round(back.get(tick, 0.0) * SECOND)
        asked = request(track(), tick=tick, fused=fused(hazard="closing_lead", urgency="alarm", new_information=False))
        inputs = mirror(asked, now_ns=now_ns)
        seen = inputs.state.sightings if watched else state.sightings
        state = msgspec.structs.replace(state, sightings=seen)
        verdict = decide(asked, msgspec.structs.replace(inputs, state=state), CALIBRATED)
        state = verdict.state
        found.append(verdict.decision.kind)
    return found


def longest(found: list[DecisionKind], *wanted: DecisionKind) -> int:
    """The longest run of some kinds."""
    most = run = 0
    for kind in found:
        run = run + 1 if kind in wanted else 0
        most = max(most, run)
    return most


@FEW
@given(back=st.dictionaries(st.integers(1, 110), back_s, max_size=3))
def test_no_clock_makes_a_hazard_silent(back: dict[int, float]) -> None:
    """It is said every four seconds of driving; a step too small to be told from none may cost its own length."""
    assert longest(kinds(back, 120), "SILENT") <= 40 + 3 * len(back)


@FEW
@given(back=st.dictionaries(st.integers(1, 110), back_s, max_size=3))
def test_no_clock_lengthens_braking_or_shortens_its_rest(back: dict[int, float]) -> None:
    found = kinds(back, 120, watched=True)
    assert "ACT" in found
    assert longest(found, "ACT") <= 20 + 3 * len(back)
    ends = [tick for tick in range(1, 120) if found[tick - 1] == "ACT" and found[tick] != "ACT"]
    assert all("ACT" not in found[end : end + 49] for end in ends)


def test_what_was_watched_by_another_time_supports_no_braking() -> None:
    asked = request(track(), fused=fused(hazard="closing_lead"))
    before = mirror(asked, now_ns=START)
    state = decide(asked, before, CALIBRATED).state
    after = decide(asked, mirror(asked, now_ns=START - 100 * SECOND, state=state), CALIBRATED)
    assert [each.stamp_ns for each in after.state.sightings] == [START - 100 * SECOND - SECOND // 20]
    assert after.decision.kind != "ACT"
