"""A change of country says on what evidence it was made; a country that nobody knows here leaves it unknown."""

from collections.abc import Callable
from typing import Any

import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from proto.decision import ArbitrationRequest, Decision, Language, Preferences
from proto.rules import PlaceName, RulesAnswer
from services.orchestrator.law import rules_question
from services.orchestrator.law.limits_ahead import limits_ahead
from services.orchestrator.signs.border_evidence import items, kept
from services.orchestrator.signs.limits import in_force
from services.orchestrator.speech.wording import place_name
from services.orchestrator.state import State
from services.orchestrator.tick import Ticked, trace_of
from tests.unit.robustness.hostile import hostile
from tests.unit.services.orchestrator.support import (
    EXPERTS,
    FEW,
    KMH,
    Drive,
    Played,
    end_sign,
    fact,
    limit_answer,
    limit_sign,
    locally,
    replace,
)

TOLD = "national 3.0, keep_left 2.5, info:side_left 4.0, plate:when_wet:en 2.0"


def changed(text: str = TOLD, **fields: object) -> tuple[Drive, Ticked]:
    drive = Drive(**fields)  # type: ignore[arg-type]
    drive.ticks(3)
    return drive, drive.tick(fact("jurisdiction", "GBR", text=text), fact("units", "mph"), fact("traffic_side", "left"))


def test_the_advice_at_a_border_says_what_told_of_it() -> None:
    _, ticked = changed()
    assert ticked.advisory.directive.startswith("Great Britain")
    told = "Told by kind of signs (3.0), side of traffic (6.5), language of a plate (2.0)."
    assert told in ticked.advisory.justification


@pytest.mark.parametrize(("part", "asked"), [("", "GBR"), ("GBR-WLS", "GBR-WLS"), ("USA-TX", "GBR")])
def test_the_law_is_asked_of_the_part_that_the_driver_named_while_its_country_is_believed(
    part: str, asked: str
) -> None:
    drive, _ = changed(preferences=Preferences(part=part))
    assert drive.state.place == asked
    assert rules_question.situation(drive.state).jurisdiction == asked
    assert drive.state.signs.country == "GBR"


def test_where_a_sign_ahead_shows_less_the_border_tells_that_and_not_the_countrys_own_limit() -> None:
    drive = Drive(road="rural")
    ahead = limit_sign("limit:20", unit="mph", passed=False, distance_m=25.0)
    drive.ticks(25)
    ticked = drive.tick(fact("jurisdiction", "GBR", text=TOLD), fact("units", "mph"), ahead)
    assert ticked.advisory.directive == "Great Britain: 20 miles an hour"
    assert ticked.advisory.ahead_mps == pytest.approx(20 * 0.44704)


def test_it_is_said_in_the_drivers_language() -> None:
    _, ticked = changed(preferences=Preferences(language="de"))
    assert "Erkannt an: Art der Schilder (3,0), Straßenseite des Verkehrs (6,5)" in ticked.advisory.justification


ATLANTIS = {
    "en": PlaceName(name="Atlantis", inside="on Atlantis", out_of="from Atlantis"),
    "fr": PlaceName(name="Atlantide", inside="en Atlantide", out_of="d'Atlantide"),
}


def called(arguments: dict[str, Any]) -> RulesAnswer:
    """The law of a pack that calls its country Atlantis, in English and French; other countries it does not name."""
    asked = arguments["situation"]
    place = ATLANTIS.get(asked["language"], ATLANTIS["en"]) if asked["jurisdiction"] == "GBR" else None
    return limit_answer(20, "mph", place=place)


@pytest.mark.parametrize(("language", "name"), [("en", "Atlantis"), ("fr", "Atlantide"), ("pl", "Atlantis")])
def test_a_country_is_announced_by_the_name_that_its_pack_gives_it(language: Language, name: str) -> None:
    experts = Played({**EXPERTS, "applicable_limit": called})
    _, ticked = changed(ask=experts, preferences=Preferences(language=language))
    assert ticked.advisory.directive.split()[0].rstrip(":") == name


def test_the_country_left_behind_keeps_the_name_that_its_pack_gave_it() -> None:
    drive, _ = changed(ask=Played({**EXPERTS, "applicable_limit": called}))
    drive.tick(fact("jurisdiction", "DEU", text=TOLD), fact("units", "km/h"), fact("traffic_side", "right"))
    assert place_name(drive.state, "GBR").out_of == "from Atlantis"
    assert place_name(drive.state, "DEU").out_of == "from Germany"


