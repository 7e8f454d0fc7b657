"""A change of country says on what evidence it was made; a country that nobody knows here leaves it unknown."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from proto.decision import Preferences
from services.orchestrator.evidence import items, kept
from services.orchestrator.limits import in_force
from services.orchestrator.tick import Ticked, trace_of
from tests.unit.robustness.hostile import hostile
from tests.unit.services.orchestrator.support import FEW, KMH, Drive, end_sign, fact, limit_sign

TOLD = "national 3.0, keep_left 2.5, info:side_left 4.0, plate:when_wet:en 2.0"


def changed(text: str = TOLD, **fields: object) -> tuple[Drive, Ticked]:
    drive = Drive(**fields)  # type: ignore[arg-type]
    drive.ticks(3)
    return drive, drive.tick(fact("jurisdiction", "GBR", text=text), fact("units", "mph"), fact("traffic_side", "left"))


def test_the_advice_at_a_border_says_what_told_of_it() -> None:
    _, ticked = changed()
    assert ticked.advisory.directive.startswith("Now GBR")
    told = "Told by kind of signs (3.0), side of traffic (6.5), language of a plate (2.0)."
    assert told in ticked.advisory.justification


def test_where_a_sign_ahead_shows_less_the_border_tells_that_and_not_the_countrys_own_limit() -> None:
    drive = Drive(road="rural")
    ahead = limit_sign("limit:20", unit="mph", passed=False, distance_m=25.0)
    drive.ticks(25)
    ticked = drive.tick(fact("jurisdiction", "GBR", text=TOLD), fact("units", "mph"), ahead)
    assert ticked.advisory.directive == "Now GBR: 20 mph (32 km/h) ahead"
    assert ticked.advisory.ahead_mps == pytest.approx(20 * 0.44704)


def test_it_is_said_in_the_drivers_language() -> None:
    _, ticked = changed(preferences=Preferences(language="de"))
    assert "Erkannt an: Art der Schilder (3.0), Straßenseite des Verkehrs (6.5)" in ticked.advisory.justification


def test_a_border_sign_is_its_own_evidence() -> None:
    drive = Drive()
    drive.ticks(3)
    assert "Told by border sign." in drive.tick(end_sign("border:GBR")).advisory.justification


def test_the_trace_holds_the_evidence() -> None:
    drive, ticked = changed()
    _, seen, _ = drive.history[-1]
    trace = trace_of(ticked, seen, {}, ticked.advisory, whole=False)
    change = next(event for event in trace.events if event.kind == "jurisdiction_change")
    assert change.detail == f"DEU to GBR on {TOLD}"
    here = ticked.state.world.environment.jurisdiction
    assert here is not None
    assert (here.value, here.evidence) == ("GBR", TOLD)


def test_without_stated_evidence_the_change_is_told_as_it_was() -> None:
    _, ticked = changed("")
    assert "Signs of GBR: speeds in mph, traffic keeps left." in ticked.advisory.justification
    assert "Told by" not in ticked.advisory.justification


@pytest.mark.parametrize(
    "text",
    [
        "national 3.0; keep_left 2.5", "national 3.0, obey me 9.9", "NATIONAL 3.0", "national ３.0", "national 3.0, ",
        "national 3e9", "nationаl 3.0", "x" * 5000, ", ".join(["national 3.0"] * 7),
    ],
)  # fmt: skip
def test_what_is_no_list_of_codes_and_weights_is_no_evidence(text: str) -> None:
    assert items(text) == ()
    assert kept(text) == ""


@FEW
@given(hostile())
def test_hostile_evidence_changes_no_target_and_is_not_said(text: str) -> None:
    plain, spoken = changed(""), changed(text)
    assert spoken[0].target_mps == plain[0].target_mps
    assert spoken[1].advisory.directive == plain[1].advisory.directive
    assert items(text) or spoken[1].advisory.justification == plain[1].advisory.justification


@pytest.mark.parametrize("news", [fact("jurisdiction", "ITA"), end_sign("border:ITA")])
def test_a_country_that_nobody_knows_here_leaves_it_unknown_and_ends_no_limit(news: object) -> None:
    drive = Drive(road="rural")
    drive.tick(limit_sign("limit:70"))
    before = drive.target_mps
    drive.tick(news)  # type: ignore[arg-type]
    assert drive.state.signs.jurisdiction is None
    assert [each.posted.value for each in in_force(drive.state.signs)] == [70.0]
    assert drive.target_mps <= before
    drive.tick(fact("jurisdiction", "AUT"))
    assert drive.state.signs.jurisdiction is not None


def test_a_law_asked_for_another_country_is_not_held_once_the_country_is_unknown() -> None:
    drive = Drive(road="motorway")
    drive.ticks(3)
    assert drive.target_mps == pytest.approx(130 * KMH)
    drive.ask.table = {}
    drive.tick(fact("jurisdiction", "ITA"))
    assert drive.target_mps < 100 * KMH


@given(st.text(min_size=3, max_size=3).filter(lambda text: not (text.isascii() and text.isupper())))
@FEW
def test_what_is_no_code_of_a_country_changes_nothing(text: str) -> None:
    drive = Drive()
    drive.tick(fact("jurisdiction", text))
    here = drive.state.signs.jurisdiction
    assert here is not None
    assert here.value == "DEU"
