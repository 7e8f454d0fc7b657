"""What applies: unknown facts and further restrictions never raise a limit."""

import math
from typing import Any, get_args

import msgspec
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from drivemcp.paths import data
from proto.rules import PostedLimit, RulesAnswer, Situation, VehicleClass
from proto.scene import Candidate
from services.rules.book import RuleBook, load_book
from services.rules.limits.limit_answer import applicable_limit
from services.rules.packs.format import Plate
from services.rules.situations import coarse

BOOK = load_book(sorted(path.parent for path in data("rulepacks").glob("*/manifest.json")))[0]
EXAMPLES = settings(max_examples=150, deadline=None)

VALUES = st.sampled_from([20.0, 30.0, 50.0, 60.0, 70.0, 80.0, 100.0, 120.0])
PLATES = st.sampled_from(["plate:when_wet:de", "plate:lorries", "plate:time:22-6 h", "plate:distance", "plate:?", "x"])
POSTED = st.builds(
    PostedLimit,
    value=VALUES,
    unit=st.sampled_from(["km/h", "mph"]),
    scope=st.sampled_from(["permanent", "gantry", "when_wet", "zone", "temporary"]),
    confidence=st.floats(0.0, 1.0),
    plates=st.lists(PLATES, max_size=2).map(tuple),
)
CANDIDATES = st.builds(Candidate, reading=VALUES.map(lambda v: f"limit:{v:g}"), confidence=st.floats(0.0, 1.0))
SIGNED_ROADS = ("urban", "rural", "motorway", "dual_carriageway")
"""A living street begins at its sign only, so an unknown road is not taken for one."""
SITUATIONS = st.builds(
    Situation,
    jurisdiction=st.sampled_from([*sorted({p.manifest.jurisdiction for p in BOOK.packs.values()}), None]),
    road_type=st.sampled_from([*SIGNED_ROADS, None]),
    vehicle_class=st.sampled_from([*get_args(VehicleClass), None]),
    posted=st.lists(POSTED, max_size=3).map(tuple),
    wet=st.sampled_from([True, False, None]),
    visibility_m=st.sampled_from([None, 20.0, 49.9, 50.0, 500.0]),
    snow=st.sampled_from([True, False, None]),
    time_of_day_h=st.sampled_from([None, 3.0, 12.0, 22.0]),
    zone=st.sampled_from([None, 20.0, 30.0]),
    candidates=st.lists(CANDIDATES, max_size=2).map(tuple),
)


def mps(answer: RulesAnswer) -> float:
    return answer.limit.mps if answer.limit else float("inf")


def ask(situation: Situation, **changes: Any) -> RulesAnswer:
    return applicable_limit(BOOK, msgspec.structs.replace(situation, **changes))


@EXAMPLES
@given(SITUATIONS, st.one_of(st.floats(min_value=24.0), st.floats(max_value=0.0, exclude_max=True), st.just(math.nan)))
def test_an_unknown_or_impossible_time_never_raises_the_limit(situation: Situation, time_h: float) -> None:
    lowest = min(mps(ask(situation, time_of_day_h=hour)) for hour in (None, *range(24)))
    assert mps(ask(situation, time_of_day_h=time_h)) <= lowest
    assert ask(situation, time_of_day_h=time_h) == ask(situation, time_of_day_h=None)


@pytest.mark.parametrize("time_h", [24.0, 24.5, 30.0, -1.0])
def test_a_time_that_no_clock_shows_leaves_a_limit_by_hours_in_force(time_h: float) -> None:
    by_day = ask(
        Situation(jurisdiction="NLD", road_type="motorway", wet=False, visibility_m=500.0, time_of_day_h=time_h)
    )
    assert mps(by_day) == pytest.approx(100 / 3.6)
    night = PostedLimit(value=50, unit="km/h", confidence=0.95, plates=("plate:time:0-6 h",))
    posted = Situation(jurisdiction="DEU", road_type="rural", wet=False, visibility_m=500.0, posted=(night,))
    assert mps(ask(posted, time_of_day_h=time_h)) == pytest.approx(50 / 3.6)


@EXAMPLES
@given(SITUATIONS, VALUES, st.sampled_from(["km/h", "mph"]), st.floats(0.0, 1.0))
def test_a_limit_when_wet_never_raises_any_limit(situation: Situation, value: float, unit: Any, sure: float) -> None:
    sign = PostedLimit(value=value, unit=unit, scope="when_wet", confidence=sure)
    assert mps(ask(situation, posted=(*situation.posted, sign))) <= mps(ask(situation))


@EXAMPLES
@given(SITUATIONS, POSTED, st.floats(0.0, 0.49))
def test_a_sign_hardly_read_never_raises_any_limit(situation: Situation, sign: PostedLimit, sure: float) -> None:
    doubtful = msgspec.structs.replace(sign, confidence=sure)
    assert mps(ask(situation, posted=(*situation.posted, doubtful))) <= mps(ask(situation))


@EXAMPLES
@given(SITUATIONS, st.floats(0.0, 1.0))
def test_lower_confidence_in_the_signs_never_raises_the_limit(situation: Situation, factor: float) -> None:
    less = tuple(msgspec.structs.replace(p, confidence=p.confidence * factor) for p in situation.posted)
    assert mps(ask(situation, posted=less)) <= mps(ask(situation))


@EXAMPLES
@given(SITUATIONS, CANDIDATES)
def test_a_further_candidate_never_raises_the_limit_nor_the_confidence(situation: Situation, more: Candidate) -> None:
    before, after = ask(situation), ask(situation, candidates=(*situation.candidates, more))
    assert mps(after) <= mps(before)


