"""What the answers promise, sentence by sentence, from all packs at once."""

from typing import Any

import msgspec
import pytest
from hypothesis import given
from hypothesis import strategies as st

from drivemcp.files.packfiles import folder_of
from proto.rules import PostedLimit, RightOfWayQuestion, RulesAnswer, SignMeaning, Situation
from proto.scene import Candidate
from services.rules.book import RuleBook, load_book
from services.rules.limits.limit_answer import applicable_limit
from services.rules.right_of_way import right_of_way
from services.rules.service import RulesConfig
from services.rules.signs.meaning import SignQuestion, interpret_sign

BOOK: RuleBook = load_book([folder_of(name) for name in RulesConfig().packs])[0]
PLAIN = Situation(jurisdiction="DEU", road_type="motorway", wet=False, snow=False, visibility_m=300.0)


def ask(*posted: PostedLimit, **facts: Any) -> RulesAnswer:
    return applicable_limit(BOOK, msgspec.structs.replace(PLAIN, posted=posted, **facts))


def shows(value: float, scope: Any = "permanent", unit: Any = "km/h", **more: Any) -> PostedLimit:
    return PostedLimit(value=value, unit=unit, scope=scope, **more)


def value(answer: RulesAnswer) -> float | None:
    return answer.limit.value if answer.limit else None


def cited(answer: RulesAnswer | SignMeaning) -> set[str]:
    return {citation.provision for citation in answer.citations}


def meaning(reading: str, here: str, language: str, *plates: str) -> str:
    found = interpret_sign(BOOK, SignQuestion(reading=reading, jurisdiction=here, language=language, plates=plates))
    return f"{found.meaning} {found.note}"


# -- which limit applies -------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("country", "provision"),
    [
        ("DEU", "deu-temporary-over-permanent"),
        ("AUT", "aut-speed-temporary"),
        ("FRA", "fra-temporary"),
        ("POL", "pol-temporary"),
    ],
)
def test_a_temporary_sign_governs_where_the_law_says_so(country: str, provision: str) -> None:
    temporary = ask(shows(60, "temporary"), jurisdiction=country, road_type="rural")
    both = ask(shows(80), shows(60, "temporary"), jurisdiction=country, road_type="rural")
    assert value(both) == 60
    assert provision in cited(both)
    assert both.confidence == temporary.confidence  # the sign it replaces is no contradiction
    assert both.legal_action == "comply_with_limit"


@pytest.mark.parametrize(("country", "scope"), [("NLD", "temporary"), ("CHE", "temporary"), ("FRA", "gantry")])
def test_where_the_law_does_not_say_it_the_lower_counts_less_surely_and_both_are_cited(
    country: str, scope: str
) -> None:
    alone = ask(shows(60, scope), jurisdiction=country, road_type="rural", time_of_day_h=12.0)
    both = ask(shows(80), shows(60, scope), jurisdiction=country, road_type="rural", time_of_day_h=12.0)
    assert value(both) == 60
    assert 0.8 * alone.confidence < both.confidence < alone.confidence
    assert cited(both) >= cited(alone) | {f"{country.lower()}-sign-limit"}


def test_a_temporary_sign_that_would_allow_more_is_doubted_and_both_are_cited() -> None:
    answer = ask(shows(60), shows(80, "temporary"))
    assert value(answer) == 60
    assert answer.confidence < ask(shows(60)).confidence
    assert {"deu-sign-limit", "deu-temporary-over-permanent"} <= cited(answer)
    assert "contradict" in answer.note


def test_two_signs_that_differ_give_the_lower_at_lower_confidence_and_both_are_cited() -> None:
    answer = ask(shows(60, "zone"), shows(100), road_type="urban")
    assert value(answer) == 60
    assert answer.legal_action == "reduce_speed"
    assert answer.confidence < ask(shows(60, "zone"), road_type="urban").confidence
    assert {"deu-sign-limit", "sign:zone"} <= cited(answer)


