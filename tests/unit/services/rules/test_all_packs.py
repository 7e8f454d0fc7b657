"""Of every rulepack: restrictions and unknown facts never raise a limit, and numbers come back as they were posted."""

from itertools import product
from typing import Any, get_args

import msgspec
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from domain.units import to_mps
from drivemcp.paths import data
from proto.rules import PostedLimit, RightOfWayQuestion, RulesAnswer, Situation, VehicleClass
from proto.scene import Candidate
from services.rules.book import load_book
from services.rules.limits.limit_answer import applicable_limit
from services.rules.packs.format import Advisory, Limit
from services.rules.packs.loading import Pack
from services.rules.right_of_way import right_of_way
from services.rules.signs.meaning import careful_rank

BOOK, REFUSED = load_book(sorted(path.parent for path in data("rulepacks").glob("*/manifest.json")))
EXAMPLES = settings(max_examples=150, deadline=None)
FACTS = (
    "wet", "visibility_m", "snow", "road_type", "jurisdiction", "time_of_day_h", "vehicle_class", "road_name", "lit",
    "divided", "novice", "electric", "plate_100", "standing", "snow_chains", "trailer_t", "combination_t",
)  # fmt: skip
COUNTRIES = sorted({pack.manifest.jurisdiction for pack in BOOK.packs.values()})
PARTS = ["GBR-WLS", "GBR-SCT", "BEL-VLG", "BEL-WAL", "BEL-BRU"]
SIGNED_ROADS = ("urban", "rural", "motorway", "dual_carriageway", "expressway")
"""A living street begins at its sign only, so an unknown road is not taken for one."""
PLAIN = Situation(
    road_type="rural", wet=False, snow=False, visibility_m=300.0, time_of_day_h=12.0, novice=False, lit=False
)

VALUES = st.sampled_from([15.0, 20.0, 25.0, 30.0, 50.0, 60.0, 65.0, 70.0, 80.0, 90.0, 100.0, 110.0, 120.0, 130.0])
UNITS = st.sampled_from(["km/h", "mph"])
PLATES = st.sampled_from(
    [
        "plate:when_wet", "plate:when_wet:de", "plate:lorries", "plate:time:22-6 h", "plate:time:7-9, 4-6 PM",
        "plate:distance", "plate:?", "x",
    ]
)  # fmt: skip
POSTED = st.builds(
    PostedLimit,
    value=VALUES,
    unit=UNITS,
    scope=st.sampled_from(["permanent", "gantry", "when_wet", "zone", "temporary"]),
    confidence=st.floats(0.0, 1.0),
    plates=st.lists(PLATES, max_size=2).map(tuple),
)
CANDIDATES = st.builds(Candidate, reading=VALUES.map(lambda v: f"limit:{v:g}"), confidence=st.floats(0.0, 1.0))
SITUATIONS = st.builds(
    Situation,
    jurisdiction=st.sampled_from([*COUNTRIES, *PARTS, None]),
    road_type=st.sampled_from([*SIGNED_ROADS, None]),
    vehicle_class=st.sampled_from([*get_args(VehicleClass), None]),
    posted=st.lists(POSTED, max_size=3).map(tuple),
    wet=st.sampled_from([True, False, None]),
    visibility_m=st.sampled_from([None, 20.0, 49.9, 50.0, 500.0]),
    snow=st.sampled_from([True, False, None]),
    time_of_day_h=st.sampled_from([None, 3.0, 4.9, 6.0, 12.0, 19.0, 22.0, 23.0]),
    zone=st.sampled_from([None, 20.0, 30.0]),
    candidates=st.lists(CANDIDATES, max_size=2).map(tuple),
    road_name=st.sampled_from([None, "A 1", "A12", "US 290", "SR 20", "Main Street"]),
    **{
        name: st.sampled_from([True, False, None])
        for name in ("lit", "divided", "novice", "electric", "plate_100", "standing")
    },
    snow_chains=st.sampled_from([True, False, None]),
    **{name: st.sampled_from([None, 0.5, 0.75, 1.0, 3.5, 3.6, 40.0]) for name in ("trailer_t", "combination_t")},
).filter(lambda situation: situation.vehicle_class != "car_snow_chains" or situation.snow_chains is not False)
"""None contradicts itself: a car on chains is not one without them."""
QUESTIONS = st.builds(
    RightOfWayQuestion,
    jurisdiction=st.sampled_from([*COUNTRIES, *PARTS]),
    signs=st.lists(st.sampled_from(["stop", "yield", "priority_road", "roundabout", "crossing"]), max_size=2).map(
        tuple
    ),
    light=st.sampled_from([None, "red", "red_amber", "amber", "green", "off"]),
    pedestrians_on_crossing=st.booleans(),
    traffic_from_priority_side=st.booleans(),
)


def mps(answer: RulesAnswer) -> float:
    return answer.limit.mps if answer.limit else float("inf")


