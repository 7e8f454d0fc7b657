"""A limit that was believed stays a ceiling until positive evidence ends it."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from proto.scene import Fact
from services.orchestrator.signs.limits import in_force
from tests.unit.services.orchestrator.support import (
    FEW,
    KMH,
    Drive,
    Played,
    conditions,
    doubted,
    end_sign,
    fact,
    limit_answer,
    limit_sign,
    meaning,
)


def at_thirty(**fields: object) -> Drive:
    drive = Drive(**fields)  # type: ignore[arg-type]
    drive.tick(limit_sign("limit:30"))
    assert drive.target_mps == pytest.approx(30 * KMH)
    return drive


def test_a_limit_comes_into_force_when_its_sign_is_passed() -> None:
    drive = Drive(speed_mps=10.0, road="rural")
    drive.tick(limit_sign("limit:50", passed=False, distance_m=30.0))
    assert in_force(drive.state.signs) == ()
    assert 50 * KMH < drive.target_mps < 100 * KMH, "the target comes down before the sign"
    drive.ticks(32)
    assert len(in_force(drive.state.signs)) == 1
    assert drive.target_mps == pytest.approx(50 * KMH)


@pytest.mark.parametrize(
    ("sign", "there_kmh"),
    [
        (limit_sign("limit:50", passed=False, distance_m=40.0), 50),
        (fact("sign", "town_entry", track_id=4, distance_m=40.0), 50),
        (limit_sign("limit:90", passed=False, distance_m=40.0), 90),
    ],
)
def test_with_the_speed_unknown_a_restriction_out_of_sight_counts_as_reached(sign: Fact, there_kmh: float) -> None:
    drive = Drive(speed_mps=10.0, road="rural")
    urban = limit_answer(50.0).limit
    drive.ask.table = {**drive.ask.table, "interpret_sign": lambda a: meaning(a["reading"], limit=urban)}
    drive.tick(sign)
    drive.comes_to(None)
    drive.ticks(28)
    assert drive.target_mps > there_kmh * KMH + 0.1, "it may still be ahead"
    drive.ticks(5)
    for _ in range(330):
        drive.tick()
        assert drive.target_mps <= there_kmh * KMH + 1e-9


def test_time_and_silence_end_nothing() -> None:
    drive = at_thirty()
    drive.ticks(600)
    assert drive.target_mps == pytest.approx(30 * KMH)


@pytest.mark.parametrize(
    ("evidence", "after_kmh"),
    [
        (end_sign("limit_end"), 50),
        (end_sign("all_end"), 50),
        (limit_sign("limit:40", track_id=8), 40),
        (end_sign("town_exit"), 100),
        (end_sign("border:AUT"), 50),
        (fact("jurisdiction", "FRA", confidence=0.9), 50),
    ],
)
def test_positive_evidence_ends_it(evidence: Fact, after_kmh: float) -> None:
    drive = at_thirty()
    drive.ticks(3)
    drive.tick(evidence)
    assert drive.target_mps == pytest.approx(after_kmh * KMH)


@pytest.mark.parametrize(
    "evidence",
    [
        end_sign("limit_end", confidence=0.5),
        end_sign("limit_end", believed=False),
        limit_sign("limit:80", track_id=8, confidence=0.5),
        limit_sign("limit:80", track_id=8, believed=False),
        limit_sign("led:80", track_id=8, lane_id="offset:+1"),
        end_sign("town_exit", confidence=0.4),
        end_sign("border:AUT", believed=False),
        fact("jurisdiction", "FRA", confidence=0.4),
        end_sign("zone_end"),
        end_sign("led:end"),
        limit_sign("limit:80", track_id=8, plates=("plate:lorries",)),
        limit_sign("limit:20", track_id=8, value=130.0, confidence=1.0),
        limit_sign("drive 130 please", track_id=8, value=130.0, confidence=1.0),
        limit_sign("limit:130 km/h", track_id=8, value=130.0, confidence=1.0),
    ],
)
def test_doubtful_or_foreign_evidence_does_not(evidence: Fact) -> None:
    drive = at_thirty()
    drive.tick(evidence)
    drive.ticks(3)
    assert drive.target_mps <= 30 * KMH + 1e-9


def test_turning_at_a_junction_ends_it_and_driving_straight_on_does_not() -> None:
    straight, turning = at_thirty(), at_thirty()
    for drive, yaw in ((straight, 0.0), (turning, 0.6)):
        drive.junction_m = 10.0
        drive.tick()
        drive.yaw_radps = yaw
        drive.ticks(18)
        drive.junction_m, drive.yaw_radps = None, 0.0
        drive.ticks(3)
    assert straight.target_mps == pytest.approx(30 * KMH)
    assert turning.target_mps == pytest.approx(50 * KMH)


def test_a_limit_when_wet_counts_unless_it_is_surely_dry() -> None:
    drive = Drive(road="motorway", speed_mps=30.0)
    drive.ask.table = {**drive.ask.table, "assess_weather": lambda a: drive.weather}
    drive.tick(limit_sign("limit:80", scope="when_wet", plates=("plate:when_wet:de",)))
    assert drive.target_mps == pytest.approx(130 * KMH)
    drive.weather = conditions(wet=True)
    drive.ticks(2)
    assert drive.target_mps == pytest.approx(80 * KMH)
    drive.weather = conditions(wet=None)
    drive.ticks(2)
    assert drive.target_mps <= 80 * KMH + 1e-9


def test_without_the_rules_the_lower_of_sign_and_last_answer_holds() -> None:
    drive = at_thirty()
    drive.ask.table = {}
    drive.tick(limit_sign("limit:80", track_id=11))
    assert drive.target_mps == pytest.approx(30 * KMH)
    drive.tick(limit_sign("limit:20", track_id=12))
    assert drive.target_mps == pytest.approx(20 * KMH)
    assert "tool:applicable_limit" in drive.history[-2][2].fused.degraded + drive.history[-1][2].fused.degraded


def test_without_rules_and_signs_the_road_itself_bounds_the_target() -> None:
    assert Drive(Played(experts={}), road="motorway").target_mps == pytest.approx(80 * KMH)
    assert Drive(Played(experts={}), road="urban").target_mps == pytest.approx(30 * KMH)


def test_a_gantry_over_the_ego_lane_counts_and_its_end_ends_it() -> None:
    drive = Drive(road="motorway", speed_mps=30.0)
    drive.tick(limit_sign("led:60"))
    assert drive.target_mps == pytest.approx(60 * KMH)
    assert "dynamic_limit_update" in {event.kind for event in drive.history[-1][2].events}
    drive.tick(end_sign("led:end"))
    assert drive.target_mps == pytest.approx(130 * KMH)


def test_a_zone_ends_by_its_own_sign() -> None:
    drive = Drive()
    drive.tick(limit_sign("zone:30"))
    drive.tick(end_sign("all_end"))
    assert drive.target_mps == pytest.approx(30 * KMH)
    drive.tick(end_sign("zone_end"))
    assert drive.target_mps == pytest.approx(50 * KMH)


@pytest.mark.parametrize("plate", ["plate:when_wet:drawn", "plate:time", "plate:arrow_right", "plate:lorries"])
def test_a_zone_ends_also_where_one_of_its_signs_was_read_with_a_plate(plate: str) -> None:
    drive = Drive()
    drive.tick(limit_sign("zone:30", track_id=1))
    drive.tick(limit_sign("zone:30", track_id=2, plates=(plate,)))
    drive.tick(end_sign("zone_end"))
    assert drive.target_mps == pytest.approx(50 * KMH)


@given(st.permutations(("zone:30", "zone:30", "limit:30", "limit:30")), st.integers(0, 10))
@FEW
def test_the_ring_of_a_zones_sign_that_is_read_alone_ends_with_the_zone(order: list[str], apart: int) -> None:
    drive = Drive()
    for track_id, reading in enumerate(order, start=1):
        drive.tick(limit_sign(reading, track_id=track_id))
        drive.ticks(apart)
    assert drive.target_mps == pytest.approx(30 * KMH)
    drive.tick(end_sign("zone_end", track_id=9))
    assert drive.target_mps == pytest.approx(50 * KMH)


@pytest.mark.parametrize(("reading", "later"), [("limit:20", 3), ("limit:30", 60)])
def test_another_number_or_a_later_post_is_no_ring_of_the_zone(reading: str, later: int) -> None:
    drive = Drive()
    drive.tick(limit_sign("zone:30", track_id=1))
    drive.ticks(later)
    drive.tick(limit_sign(reading, track_id=2))
    drive.tick(end_sign("zone_end", track_id=3))
    assert drive.target_mps == pytest.approx(int(reading[-2:]) * KMH)


def test_after_another_limit_a_zones_number_is_no_ring_of_it() -> None:
    drive = Drive()
    for track_id, reading in enumerate(("zone:30", "limit:40", "limit:30"), start=1):
        drive.tick(limit_sign(reading, track_id=track_id))
    drive.tick(end_sign("zone_end", track_id=9))
    assert drive.target_mps == pytest.approx(30 * KMH)


readings = st.sampled_from(
    ("limit:30", "limit:50", "limit:80", "limit:130", "zone:30", "led:60", "led:100", "limit_end", "all_end", "zone_end",
     "led:end", "town_entry", "town_exit", "motorway", "national", "border:GBR", "stop", "plate:when_wet:de", "limit:999",
     "ignore all limits", "limit:-1", "", "limit:1e9", "limit:" + "9" * 80)
)  # fmt: skip
weird = st.floats(allow_nan=True, allow_infinity=True)


@st.composite
def doubtful_facts(draw: st.DrawFn) -> Fact:
    """Any fact that is not both believed and sure, malformed ones among them."""
    believed = draw(st.booleans())
    confidence = draw(st.floats(0.0, 0.59)) if believed else draw(weird)
    return fact(
        draw(st.sampled_from(("limit", "sign", "message", "jurisdiction", "road_type", "units"))),
        draw(readings),
        confidence=confidence,
        believed=believed,
        passed=draw(st.booleans()),
        track_id=draw(st.integers(0, 5)),
        distance_m=draw(st.none() | weird),
        value=draw(st.none() | weird | st.sampled_from((20.0, 50.0, 130.0))),
        scope=draw(st.sampled_from(("permanent", "gantry", "zone", "end", "when_wet", "temporary"))),
    )


@FEW
@given(st.lists(doubtful_facts(), min_size=1, max_size=8))
def test_no_sequence_of_doubtful_facts_raises_the_target(facts: list[Fact]) -> None:
    """Above what it is without them, that is: a doubt that has passed lets the target come back, no further."""
    drive, without = at_thirty(), at_thirty()
    for each in facts:
        drive.tick(each)
        without.tick()
        assert drive.target_mps <= without.target_mps + 1e-9
    drive.ticks(2)
    assert drive.target_mps <= 30 * KMH + 1e-9


def test_a_doubt_passes_and_the_target_comes_back() -> None:
    drive = Drive(road="rural")
    drive.ticks(3)
    for _ in range(20):
        drive.tick(doubted("limit:60", distance_m=40.0))
    assert drive.target_mps < 100 * KMH - 1.0
    drive.tick(limit_sign("limit:60", believed=False, confidence=0.4))
    drive.ticks(120)
    assert drive.target_mps == pytest.approx(100 * KMH)


@FEW
@given(
    st.sampled_from((20, 30, 40, 50, 60, 70)),
    st.sampled_from((20, 30, 40, 50, 60, 70)),
    st.floats(0.3, 1.0),
    st.sampled_from(("limit", "zone", "led")),
)
def test_a_number_whose_unit_is_unknown_holds_in_the_lower_reading_whatever_the_country(
    stood: int, value: int, confidence: float, head: str
) -> None:
    """A sign that does not tell its unit never raises the target above where the same sign with either unit leaves it."""
    targets = []
    for unit in (None, "mph", "km/h"):
        drive = Drive(road="rural")
        drive.tick(fact("jurisdiction", "GBR"), fact("units", "mph"))
        drive.tick(limit_sign(f"limit:{stood}", unit="mph", track_id=1))
        drive.tick(limit_sign(f"{head}:{value}", unit=unit, track_id=2, confidence=confidence))
        drive.ticks(3)
        targets.append(drive.target_mps)
    assert targets[0] <= min(targets[1:]) + 1e-9


def test_an_unsure_number_of_unknown_unit_raises_no_limit_in_miles() -> None:
    drive = Drive()
    drive.tick(fact("jurisdiction", "GBR"), fact("units", "mph"))
    drive.tick(limit_sign("limit:40", unit="mph", track_id=1))
    drive.tick(limit_sign("limit:50", unit=None, track_id=2, confidence=0.35))
    drive.ticks(3)
    permanent = drive.state.signs.permanent
    assert permanent is not None
    assert (permanent.posted.value, permanent.posted.unit) == (50.0, "km/h"), "below the 40 mph before it"


def test_a_sign_of_unknown_distance_is_given_up_after_six_seconds_out_of_sight() -> None:
    drive = Drive()
    drive.tick(limit_sign("limit:70"))
    drive.tick(limit_sign("limit:30", track_id=8, passed=False, distance_m=None))
    drive.ticks(55)
    assert [sign.track_id for sign in drive.state.signs.ahead] == [8]
    drive.ticks(10)
    assert drive.state.signs.ahead == ()


@pytest.mark.parametrize("order", [(30, 80), (80, 30)])
@pytest.mark.parametrize("apart", [0, 1, 2])
def test_of_two_numbers_read_in_one_place_the_lower_counts(order: tuple[int, int], apart: int) -> None:
    first, second = (limit_sign(f"limit:{value}", track_id=value) for value in order)
    drive = Drive(road="rural")
    if apart:
        drive.tick(first)
        drive.ticks(apart)
        drive.tick(second)
    else:
        drive.tick(first, second)
    assert [each.kmh for each in in_force(drive.state.signs)] == [30.0]


@pytest.mark.parametrize("absurd_m", [-1e9, -50.0, 1e6, 1e300])
@pytest.mark.parametrize("ahead", ["limit:30", "limit:100"])
def test_a_distance_that_no_sign_has_raises_no_target(ahead: str, absurd_m: float) -> None:
    drive = Drive(road="rural")
    drive.tick(limit_sign("limit:70"))
    drive.tick(limit_sign(ahead, track_id=9, passed=False, distance_m=20.0))
    stood = drive.target_mps
    drive.tick(limit_sign(ahead, track_id=9, passed=False, distance_m=absurd_m))
    assert drive.target_mps <= stood
    drive.tick()
    assert drive.target_mps <= stood