def test_a_doubtful_reading_gives_the_most_careful_one_and_cites_what_it_overrides() -> None:
    candidates = (Candidate(reading="limit:30", confidence=0.4), Candidate(reading="limit:80", confidence=0.5))
    answer = ask(road_type="rural", candidates=candidates)
    assert value(answer) == 30
    assert answer.legal_action == "reduce_speed"
    assert answer.confidence < 0.5
    assert {"deu-sign-limit", "deu-speed-rural-car"} <= cited(answer)


@pytest.mark.parametrize(
    ("posted", "end", "left"),
    [
        ((shows(80), shows(60, "gantry")), "led:blank", 80),
        ((shows(80), shows(60, "gantry")), "limit_end:60", 80),
        ((shows(30, "zone"),), "zone_end", 50),
        ((shows(70),), "limit_end:50", 70),  # another number ends nothing
        ((shows(70),), "town_exit", 50),
    ],
)
def test_limits_overlap_and_end_one_by_one(posted: tuple[PostedLimit, ...], end: str, left: float) -> None:
    answer = ask(*posted, ended=(end,), road_type="urban")
    assert value(answer) == left


@pytest.mark.parametrize("plate", ["plate:nonsense", "plate:trailer", "plate:distance:200 m"])
def test_a_plate_that_says_nothing_known_is_told_to_be_unknown(plate: str) -> None:
    answer = ask(shows(60, plates=(plate,)), jurisdiction="DEU", road_type="rural")
    assert value(answer) == 60
    assert "plate below the sign" in answer.note
    assert answer.confidence < 0.9


@pytest.mark.parametrize(("hour", "limit"), [(23.0, 60), (12.0, 100)])
def test_hours_are_read_from_a_plate_as_it_is_written(hour: float, limit: float) -> None:
    answer = ask(shows(60, plates=("22-06 h",)), jurisdiction="DEU", road_type="rural", time_of_day_h=hour)
    assert value(answer) == limit


def test_a_plate_that_only_warns_of_rain_makes_no_limit_conditional() -> None:
    plate = shows(40, unit="mph", plates=("plate:when_wet:en",))
    for sign in (plate, shows(40, "when_wet", "mph")):
        answer = ask(sign, jurisdiction="GBR", road_type="dual_carriageway", home_unit="mph", lit=False)
        assert value(answer) == 40
        assert answer.basis == "posted"
        assert answer.note == "Posted limit 40 mph."
    assert ask(shows(80, "when_wet"), wet=True).basis == "conditional"


@pytest.mark.parametrize(
    ("language", "vehicle", "road", "said"),
    [
        ("en", "car", "urban", "Wales: 20 mph"),
        ("de", "lorry", "rural", "Schottland und Nordirland: 40 mph"),
        ("fr", "lorry", "dual_carriageway", "Écosse et Irlande du Nord) : 50 mph"),
    ],
)
def test_where_a_part_of_britain_has_less_the_driver_is_told_and_both_are_cited(
    language: str, vehicle: str, road: Any, said: str
) -> None:
    facts = {"road_type": road, "vehicle_class": vehicle, "language": language, "lit": False}
    unknown, england = ask(jurisdiction="GBR", **facts), ask(jurisdiction="GBR-ENG", **facts)
    assert unknown.limit == england.limit
    assert said in unknown.note
    assert said not in england.note
    assert cited(unknown) > cited(england)
    assert 0.8 * england.confidence < unknown.confidence < england.confidence