def ask(situation: Situation, **changes: Any) -> RulesAnswer:
    return applicable_limit(BOOK, msgspec.structs.replace(situation, **changes))


def declared(pack: Pack) -> set[tuple[float, str]]:
    """Every number that the law of a pack states itself."""
    effects = [effect for provision in pack.provisions.values() for effect in provision.effects]
    return {(effect.value, effect.unit) for effect in effects if isinstance(effect, Limit | Advisory)}


def test_every_pack_is_there() -> None:
    assert REFUSED == ()
    assert len(BOOK.packs) >= 11


@EXAMPLES
@given(SITUATIONS, st.sampled_from(FACTS))
def test_a_fact_that_becomes_unknown_never_raises_the_limit(situation: Situation, fact: str) -> None:
    assert mps(ask(situation, **{fact: None})) <= mps(ask(situation))


@EXAMPLES
@given(SITUATIONS, POSTED)
def test_a_sign_that_shows_no_more_than_the_limit_never_raises_it(situation: Situation, sign: PostedLimit) -> None:
    before = ask(situation)
    if to_mps(sign.value, sign.unit) <= mps(before):
        assert mps(ask(situation, posted=(*situation.posted, sign))) <= mps(before)


@EXAMPLES
@given(SITUATIONS, POSTED.filter(lambda p: not p.plates))
def test_a_further_sign_never_raises_a_limit_that_signs_set(situation: Situation, sign: PostedLimit) -> None:
    first = PostedLimit(value=sign.value, unit=sign.unit)  # surely in force: the law's default is replaced already
    before = ask(situation, posted=(*situation.posted, first))
    assert mps(ask(situation, posted=(*situation.posted, first, sign))) <= mps(before)


@EXAMPLES
@given(SITUATIONS)
def test_every_number_was_posted_or_stands_in_the_law(situation: Situation) -> None:
    limit = ask(situation).limit
    read = [float(each.reading.removeprefix("limit:")) for each in situation.candidates]
    shown = {(value, unit) for value in (*(p.value for p in situation.posted), *read) for unit in ("km/h", "mph")}
    laws = set().union(*(declared(pack) for pack in BOOK.for_jurisdiction(situation.jurisdiction)))
    if limit is not None:
        assert (limit.value, limit.unit) in shown | laws | {(situation.zone, "km/h"), (situation.zone, "mph")}
        assert limit.mps == to_mps(limit.value, limit.unit)


@pytest.mark.parametrize(
    ("told", "masses", "heavier"),
    [
        ("car", {"mass_t": 5.0}, "lorry_light"),
        ("van", {"mass_t": 5.0}, "lorry_light"),
        ("car", {"mass_t": 9.0}, "lorry"),
        ("lorry_light", {"mass_t": 9.0}, "lorry"),
        ("car_trailer", {"trailer_t": 4.0}, "lorry_trailer"),
    ],
)
def test_a_class_that_the_masses_contradict_gets_no_limit_above_the_heavier_ones(
    told: VehicleClass, masses: dict[str, float], heavier: VehicleClass
) -> None:
    for country, road in product(COUNTRIES, ("rural", "dual_carriageway", "motorway")):
        here = msgspec.structs.replace(PLAIN, jurisdiction=country, road_type=road, **masses)
        found, least = (
            applicable_limit(BOOK, msgspec.structs.replace(here, vehicle_class=each)).limit for each in (told, heavier)
        )
        assert least is None or (found is not None and found.mps <= least.mps), (country, road)


@pytest.mark.parametrize("name", sorted(BOOK.packs))
def test_what_is_posted_comes_back_unchanged(name: str) -> None:
    manifest = BOOK.packs[name].manifest
    low, high = manifest.plausible_limits["rural"]
    values = sorted(value for value in BOOK.packs[name].signs["limit"].values if low <= value <= high)
    for value in values:
        sign = PostedLimit(value=value, unit=manifest.units)
        limit = ask(PLAIN, jurisdiction=manifest.jurisdiction, posted=(sign,)).limit
        assert limit is not None
        assert (limit.value, limit.unit, limit.mps) == (value, manifest.units, to_mps(value, manifest.units))
    assert values


@EXAMPLES
@given(QUESTIONS, st.sampled_from(["pedestrians_on_crossing", "traffic_from_priority_side", "jurisdiction"]))
def test_what_is_unknown_at_a_junction_never_allows_more(question: RightOfWayQuestion, fact: str) -> None:
    if "crossing" not in question.signs:  # away from crossings nobody is taken to be crossing
        question = msgspec.structs.replace(question, pedestrians_on_crossing=False)
    known, unknown = right_of_way(BOOK, question), right_of_way(BOOK, msgspec.structs.replace(question, **{fact: None}))
    assert careful_rank(unknown.legal_action) <= careful_rank(known.legal_action)
