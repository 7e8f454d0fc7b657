"""The limit that answers a question: only one that hangs on nothing the question leaves open, never above the law."""

from typing import Any

import msgspec
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from drivemcp.paths import data
from proto.rules import Situation
from services.rules.book import load_book
from services.rules.limits.precedence import decide
from services.rules.lookup.asked_facts import asked_facts, asked_light, excluded_roads
from services.rules.lookup.told_limit import governing, told_limit
from services.rules.packs.format import Limit
from services.rules.service import RulesConfig

BOOK = load_book([data(f"rulepacks/{name}") for name in RulesConfig().packs])[0]


def told(pack: str, provision: str, query: str, language: str = "en") -> tuple[tuple[float, str] | None, str]:
    law = BOOK.packs[pack]
    limit, words = told_limit(law, law.provisions[provision].effects, query, law.manifest.jurisdiction, language)
    return (None if limit is None else (limit.value, limit.unit)), words


@pytest.mark.parametrize(
    ("pack", "provision", "query", "limit", "words"),
    [
        ("FRA-v1", "fra-speed-motorway", "speed limit on motorways", (130, "km/h"), ""),
        (
            "FRA-v1",
            "fra-speed-motorway",
            "Je viens d'avoir le permis, à combien sur l'autoroute ?",
            None,
            "probationary",
        ),
        ("FRA-v1", "fra-speed-motorway", "autoroute quand il pleut", None, "wet road"),
        ("FRA-v1", "fra-speed-heavy-motorway", "vitesse poids lourds autoroute", (90, "km/h"), "vehicle class"),
        ("FRA-v1", "fra-speed-heavy-motorway", "how fast on the motorway", (90, "km/h"), "vehicle class"),
        ("AUT-v1", "aut-speed-motorway", "Wie schnell darf ein Lkw auf der Autobahn?", None, "time of day"),
        ("GBR-v1", "gbr-speed-single", "How fast in my Transit with one lane each way?", None, "class"),
        ("GBR-v1", "gbr-speed-single", "limit on a single carriageway", (60, "mph"), "vehicle class"),
        ("GBR-v1", "gbr-speed-goods-light", "speed limit for vans", None, "vehicle class"),
        ("CHE-v1", "che-speed-motorway", "Wie schnell mit dem Pferdeanhänger?", None, "class"),
        ("NLD-v1", "nld-speed-motorway", "speed limit on motorway", None, "time of day"),
        ("DEU-v1", "deu-speed-visibility", "how fast in fog", None, "visibility"),
        ("POL-v1", "pol-speed-expressway", "expressway limit", None, "divided"),
        ("DEU-v1", "deu-speed-adapt", "how fast in a bend", None, ""),
    ],
)
def test_a_limit_is_told_where_it_hangs_on_nothing_that_the_question_leaves_open(
    pack: str, provision: str, query: str, limit: tuple[float, str] | None, words: str
) -> None:
    found, said = told(pack, provision, query)
    assert found == limit
    assert words in said
    assert bool(said) == bool(words)


