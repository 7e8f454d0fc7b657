"""A limit that neither a sign, a map nor a place tells is never spoken as law, and no speed is recommended because of it."""

import re

import pytest
from hypothesis import given
from hypothesis import strategies as st

from proto.rules import LegalLimit
from services.orchestrator.advisor import Tools
from services.orchestrator.observations.inputs import Method
from services.orchestrator.target.target import marked, target
from tests.unit.services.orchestrator.support import (
    CITED,
    EXPERTS,
    FEW,
    Drive,
    Played,
    actor,
    conditions,
    end_sign,
    limit_answer,
    limit_sign,
    replace,
)

SPEED = re.compile(r"\d+")


def lost(**fields: object) -> Drive:
    """A drive on a road that nothing tells of: the rules assume its limit."""
    assumed = replace(limit_answer(50), limit=LegalLimit(value=50, unit="km/h", mps=50 / 3.6, assumed=True))
    return Drive(Played({**EXPERTS, "applicable_limit": lambda a: assumed}), **fields)  # type: ignore[arg-type]


@FEW
@given(
    speed_mps=st.floats(0.0, 45.0),
    mu=st.floats(0.05, 0.9),
    gap_m=st.none() | st.floats(5.0, 80.0),
)
def test_nothing_that_is_spoken_holds_a_speed_that_only_an_assumed_limit_gives(
    speed_mps: float, mu: float, gap_m: float | None
) -> None:
    drive = lost(speed_mps=speed_mps)
    drive.weather = conditions(mu_low=mu, mu_high=mu, speed_factor=0.6, wet=True)
    drive.tracks = (actor(gap_m, closing_mps=0.0),) if gap_m is not None else ()
    drive.ticks(70)
    for _, _, ticked in drive.history:
        advisory = ticked.advisory
        if target(ticked.state).bounds[0].why == "law":
            assert not SPEED.search(advisory.directive)
        assert "Legal limit" not in advisory.justification
        assert not advisory.citations
    assert not any("limit" in said.lower() for said in drive.spoken())


def test_a_sign_ends_the_assumption() -> None:
    drive = lost(speed_mps=12.0)
    drive.ticks(30)
    drive.ask.table = EXPERTS
    drive.tick(limit_sign("limit:50"))
    drive.ticks(20)
    shown = drive.history[-1][2].assistance
    assert (shown.known, shown.limit.value if shown.limit is not None else None) == ("known", 50)


def test_a_border_before_an_assumed_limit_does_not_keep_the_limit_from_being_told() -> None:
    drive = lost(speed_mps=10.0)
    drive.ticks(30)
    drive.tick(end_sign("border:NLD"))
    drive.ticks(20)
    borders = [
        ticked
        for _, _, ticked in drive.history
        if ticked.advisory.topic == "border" and ticked.decision.kind == "SPEAK"
    ]
    assert borders
    assert all(ticked.advisory.told_limit_mps is None for ticked in borders)
    assert {ticked.advisory.directive for ticked in borders} == {"Netherlands"}
    drive.ask.table = EXPERTS
    drive.tick(limit_sign("limit:50"))
    assert drive.ticks(100).assistance.known == "known"


@pytest.mark.parametrize(
    "question", ["What is the speed limit here?", "Why did the limit drop?", "Which units are the signs in?"]
)
def test_no_answer_tells_or_cites_an_assumed_limit(question: str) -> None:
    drive = lost(speed_mps=10.0)
    drive.ask.table = {**drive.ask.table, "lookup_rule": lambda a: limit_answer(50, limit=None, citations=())}
    drive.ticks(30)
    told = Tools(Method()).answer(question, drive.state, drive.ask)
    assert "50 km/h" not in told.text
    assert not any(citation.document == CITED.document for citation in told.citations)
    assert told.target_mps is None
    assert told.confidence <= 0.4


def test_a_limit_for_wet_roads_on_a_sign_is_told_though_the_country_is_the_home_setting_alone() -> None:
    wet = limit_answer(80, basis="conditional")
    drive = Drive(Played({**EXPERTS, "applicable_limit": lambda a: wet}), speed_mps=12.0)
    drive.tick(limit_sign("limit:80", plates=("plate:when_wet:drawn",)))
    drive.ticks(30)
    here = drive.state.signs.jurisdiction
    assert here is not None
    world = drive.state.world
    lost = replace(
        drive.state,
        signs=replace(drive.state.signs, jurisdiction=replace(here, assumed=True)),
        world=replace(world, environment=replace(world.environment, segment_id=None)),
    )
    told, own = marked(lost, wet).limit, marked(lost, replace(wet, basis="default")).limit
    assert told is not None
    assert own is not None
    assert (told.assumed, own.assumed) == (False, True)
