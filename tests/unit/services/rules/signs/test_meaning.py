"""Signs explained in the driver's language, foreign ones as foreign, doubtful ones the careful way."""

from typing import get_args

import pytest

from drivemcp.paths import data
from proto.rules import PostedLimit, SignMeaning, Situation, VehicleClass
from proto.scene import Candidate
from services.rules.authoring.vocabulary import vocabulary
from services.rules.book import RuleBook, load_book
from services.rules.limits.limit_answer import applicable_limit
from services.rules.signs.meaning import SignQuestion, careful_rank, find_sign, interpret_sign
from services.rules.signs.sign_codes import parse_reading
from services.rules.signs.vehicle_signs import BINDINGS
from services.simulator.signart.catalogue import CODES


@pytest.mark.parametrize("country", ["DEU", "GBR"])
def test_every_sign_that_the_simulator_draws_is_in_the_countrys_table(country: str, book: RuleBook) -> None:
    pack = book.for_jurisdiction(country)[0]
    missing = [code for code in CODES[country] if find_sign(pack, parse_reading(code)) is None]
    arrows = {f"plate:arrow_{way}" for way in ("left", "right", "ahead")}  # not known to a pack: may hold, so counted
    foreign_in_britain = {"plate:when_wet:drawn", "plate:when_wet:en"}  # no limit depends on the wet there
    assert set(missing) <= (arrows | foreign_in_britain if country == "GBR" else arrows)


@pytest.mark.parametrize("plate", ["plate:arrow_left", "plate:school"])
def test_a_limit_under_a_plate_that_no_pack_knows_counts_but_replaces_no_default(book: RuleBook, plate: str) -> None:
    def limit(*values: float) -> float:
        posted = tuple(PostedLimit(value=value, unit="km/h", confidence=0.95, plates=(plate,)) for value in values)
        situation = Situation(jurisdiction="DEU", road_type="rural", vehicle_class="car", posted=posted)
        answer = applicable_limit(book, situation).limit
        assert answer is not None
        return answer.value

    assert limit(30.0) == 30.0
    assert limit(130.0) == limit()


@pytest.mark.parametrize(("language", "word"), [("en", "Stop"), ("de", "anhalten"), ("fr", "Arrêt"), ("xx", "Stop")])
def test_the_meaning_comes_in_the_drivers_language_else_in_english(book: RuleBook, language: str, word: str) -> None:
    assert word in interpret_sign(book, SignQuestion(reading="stop", jurisdiction="DEU", language=language)).meaning


def test_a_sign_of_another_country_is_explained_as_foreign(book: RuleBook) -> None:
    seen = interpret_sign(book, SignQuestion(reading="national", jurisdiction="DEU", language="en"))
    assert "no sign of Germany" in seen.note
    assert "Great Britain" in seen.note
    assert seen.confidence <= 0.5


def test_the_same_disc_means_another_thing_across_the_border(book: RuleBook) -> None:
    note = interpret_sign(book, SignQuestion(reading="national", jurisdiction="GBR", language="de")).note
    assert "hebt das Tempolimit aber nie auf" in note


def test_a_limit_is_converted_for_the_driver_and_never_rounded_up(book: RuleBook) -> None:
    seen = interpret_sign(book, SignQuestion(reading="limit:70", jurisdiction="GBR", home_unit="km/h"))
    assert "112 km/h" in seen.note  # 112.65


def test_of_several_candidates_the_most_careful_is_answered_and_the_others_are_named(book: RuleBook) -> None:
    doubt = (Candidate(reading="limit:80", confidence=0.6), Candidate(reading="limit:60", confidence=0.3))
    seen = interpret_sign(book, SignQuestion(reading="limit:80", jurisdiction="DEU", candidates=doubt))
    assert seen.limit is not None
    assert seen.limit.value == 60
    assert seen.confidence == pytest.approx(0.3)
    assert "limit:80" in seen.note
    unlike = (Candidate(reading="priority_road", confidence=0.6), Candidate(reading="stop", confidence=0.3))
    assert interpret_sign(book, SignQuestion(reading="x", jurisdiction="DEU", candidates=unlike)).legal_action == "stop"


def test_a_plate_below_the_sign_is_explained_with_it(book: RuleBook) -> None:
    question = SignQuestion(reading="limit:80", jurisdiction="DEU", plates=("plate:when_wet:de",), language="en")
    assert "only when the road is wet" in interpret_sign(book, question).note


@pytest.mark.parametrize(
    "reading",
    [
        "",
        "nonsense",
        "limit:",
        "limit:9999999",
        "limit:999",
        "limit:0",
        "limit:٨٠",
        ":::",
        "x" * 5000,
        "plate",
        "border:???",
    ],
)
def test_nonsense_is_answered_with_care_and_little_confidence(book: RuleBook, reading: str) -> None:
    seen = interpret_sign(book, SignQuestion(reading=reading, jurisdiction="DEU"))
    assert seen.limit is None
    assert seen.legal_action in ("proceed_with_care", "comply_with_limit")


