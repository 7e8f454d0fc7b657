"""Where no limit is in force, a sign may raise what holds without one: it has to be sure."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from services.orchestrator.signs.limits import SURE, in_force
from services.orchestrator.target.target import law_of
from tests.unit.services.orchestrator.support import FEW, KMH, Drive, Played, end_sign, limit_sign


@FEW
@given(
    value=st.integers(51, 140),
    confidence=st.floats(0.0, SURE, exclude_max=True),
    passed=st.booleans(),
    distance_m=st.none() | st.floats(0.0, 30.0),
)
def test_an_unsure_sign_above_every_urban_limit_raises_nothing(
    value: int, confidence: float, passed: bool, distance_m: float | None
) -> None:
    drive = Drive(Played(experts={}))
    before = drive.target_mps
    drive.tick(limit_sign(f"limit:{value}", confidence=confidence, passed=passed, distance_m=distance_m))
    for _ in range(80):
        assert drive.tick().fused.target_mps == pytest.approx(before)
    assert in_force(drive.state.signs) == ()


@pytest.mark.parametrize("reading", ["limit:50", "limit:30", "zone:30"])
def test_an_unsure_sign_that_no_road_undercuts_is_enough(reading: str) -> None:
    drive = Drive(road="rural")
    drive.tick(limit_sign(reading, confidence=0.35))
    assert drive.target_mps == pytest.approx(float(reading.partition(":")[2]) * KMH)


def test_a_sure_sign_is_enough_for_any_limit() -> None:
    drive = Drive(road="rural")
    drive.tick(limit_sign("limit:80", confidence=SURE))
    assert drive.target_mps == pytest.approx(80 * KMH)


def test_a_sure_limit_ahead_bounds_until_its_post_however_long_the_ego_waits() -> None:
    drive = Drive(road="rural", speed_mps=0.0)
    drive.tick(limit_sign("limit:80", passed=False, distance_m=5.0))
    drive.ticks(400)
    drive.comes_to(10.0)
    drive.ticks(10)
    assert law_of(drive.state).mps == pytest.approx(80 * KMH)


def test_a_sure_limit_whose_post_was_never_seen_raises_nothing() -> None:
    drive = Drive(Played(experts={}))
    before = drive.target_mps
    drive.tick(limit_sign("limit:120", passed=False, distance_m=None))
    for _ in range(400):
        assert drive.tick().fused.target_mps == pytest.approx(before)


@pytest.mark.parametrize("scope", ["end", "permanent"])
@pytest.mark.parametrize("passed", [True, False])
@pytest.mark.parametrize("reading", ["limit_end:30", "limit_end:20", "zone_end:30"])
def test_no_unsure_end_sign_ends_a_limit_by_its_number(reading: str, passed: bool, scope: str) -> None:
    drive = Drive()
    drive.tick(limit_sign("zone:30"))
    drive.ticks(60)
    drive.tick(limit_sign("limit:30", track_id=4))
    value = float(reading.partition(":")[2])
    drive.tick(end_sign(reading, value=value, confidence=0.4, passed=passed, scope=scope))
    drive.ticks(80)
    assert {each.posted.reading for each in in_force(drive.state.signs)} == {"zone:30", "limit:30"}


def test_the_number_on_an_end_sign_is_no_limit() -> None:
    drive = Drive(road="rural")
    drive.tick(end_sign("limit_end:130", value=130.0))
    assert in_force(drive.state.signs) == ()


def test_the_message_of_a_limit_ahead_carries_it_and_no_other_message_does() -> None:
    drive = Drive(road="rural", speed_mps=25.0)
    drive.ticks(30)
    assert drive.history[-1][2].fused.ahead_mps is None
    drive.tick(limit_sign("limit:50", passed=False, distance_m=70.0))
    fused = drive.ticks(3).fused
    assert fused.topic == "ahead"
    assert fused.ahead_mps == pytest.approx(50 * KMH)