def test_a_number_that_may_be_miles_is_told_with_its_border_and_no_sooner() -> None:
    drive = Drive(speed_mps=12.0)
    drive.tick(fact("jurisdiction", "DEU"), fact("units", "km/h"), fact("traffic_side", "right"))
    for left_m in (50.0, 45.0, 40.0):
        borders = [end_sign("border:GBR", track_id=at, passed=False, distance_m=left_m - 20.0) for at in (9, 10)]
        drive.tick(*borders, limit_sign("limit:20", unit="km/h", track_id=30, passed=False, distance_m=left_m))
    assert drive.spoken() == []
    assert drive.target_mps < 50 * KMH, "till then the lower reading holds"
    drive.tick(end_sign("border:GBR"))
    assert drive.history[-1][2].advisory.kind == "SILENT", "the front end is about to say the unit"
    drive.tick(
        fact("units", "mph"),
        fact("traffic_side", "left"),
        limit_sign("limit:20", unit="mph", track_id=30, passed=False, distance_m=20.0),
    )
    drive.ticks(3)
    assert drive.spoken() == ["Great Britain: keep left, 20 miles an hour"]


@pytest.mark.parametrize("told", ["info:units_mph", "info:side_left"])
def test_where_signs_speak_against_the_unit_a_number_is_shown_as_assumed_and_bounds_as_the_lower(told: str) -> None:
    drive = Drive(speed_mps=12.0)
    drive.tick(fact("jurisdiction", "DEU"), fact("units", "km/h"), fact("traffic_side", "right"))
    drive.tick(limit_sign("limit:20", unit="km/h"))
    drive.ticks(5)
    known = drive.history[-1][2].assistance.limit
    assert known is not None
    assert not known.assumed
    before = len(drive.spoken())
    drive.tick(end_sign(told, passed=False, distance_m=25.0))
    drive.ticks(60)
    shown = drive.history[-1][2].assistance.limit
    assert shown is None or shown.assumed
    assert drive.target_mps == pytest.approx(20 * KMH)
    assert drive.spoken()[before:] == [], "no number is told that may be miles"
    drive.tick(fact("jurisdiction", "GBR"), fact("units", "mph"), fact("traffic_side", "left"))
    posted = drive.state.signs.permanent
    assert posted is not None
    assert (posted.posted.value, posted.posted.unit) == (20.0, "mph"), "it was passed of late"


def test_a_border_sign_is_its_own_evidence() -> None:
    drive = Drive()
    drive.ticks(3)
    assert "Told by border sign." in drive.tick(end_sign("border:GBR"), fact("units", "mph")).advisory.justification


@given(assumed=st.booleans(), seconds=st.integers(3, 30))
def test_a_border_into_the_country_that_we_were_taken_to_be_in_ends_the_limits_before_it(
    assumed: bool, seconds: int
) -> None:
    """Who starts abroad in a car whose home is here is taken to be at home until something speaks against it."""
    drive = Drive(road="rural")
    drive.state = State()
    here = fact("jurisdiction", "DEU", assumed=assumed)
    drive.tick(here, fact("units", "km/h"), fact("road_type", "rural"), limit_sign("limit:30"))
    drive.ticks(10 * seconds - 1)
    known = not assumed and seconds < 20
    assert drive.target_mps == pytest.approx(30 * KMH)
    ticked = drive.tick(end_sign("border:DEU"))
    drive.tick(end_sign("border:DEU", track_id=10))
    assert drive.target_mps == pytest.approx((30 if known else 100) * KMH)
    borders = [t.advisory.directive for _, _, t in drive.history if t.advisory.topic == "border"]
    assert ("jurisdiction_change" in {event.kind for event in ticked.events}) is (not known)
    assert any(each.startswith("Germany") for each in borders) is (not known)


@pytest.mark.parametrize("doubt", [{"confidence": 0.5}, {"believed": False}])
def test_a_doubted_sign_of_such_a_border_ends_nothing(doubt: dict[str, Any]) -> None:
    drive = Drive(road="rural")
    drive.tick(limit_sign("limit:30"))
    drive.ticks(250)
    drive.tick(end_sign("border:DEU", **doubt))
    assert drive.target_mps == pytest.approx(30 * KMH)


def out_of_britain(speed_mps: float = 15.0) -> Drive:
    """In Great Britain, where signs speak in mph."""
    drive = Drive(road="rural", speed_mps=speed_mps)
    drive.tick(fact("jurisdiction", "GBR"), fact("units", "mph"), fact("traffic_side", "left"))
    drive.ticks(25)
    return drive


def test_behind_a_border_sign_nothing_is_told_in_the_units_of_the_country_left() -> None:
    drive = out_of_britain()
    drive.tick(limit_sign("limit:30", unit="mph", passed=False, distance_m=40.0))
    advisory = drive.tick(end_sign("border:NLD")).advisory
    assert advisory.directive == "Netherlands: 30 kilometres an hour"
    assert advisory.ahead_mps == pytest.approx(30 * KMH)
    assert "mph" not in advisory.justification
    assert "keeps" not in advisory.justification, "no sign has told the side yet"
    assert drive.state.world.environment.units is None


@given(silent=st.integers(0, 150))
@FEW
def test_a_border_is_told_once_as_soon_as_the_budget_allows_it(silent: int) -> None:
    drive = Drive(Played(arbiter=quiet_for(silent)), road="rural")
    drive.ticks(3)
    drive.tick(end_sign("border:NLD"))
    drive.ticks(silent + 30)
    borders = [t for _, _, t in drive.history if t.advisory.kind != "SILENT" and t.advisory.topic == "border"]
    assert len(borders) == 1
    assert borders[0].advisory.directive.startswith("Netherlands")