@EXAMPLES
@given(SITUATIONS, st.sampled_from([20.0, 30.0]))
def test_fog_never_raises_the_limit(situation: Situation, visibility_m: float) -> None:
    assert mps(ask(situation, visibility_m=visibility_m)) <= mps(ask(situation, visibility_m=500.0))


@EXAMPLES
@given(SITUATIONS)
def test_an_answer_is_whole(situation: Situation) -> None:
    answer = ask(situation)
    assert 0.0 <= answer.confidence <= 1.0
    assert answer.rulepack_version
    assert answer.limit is None or (answer.limit.mps > 0 and answer.citations and answer.note)
    if situation.jurisdiction is None:
        assert answer.confidence <= 0.3
        assert "jurisdiction" in answer.degraded


@pytest.mark.parametrize("value", [0.0, -50.0, float("nan"), float("inf")])
def test_a_sign_with_an_impossible_number_is_passed_over(value: float) -> None:
    situation = Situation(jurisdiction="DEU", road_type="rural", visibility_m=200.0)
    assert ask(situation, posted=(PostedLimit(value=value, unit="km/h"),)) == ask(situation)


def test_confidence_that_is_no_number_counts_as_none() -> None:
    sign = PostedLimit(value=70, unit="km/h", confidence=float("nan"))
    answer = ask(Situation(jurisdiction="DEU", road_type="urban", visibility_m=200.0, posted=(sign,)))
    assert mps(answer) == pytest.approx(50 / 3.6)


def test_without_any_pack_nothing_is_said_to_be_known() -> None:
    answer = applicable_limit(RuleBook(packs={}), Situation(jurisdiction="DEU"))
    assert (answer.limit, answer.legal_action, answer.confidence) == (None, "unknown", 0.0)


@pytest.mark.parametrize(("scope", "cited"), [("permanent", False), ("when_wet", False), ("gantry", True)])
def test_what_gantries_may_show_when_wet_is_cited_for_gantries_only(scope: str, cited: bool) -> None:
    limit = PostedLimit(value=70.0, unit="km/h", scope=scope, plates=("plate:when_wet:de",))  # type: ignore[arg-type]
    answer = applicable_limit(
        BOOK, Situation(jurisdiction="DEU", road_type="rural", posted=(limit,), wet=True, visibility_m=500.0)
    )
    assert answer.limit is not None
    assert answer.limit.value == 70.0
    assert ("deu-vsl-wet" in [each.provision for each in answer.citations]) is cited
    assert answer.citations[0].provision


@EXAMPLES
@given(st.sampled_from(SIGNED_ROADS), POSTED)
def test_a_plate_that_does_not_say_which_vehicles_never_raises_a_limit(road: Any, sign: PostedLimit) -> None:
    germany = BOOK.packs["DEU-v1"]
    plate = msgspec.structs.replace(germany.signs["plate:lorries"], plate=Plate(type="vehicle"))
    pack = msgspec.structs.replace(germany, signs={**germany.signs, "plate:lorries": plate})
    book = RuleBook(packs={"DEU-v1": pack})
    clear = Situation(jurisdiction="DEU", road_type=road, wet=False, snow=False, visibility_m=500.0)
    under = msgspec.structs.replace(sign, plates=("plate:lorries",))
    more = msgspec.structs.replace(clear, posted=(under,))
    assert mps(applicable_limit(book, more)) <= mps(applicable_limit(book, clear))


def town_with(sure: float, age_s: float, end_sure: float, end_age_s: float) -> float:
    """The limit in a German town under a sign for 30 and, beside it, an end of 30, each read so surely and so long ago."""
    sign = PostedLimit(value=30, unit="km/h", confidence=sure, age_s=age_s)
    posted = (sign, PostedLimit(value=30, unit="km/h", scope="end", confidence=end_sure, age_s=end_age_s))
    clear = Situation(jurisdiction="DEU", road_type="urban", wet=False, snow=False, visibility_m=500.0, posted=posted)
    return mps(applicable_limit(BOOK, coarse(clear)))


@EXAMPLES
@given(st.floats(0.0, 1.0), st.floats(0.0, 1.0), st.floats(0.0, 60.0), st.floats(0.0, 120.0) | st.just(math.nan))
def test_an_end_that_is_older_or_less_sure_than_a_sign_lifts_it_not(
    sure: float, end_sure: float, age_s: float, end_age_s: float
) -> None:
    if end_sure < sure - 0.01 or not end_age_s <= age_s:
        assert town_with(sure, age_s, end_sure, end_age_s) == pytest.approx(30 / 3.6)


def test_a_later_end_that_is_as_sure_lifts_a_sign() -> None:
    assert town_with(0.9, 8.0, 0.9, 2.0) == pytest.approx(50 / 3.6)
    assert town_with(0.9, 2.0, 0.9, 2.0) == pytest.approx(50 / 3.6)


@pytest.mark.parametrize(
    ("country", "vehicle", "undivided", "divided"),
    [
        ("GBR", "car", 60, 70), ("GBR", "lorry", 50, 60), ("GBR-SCT", "lorry", 40, 50), ("GBR", "car_trailer", 50, 60),
        ("FRA", "car", 80, 110), ("FRA", "lorry_light", 80, 90), ("FRA", "lorry_trailer", 60, 80),
    ],
)  # fmt: skip
def test_a_road_called_expressway_has_the_law_of_divided_roads_only_where_it_is_known_to_be_divided(
    country: str, vehicle: VehicleClass, undivided: int, divided: int
) -> None:
    here = Situation(jurisdiction=country, road_type="expressway", vehicle_class=vehicle, wet=False, snow=False, novice=False,
                     visibility_m=500.0)  # fmt: skip
    told = [ask(here, divided=each).limit for each in (None, False, True)]
    assert [each.value for each in told if each is not None] == [undivided, undivided, divided]