# -- what a sign means ---------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("reading", "here", "plates", "words"),
    [
        ("right_before_left", "FRA", (), ("right has priority", "rechts Vorfahrt", "droite est prioritaire")),
        ("right_before_left", "GBR", (), ("here it does not", "hier nicht", "ici non")),
        ("national", "GBR", (), ("never means that there is no limit", "nie auf", "ne supprime jamais")),
        ("limit:110", "FRA", ("plate:when_wet:fr",), ("lowers the general limits in rain", "senkt das Gesetz bei Regen", "sous la pluie")),
        ("limit:40", "GBR", ("plate:when_wet:en",), ("counts always", "gilt immer", "toujours")),
    ],
)  # fmt: skip
def test_the_local_difference_is_explained_in_the_drivers_language(
    reading: str, here: str, plates: tuple[str, ...], words: tuple[str, ...]
) -> None:
    for language, word in zip(("en", "de", "fr"), words, strict=True):
        assert word in meaning(reading, here, language, *plates)


def test_of_two_readings_both_signs_are_cited() -> None:
    candidates = (Candidate(reading="priority_road", confidence=0.6), Candidate(reading="stop", confidence=0.3))
    found = interpret_sign(BOOK, SignQuestion(reading="priority_road", jurisdiction="DEU", candidates=candidates))
    assert found.legal_action == "stop"
    assert {"sign:stop", "sign:priority_road"} <= cited(found)
    assert found.confidence <= 0.3


# -- who has right of way ------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("facts", "action"),
    [
        ({"signs": ("stop",)}, "stop"),
        ({"light": "red"}, "stop"),
        ({"signs": ("yield",)}, "yield"),
        ({}, "yield"),  # priority to the right
        ({"signs": ("priority_road",)}, "proceed"),
        ({"light": "green"}, "proceed"),
        ({"light": "green", "signs": ("stop",)}, "proceed"),
    ],
)
@pytest.mark.parametrize("country", ["DEU", "FRA", "AUT", "POL"])
def test_the_driver_is_told_to_stop_yield_or_proceed(facts: dict[str, Any], action: str, country: str) -> None:
    answer = right_of_way(BOOK, RightOfWayQuestion(jurisdiction=country, pedestrians_on_crossing=False, **facts))
    assert answer.legal_action == action
    assert answer.citations


@pytest.mark.parametrize(("language", "word"), [("en", "most careful"), ("de", "Vorsichtigste"), ("fr", "prudent")])
def test_signs_that_contradict_each_other_are_doubted_and_both_cited(language: str, word: str) -> None:
    def at(*signs: str) -> RulesAnswer:
        question = RightOfWayQuestion(jurisdiction="DEU", signs=signs, pedestrians_on_crossing=False, language=language)
        return right_of_way(BOOK, question)

    both = at("priority_road", "yield")
    assert both.legal_action == "yield"
    assert both.confidence < at("yield").confidence
    assert cited(both) >= cited(at("yield")) | cited(at("priority_road"))
    assert word in both.note


# -- minimum speeds ------------------------------------------------------------------------------------------------------

BELGIAN = {"jurisdiction": "BEL", "road_type": "motorway"}


def test_a_minimum_speed_is_told_with_its_provision() -> None:
    answer = ask(**BELGIAN)
    assert answer.minimum is not None
    assert (answer.minimum.value, answer.minimum.unit) == (70, "km/h")
    assert "bel-speed-minimum" in cited(answer)


@pytest.mark.parametrize(
    "facts",
    [
        {"wet": True}, {"snow": True}, {"visibility_m": 100.0}, {"road_type": None}, {"road_type": "rural"},
        {"jurisdiction": None}, {"jurisdiction": "XYZ"},
    ],
)  # fmt: skip
def test_none_is_told_in_bad_weather_or_where_the_road_or_the_country_is_unknown(facts: dict[str, Any]) -> None:
    assert ask(**{**BELGIAN, **facts}).minimum is None


@given(st.floats(1.0, 130.0), st.sampled_from(["permanent", "gantry", "temporary"]))
def test_a_minimum_is_never_above_the_limit(posted: float, scope: str) -> None:
    answer = ask(shows(posted, scope), **BELGIAN)
    assert answer.limit is not None
    assert answer.minimum is None or answer.minimum.mps <= answer.limit.mps