def test_a_border_long_crossed_is_no_news() -> None:
    drive = Drive(Played(arbiter=quiet_for(250)), road="rural")
    drive.tick(end_sign("border:NLD"))
    drive.ticks(300)
    assert not any(said.startswith("Netherlands") for said in drive.spoken())


def quiet_for(ticks: int) -> Callable[[ArbitrationRequest], Decision]:
    """An arbiter whose budget is spent behind the border until so many ticks have passed."""
    asked: list[ArbitrationRequest] = []

    def judge(request: ArbitrationRequest) -> Decision:
        if request.fused.topic == "border" or asked:
            asked.append(request)
        speaks = (not asked or len(asked) > ticks) and request.fused.new_information
        return replace(locally(request), kind="SPEAK" if speaks else "SILENT", hazard="")

    return judge


def test_who_is_told_the_units_behind_a_border_is_told_the_side_too() -> None:
    drive = out_of_britain()
    seen = fact("jurisdiction", "NLD"), fact("units", "km/h"), fact("traffic_side", "right")
    assert (
        "Signs from the Netherlands: speeds in km/h, traffic keeps right." in drive.tick(*seen).advisory.justification
    )


@FEW
@given(st.sampled_from([20, 30, 40, 50, 60]), st.floats(5.0, 60.0), st.floats(5.0, 90.0), st.booleans())
def test_a_number_behind_a_border_that_is_still_ahead_counts_as_the_lower_reading(
    value: int, border_m: float, sign_m: float, believed: bool
) -> None:
    assume(abs(border_m - sign_m) > 0.1)
    drive = out_of_britain(speed_mps=31.0)
    drive.tick(
        end_sign("border:NLD", passed=False, distance_m=border_m, believed=believed),
        limit_sign(f"limit:{value}", unit="mph", passed=False, distance_m=sign_m),
    )
    (ahead,) = limits_ahead(drive.state)
    assert ahead.unit == ("km/h" if believed and border_m < sign_m else "mph")


@FEW
@given(
    st.sampled_from(["GBR", "DEU", "NLD"]), st.sampled_from(["border:GBR", "border:NLD", "border:FRA", "border:PRT"])
)
def test_a_limit_passed_right_behind_a_border_holds_in_the_lower_reading_until_its_unit_is_told(
    country: str, border: str
) -> None:
    assume(not border.endswith(country))
    drive = Drive(road="rural")
    unit = "mph" if country == "GBR" else "km/h"
    drive.tick(fact("jurisdiction", country), fact("units", unit))
    drive.tick(limit_sign("limit:30", unit=unit, passed=False, distance_m=3.0))
    drive.tick(end_sign(border))
    drive.ticks(10)
    permanent = drive.state.signs.permanent
    assert permanent is not None
    assert permanent.posted.unit == "km/h"


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
    assert "Signs from Great Britain: speeds in mph, traffic keeps left." in ticked.advisory.justification
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


@pytest.mark.parametrize("news", [fact("jurisdiction", "PRT"), end_sign("border:PRT")])
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


def test_a_doubt_ends_a_country_that_was_only_assumed_and_no_limit() -> None:
    doubt = fact("jurisdiction", "USA", believed=False, confidence=0.7)
    drive = Drive(road="rural")
    drive.tick(limit_sign("limit:70"))
    drive.tick(doubt)
    assert drive.state.signs.country == "DEU", "what was told stands"
    here, before = drive.state.signs.jurisdiction, drive.target_mps
    assert here is not None
    drive.state = replace(drive.state, signs=replace(drive.state.signs, jurisdiction=replace(here, assumed=True)))
    drive.tick(fact("jurisdiction", "DEU", believed=False, confidence=0.6))
    assert drive.state.signs.country == "DEU", "a doubt that speaks for none but itself"
    drive.tick(doubt)
    signs = drive.state.signs
    assert (signs.country, signs.units, signs.crossed) == (None, None, False)
    assert [each.posted.value for each in in_force(drive.state.signs)] == [70.0]
    assert drive.target_mps <= before


def test_a_law_asked_for_another_country_is_not_held_once_the_country_is_unknown() -> None:
    drive = Drive(road="motorway")
    drive.ticks(3)
    assert drive.target_mps == pytest.approx(130 * KMH)
    drive.ask.table = {}
    drive.tick(fact("jurisdiction", "PRT"))
    assert drive.target_mps < 100 * KMH


@given(st.text(min_size=3, max_size=3).filter(lambda text: not (text.isascii() and text.isupper())))
@FEW
def test_what_is_no_code_of_a_country_changes_nothing(text: str) -> None:
    drive = Drive()
    drive.tick(fact("jurisdiction", text))
    here = drive.state.signs.jurisdiction
    assert here is not None
    assert here.value == "DEU"