@pytest.mark.parametrize(
    ("pack", "provision", "query", "law"),
    [
        ("FRA-v1", "fra-speed-motorway", "Permis depuis un an, à combien sur l'autoroute ?", 110),
        ("FRA-v1", "fra-speed-motorway", "my daughter got her licence in May, autoroute", 110),
        ("FRA-v1", "fra-speed-motorway", "Führerschein seit acht Monaten, Autobahn in Frankreich", 110),
        ("FRA-v1", "fra-speed-rural", "j'ai décroché mon permis hier, sur une départementale", 80),
        ("FRA-v1", "fra-speed-motorway", "un 19 tonnes sur l'autoroute", 90),
        ("FRA-v1", "fra-speed-motorway", "il pleut, à combien sur l'autoroute", 110),
        ("FRA-v1", "fra-speed-motorway", "how fast in thick fog", 50),
        ("GBR-v1", "gbr-speed-single", "my Vivaro on a country road", 50),
        ("GBR-v1", "gbr-speed-dual", "Luton van on a dual carriageway", 60),
        ("GBR-v1", "gbr-speed-dual", "what may an artic do on a dual carriageway", 60),
        ("GBR-v1", "gbr-speed-motorway", "towing a horsebox up the M6", 60),
        ("AUT-v1", "aut-speed-motorway", "Sattelzug auf der Westautobahn", 80),
        ("AUT-v1", "aut-speed-motorway", "Wie schnell nachts auf der Autobahn?", 110),
        ("CHE-v1", "che-speed-motorway", "mit dem Wohnwagen nach Bern", 100),
        ("CHE-v1", "che-speed-motorway", "un poids lourd sur l'autoroute", 80),
        ("NLD-v1", "nld-speed-motorway", "hoe hard op de snelweg om drie uur 's middags", 100),
        ("NLD-v1", "nld-speed-motorway", "met de aanhanger op de snelweg", 90),
        ("DEU-v1", "deu-speed-rural-car", "12-Tonner außerorts", 60),
        ("DEU-v1", "deu-speed-rural-car", "Tempo bei Schneefall mit Schneeketten auf der Landstraße", 50),
    ],
)
def test_a_fresh_way_to_ask_is_told_no_limit_above_the_law(pack: str, provision: str, query: str, law: float) -> None:
    found, said = told(pack, provision, query)
    assert found[0] <= law if found is not None else said


@pytest.mark.parametrize(
    ("query", "facts"),
    [
        ("Darf mein Lkw hier fahren, wenn es schneit?", {"vehicle_class": "lorry", "snow": True}),
        ("speed with snow chains and a caravan", {"vehicle_class": "car_trailer", "snow": True, "snow_chains": True}),
        ("Brouillard en camionnette", {"vehicle_class": "van", "visibility_m": 40.0}),
        ("Gilt das für unsere Zwölftonner?", {"vehicle_class": "lorry"}),
        ("bus lane", {"vehicle_class": "bus"}),
        ("How fast may I drive?", {}),
        ("advantage of a vanilla coaching transition", {}),
        ("Wie schnell außerhalb geschlossener Ortschaften?", {"road_type": "rural"}),
        ("Tempo innerhalb geschlossener Ortschaften", {"road_type": "urban"}),
        ("hors agglomération sous la pluie", {"road_type": "rural", "wet": True}),
        ("en agglomération", {"road_type": "urban"}),
        ("fuori dei centri abitati", {"road_type": "rural"}),
        ("buiten de bebouwde kom", {"road_type": "rural"}),
        ("poza obszarem zabudowanym", {"road_type": "rural"}),
        ("fuera de poblado", {"road_type": "rural"}),
        ("outside a built-up area", {"road_type": "rural"}),
        ("inside and outside of town: in a town?", {}),
        ("lorry on the motorway", {"vehicle_class": "lorry", "road_type": "motorway"}),
        ("abseits der Autobahn", {}),
    ],
)
def test_facts_are_heard_in_the_question(query: str, facts: dict[str, Any]) -> None:
    assert asked_facts(query) == facts


@pytest.mark.parametrize("query", ["abseits der Autobahn", "hors autoroute", "off the motorway", "poza autostradą"])
def test_a_road_that_is_excluded_is_not_meant(query: str) -> None:
    assert excluded_roads(query) == {"motorway"}
    assert told("DEU-v1", "deu-speed-advisory", query)[0] is None