def test_a_number_that_no_such_sign_carries_is_doubted(book: RuleBook) -> None:
    usual = interpret_sign(book, SignQuestion(reading="limit:80", jurisdiction="DEU"))
    unusual = interpret_sign(book, SignQuestion(reading="limit:83", jurisdiction="DEU"))
    assert unusual.confidence < usual.confidence


def test_an_unknown_country_lowers_confidence(book: RuleBook) -> None:
    assert interpret_sign(book, SignQuestion(reading="stop")).confidence <= 0.3


def test_a_border_names_the_country_in_the_drivers_language(book: RuleBook) -> None:
    seen = interpret_sign(book, SignQuestion(reading="border:GBR", jurisdiction="DEU", language="de"))
    assert "Großbritannien" in seen.meaning


def test_a_stale_pack_lowers_the_confidence_of_meanings() -> None:
    stale = load_book([data("rulepacks/DEU-v1")], expected={"DEU-v1": "3.0.0"})[0]
    assert interpret_sign(stale, SignQuestion(reading="stop", jurisdiction="DEU")).confidence == pytest.approx(0.5)


BELGIUM = load_book([data("rulepacks/BEL-v1")])[0]


@pytest.mark.parametrize(("place", "limit"), [("BEL", 50.0), ("BEL-BRU", 30.0), ("BEL-WAL", 50.0)])
def test_a_town_sign_tells_the_limit_of_the_part_of_the_country_that_is_known(place: str, limit: float) -> None:
    seen = interpret_sign(BELGIUM, SignQuestion(reading="town_entry", jurisdiction=place))
    assert seen.limit is not None
    assert seen.limit.value == limit


def test_a_number_with_a_sign_of_its_own_is_told_as_that_sign() -> None:
    own, family = (
        interpret_sign(BELGIUM, SignQuestion(reading=reading, jurisdiction="BEL")) for reading in ("zone:30", "zone:70")
    )
    assert (own.national_code, family.national_code) == ("F4a", "ZC43 (70)")
    assert [meaning.limit.value for meaning in (own, family) if meaning.limit] == [30.0, 70.0]


LORRY_SIGNS = {"no_lorries": "no_entry", "no_overtaking_lorries": "no_overtaking", "height_limit:3.8": "no_entry"}


def for_class(book: RuleBook, reading: str, vehicle: VehicleClass | None, country: str = "DEU") -> SignMeaning:
    return interpret_sign(book, SignQuestion(reading=reading, jurisdiction=country, vehicle_class=vehicle))


@pytest.mark.parametrize("reading", LORRY_SIGNS)
def test_a_sign_for_lorries_binds_a_lorry_and_no_car(book: RuleBook, reading: str) -> None:
    car, lorry = for_class(book, reading, "car"), for_class(book, reading, "lorry")
    assert (car.legal_action, car.note) == ("none", "")
    assert lorry.legal_action == LORRY_SIGNS[reading]
    assert "lorry" in lorry.binds == car.binds
    assert "car" not in lorry.binds


@pytest.mark.parametrize("reading", LORRY_SIGNS)
def test_where_the_class_is_not_known_such_a_sign_is_taken_to_bind_and_says_so(book: RuleBook, reading: str) -> None:
    unknown = for_class(book, reading, None)
    assert unknown.legal_action == LORRY_SIGNS[reading]
    assert unknown.confidence < for_class(book, reading, "car").confidence
    assert "certain vehicles alone" in unknown.note


def test_what_mass_or_size_decides_is_taken_to_bind_and_left_to_the_driver_to_compare(book: RuleBook) -> None:
    doubtful: tuple[tuple[VehicleClass, str], ...] = (
        ("lorry", "height_limit:3.8"), ("van", "no_lorries"), ("bus", "weight_limit:7.5"),
    )  # fmt: skip
    for vehicle, reading in doubtful:
        found = for_class(book, reading, vehicle)
        assert found.legal_action == "no_entry"
        assert "mass, size or use" in found.note


@pytest.mark.parametrize("vehicle", [None, *get_args(VehicleClass)])
def test_no_class_makes_any_sign_of_any_pack_less_careful_than_its_entry(vehicle: VehicleClass | None) -> None:
    packs = [path.parent for path in data("rulepacks").glob("*/manifest.json") if path.parent.name != "TEST-v1"]
    every, refused = load_book(packs)
    assert not refused
    for pack in every.packs.values():
        for sign in pack.signs.values():
            found = for_class(every, sign.code, vehicle, pack.manifest.jurisdiction)
            assert careful_rank(found.legal_action) <= careful_rank(sign.action)
            unknown = for_class(every, sign.code, None, pack.manifest.jurisdiction)
            assert careful_rank(unknown.legal_action) <= careful_rank(found.legal_action)


def test_every_code_of_the_table_is_a_sign_of_some_pack() -> None:
    assert set(BINDINGS) <= set(vocabulary().signs)


def test_a_sign_of_a_road_tells_a_lorry_its_own_limit(book: RuleBook) -> None:
    limits = [for_class(book, "motorway", vehicle, "GBR").limit for vehicle in ("car", "lorry", None)]
    assert [limit and limit.value for limit in limits] == [70.0, 60.0, 70.0]
