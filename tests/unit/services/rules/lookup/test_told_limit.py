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
from services.rules.lookup.asked_facts import asked_facts
from services.rules.lookup.told_limit import told_limit
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
    ],
)
def test_facts_are_heard_in_the_question(query: str, facts: dict[str, Any]) -> None:
    assert asked_facts(query) == facts


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
