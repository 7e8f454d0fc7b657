"""A sign that was believed and is doubted before its post still lowers, and raises nothing."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from proto.scene import Fact
from services.orchestrator.signs.limits import SURE, in_force
from services.orchestrator.world.stops import stops
from tests.unit.services.orchestrator.support import FEW, KMH, Drive, end_sign, fact, limit_sign


def ahead(reading: str, distance_m: float = 20.0, **fields: object) -> Fact:
    return limit_sign(reading, **{"passed": False, "distance_m": distance_m, **fields})  # type: ignore[arg-type]


def believed_then(*doubts: Fact, sign: str = "limit:30", under: str = "limit:80") -> Drive:
    drive = Drive(road="rural", speed_mps=10.0)
    drive.tick(limit_sign(under, track_id=1))
    drive.tick(ahead(sign))
    for doubt in doubts:
        drive.tick(doubt)
    return drive


def in_force_kmh(drive: Drive) -> set[float]:
    return {each.posted.value for each in in_force(drive.state.signs)}


@st.composite
def doubts(draw: st.DrawFn) -> Fact:
    """Of the track: not believed, or believed and unsure and higher."""
    believed = draw(st.booleans())
    reading = draw(st.sampled_from(("limit:30", "limit:50", "limit:80", "limit:130", "limit_end", "stop", "info")))
    return fact(
        draw(st.sampled_from(("limit", "sign", "message"))),
        reading,
        confidence=draw(st.floats(0.0, SURE, exclude_max=True) if believed else st.floats(0.0, 1.0)),
        believed=believed,
        track_id=3,
        scope="end" if reading == "limit_end" else draw(st.sampled_from(("permanent", "zone"))),
        distance_m=draw(st.none() | st.floats(0.0, 1e6)),
        plates=draw(st.sampled_from(((), ("plate:lorries",), ("plate:distance",)))),
        lane_id=draw(st.sampled_from(("", "offset:+1"))),
        passed=draw(st.booleans()),
    )


@FEW
@given(st.lists(doubts(), min_size=1, max_size=8))
def test_no_doubt_removes_a_lower_limit_that_was_believed(found: list[Fact]) -> None:
    drive = believed_then(*found)
    drive.ticks(40)
    assert min(in_force_kmh(drive)) <= 30.0
    assert drive.target_mps <= 30 * KMH + 1e-9


def test_a_lower_limit_that_was_doubted_does_not_count_before_its_post() -> None:
    drive = believed_then(ahead("limit:30", 19.0, believed=False, confidence=0.4))
    assert in_force_kmh(drive) == {80.0}
    drive.ticks(25)
    assert in_force_kmh(drive) == {30.0}


@pytest.mark.parametrize("value", [50, 120])
def test_another_reading_that_is_believed_replaces_it(value: int) -> None:
    drive = believed_then(ahead(f"limit:{value}", 19.0))
    drive.ticks(40)
    assert in_force_kmh(drive) == {value}


@pytest.mark.parametrize("passed", [True, False])
@pytest.mark.parametrize(
    ("reading", "believed", "confidence"), [("same", False, 0.9), ("same", True, 0.5), ("limit:120", False, 0.9)]
)
@pytest.mark.parametrize("sign", ["limit:80", "limit_end", "all_end", "town_exit"])
def test_a_sign_that_would_raise_does_not_once_it_is_doubted(
    sign: str, reading: str, believed: bool, confidence: float, passed: bool
) -> None:
    drive = Drive(road="rural", speed_mps=10.0)
    drive.tick(limit_sign("limit:30", track_id=1))
    first = ahead(sign) if sign == "limit:80" else end_sign(sign, track_id=3, passed=False, distance_m=20.0)
    drive.tick(first)
    same = {"believed": believed, "confidence": confidence, "passed": passed}
    later = sign if reading == "same" else reading
    drive.tick(
        ahead(later, 19.0, **same)
        if later.startswith("limit:")
        else end_sign(later, track_id=3, distance_m=19.0, **same)
    )
    drive.ticks(60)
    assert drive.target_mps <= 30 * KMH + 1e-9


def test_a_doubt_that_is_lower_than_the_limit_believed_counts_beside_it() -> None:
    drive = believed_then(ahead("limit:30", 15.0, believed=False, confidence=0.5), sign="limit:60")
    sure = believed_then(sign="limit:60")
    for each in (drive, sure):
        each.ticks(12)
    assert drive.target_mps < sure.target_mps
    drive.ticks(20)
    assert in_force_kmh(drive) == {60.0}


def test_a_stop_sign_that_was_believed_stays_a_stop() -> None:
    drive = Drive(speed_mps=5.0)
    drive.tick(fact("sign", "stop", track_id=3, distance_m=30.0))
    drive.tick(fact("sign", "yield", track_id=3, distance_m=29.0, believed=False, confidence=0.5))
    assert [stop.why for stop in stops(drive.state)] == ["stop_sign"]


def test_belief_that_comes_back_counts_in_full() -> None:
    drive = believed_then(ahead("limit:80", 19.0, believed=False, confidence=0.4), sign="limit:80", under="limit:30")
    drive.tick(ahead("limit:80", 17.0))
    drive.ticks(40)
    assert in_force_kmh(drive) == {80.0}


def test_without_a_sign_in_force_a_doubted_limit_lowers_what_such_a_road_allows() -> None:
    drive = Drive(road="rural", speed_mps=10.0)
    drive.tick(ahead("limit:80"))
    drive.tick(ahead("limit:80", 15.0, believed=False, confidence=0.4))
    drive.ticks(40)
    assert in_force_kmh(drive) == {80.0}
    town = Drive(road="urban", speed_mps=10.0)
    town.tick(ahead("limit:80"))
    town.tick(ahead("limit:80", 15.0, believed=False, confidence=0.4))
    town.ticks(40)
    assert in_force_kmh(town) == set()