@pytest.mark.parametrize(
    ("country", "found", "query", "governs"),
    [
        ("DEU", "deu-speed-urban", "Wie schnell außerorts?", "deu-speed-rural-car"),
        ("DEU", "deu-speed-urban", "Wie schnell innerorts?", ""),
        ("DEU", "deu-speed-urban", "Wie schnell?", ""),
        ("DEU", "deu-speed-urban", "Mindestgeschwindigkeit auf der Autobahn", ""),
        ("FRA", "fra-speed-urban", "vitesse hors agglomération sous la pluie", "fra-speed-rural"),
        ("ITA", "ita-speed-main", "velocità fuori dei centri abitati", "ita-speed-rural"),
        ("BEL-WAL", "bel-speed-urban", "vitesse hors agglomération", "bel-speed-rural-wallonia"),
        ("GBR-SCT", "gbr-speed-goods-heavy", "lorry limit on a single carriageway", "gbr-speed-goods-heavy-scotland"),
        ("GBR-WLS", "gbr-speed-restricted", "limit in a built-up area", "gbr-speed-restricted-wales"),
        ("NLD", "nld-speed-urban", "brommer buiten de bebouwde kom", ""),
        ("POL", "pol-speed-motorway", "Ile z przyczepą na autostradzie?", "pol-speed-heavy-fast"),
        ("DEU", "deu-speed-advisory", "Mit Anhänger auf der Autobahn", "deu-speed-motorway-heavy"),
        ("FRA", "fra-speed-motorway", "autoroute par temps de pluie", "fra-speed-rain-motorway"),
        ("FRA", "fra-speed-motorway", "vitesse sur autoroute", ""),
    ],
)
def test_the_limit_of_the_road_and_the_part_that_are_asked_about_governs(
    country: str, found: str, query: str, governs: str
) -> None:
    law = BOOK.packs[f"{country[:3]}-v1"]
    assert governing(law, law.provisions[found].effects, query, country) == governs


@pytest.mark.parametrize(
    ("country", "provision", "query"),
    [
        ("IRL", "irl-speed-motorway", "minimum speed on a motorway"),
        ("POL", "pol-speed-motorway", "Minimalna prędkość na autostradzie"),
        ("NLD", "nld-speed-rural", "Maximumsnelheid brommer buiten de bebouwde kom"),
        ("DEU", "deu-speed-urban", "Wie schnell mit dem Mofa?"),
        ("ESP", "esp-speed-motorway", "¿A cuánto puede ir una autocaravana por autopista?"),
    ],
)
def test_a_highest_speed_of_a_car_answers_no_question_on_another_vehicle_or_a_lowest_one(
    country: str, provision: str, query: str
) -> None:
    assert told(f"{country}-v1", provision, query)[0] is None


@pytest.mark.parametrize(
    ("query", "light"),
    [
        ("Darf ich bei Rot rechts abbiegen?", "red"),
        ("Can I turn left on a red light?", "red"),
        ("Mag ik rechtsaf door rood?", "red"),
        ("Posso girare a destra col rosso?", "red"),
        ("gelbes Blinklicht an der Ampel", "amber_flashing"),
        ("feu orange clignotant", "amber_flashing"),
        ("the red car", None),
    ],
)
def test_the_light_that_a_question_is_about_is_heard(query: str, light: str | None) -> None:
    assert asked_light(query) == light


EVERY = [
    (pack.manifest.id, provision.id, road)
    for pack in BOOK.packs.values()
    for provision in pack.provisions.values()
    for effect in provision.effects
    if isinstance(effect, Limit)
    for road in effect.when.road_types
]


@settings(max_examples=300, deadline=None)
@given(
    st.sampled_from(EVERY),
    st.sampled_from(
        [({}, ""), ({"vehicle_class": "lorry"}, "lorry"), ({"vehicle_class": "van"}, "van"), ({"novice": True}, "novice"),
         ({"vehicle_class": "car_trailer"}, "caravan"), ({"vehicle_class": "bus"}, "bus"), ({"wet": True}, "in the rain")]
    ),
    st.floats(0.0, 23.99),
)  # fmt: skip
def test_no_limit_is_told_above_what_the_law_sets_for_the_asked_case(
    entry: tuple[str, str, Any], case: tuple[dict[str, Any], str], hour: float
) -> None:
    name, provision, road = entry
    pack = BOOK.packs[name]
    facts, words = case
    limit, _ = told_limit(pack, pack.provisions[provision].effects, f"limit {words}", pack.manifest.jurisdiction, "en")
    usual = Situation(jurisdiction=pack.manifest.jurisdiction, wet=False, snow=False, visibility_m=1000.0, novice=False)
    found = decide(
        pack, msgspec.structs.replace(usual, road_type=road, lit=False, divided=True, time_of_day_h=hour, **facts)
    ).candidate
    of_road = {
        each.value
        for each in pack.provisions[provision].effects
        if isinstance(each, Limit) and road in each.when.road_types
    }
    if limit is not None and found is not None and limit.value in of_road:
        assert limit.mps <= found.mps + 0.01
