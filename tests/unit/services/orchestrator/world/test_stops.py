"""Who has stopped at the line, and which line it is."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from proto.sensors import StopLine
from services.orchestrator.world.actors import EGO_HALF_M
from services.orchestrator.world.stops import stops
from tests.unit.services.orchestrator.support import TICK, Drive, fact


def at_sign(sign_m: float | None, *lines_m: float, kind: str = "stop_line", speed_mps: float = 0.0) -> Drive:
    """A drive with a stop sign ahead; distances from the ego's centre."""
    drive = Drive(speed_mps=speed_mps)
    show(drive, *lines_m, kind=kind)
    drive.tick(fact("sign", "stop", track_id=2, distance_m=sign_m))
    drive.tick()
    return drive


def show(drive: Drive, *lines_m: float, kind: str = "stop_line") -> None:
    drive.lines = tuple(StopLine(distance_m=each, kind=kind) for each in lines_m)  # type: ignore[arg-type]


def wanted(drive: Drive) -> list[str]:
    return [stop.why for stop in stops(drive.state)]


@pytest.mark.parametrize("room_m", [4.0, 8.0, 9.5])
def test_a_halt_far_from_the_line_is_none(room_m: float) -> None:
    drive = at_sign(room_m + EGO_HALF_M, room_m + EGO_HALF_M)
    assert wanted(drive) == ["stop_sign"]


@pytest.mark.parametrize("room_m", [-0.5, 1.0, 2.8])
def test_a_halt_at_the_line_is_one_until_it_is_crossed(room_m: float) -> None:
    drive = at_sign(room_m + EGO_HALF_M, room_m + EGO_HALF_M)
    assert wanted(drive) == []
    drive.comes_to(2.0)
    for step in range(1, 31):
        show(drive, room_m + EGO_HALF_M - 0.2 * step)
        drive.tick()
        assert wanted(drive) == []


def test_a_halt_at_another_line_is_none() -> None:
    drive = at_sign(60.0, 4.0, kind="crossing")
    assert wanted(drive) == ["stop_sign"]
    drive = at_sign(60.0, 4.0)
    assert wanted(drive) == ["stop_sign"]
    assert stops(drive.state)[0].room_m > 50.0


def test_a_halt_at_one_sign_says_nothing_of_the_next() -> None:
    drive = at_sign(4.0, 4.0)
    assert wanted(drive) == []
    drive.tick(fact("sign", "stop", track_id=3, distance_m=40.0))
    assert wanted(drive) == ["stop_sign"]


def test_a_second_look_at_the_sign_one_has_stopped_for_is_no_second_stop() -> None:
    drive = at_sign(5.0)
    drive.tick(fact("sign", "stop", track_id=3, distance_m=8.0))
    drive.comes_to(2.0)
    for _ in range(10):
        drive.tick()
        assert wanted(drive) == []


def test_without_a_map_the_halt_is_at_the_sign() -> None:
    assert wanted(at_sign(7.0)) == []
    assert wanted(at_sign(20.0)) == ["stop_sign"]


def test_a_sign_whose_distance_nobody_knows_is_stopped_for() -> None:
    assert wanted(at_sign(None)) == ["stop_sign"]


@pytest.mark.parametrize(
    ("doubted", "mapped", "spoken"),
    [
        ({}, False, True),
        ({"believed": False, "confidence": 0.7}, False, True),
        ({"believed": False, "confidence": 0.35}, True, True),
        ({"believed": False, "confidence": 0.35}, False, False),
    ],
)
def test_a_stop_sign_that_is_read_unsurely_lowers_the_target_and_no_word_is_said_of_it(
    doubted: dict[str, object], mapped: bool, spoken: bool
) -> None:
    drive = Drive(speed_mps=25.0)
    show(drive, *[80.0] * mapped)
    drive.tick(fact("sign", "stop", **{"track_id": 2, "distance_m": 80.0, **doubted}))
    drive.ticks(3)
    assert wanted(drive) == ["stop_sign"]
    assert drive.target_mps is not None
    assert drive.target_mps < 20.0
    assert ("Stop at the line" in drive.spoken()) is spoken


def test_a_passed_line_does_not_hide_the_one_ahead() -> None:
    drive = at_sign(30.0, -1.5, 28.0, speed_mps=5.0)
    (stop,) = stops(drive.state)
    assert stop.room_m == pytest.approx(28.0 - EGO_HALF_M - 1.0)


@pytest.mark.parametrize(("braking_mps2", "hazard"), [(0.0, "stop_sign"), (1.0, "stop_sign"), (6.0, "")])
def test_who_was_told_firmly_and_brakes_enough_is_not_told_again(braking_mps2: float, hazard: str) -> None:
    drive = at_sign(35.0, 35.0, speed_mps=14.0)
    assert drive.history[-1][2].fused.hazard == "stop_sign"
    drive.acceleration_mps2 = -braking_mps2
    for step in range(1, 4):
        drive.speed_mps = 14.0 - 0.1 * braking_mps2 * step
        show(drive, 35.0 - 1.4 * step)
        fused = drive.tick().fused
    assert fused.hazard == hazard
    assert (fused.topic == "stop" and fused.new_information) is False


def test_a_calmer_word_on_a_stop_just_told_is_no_news() -> None:
    drive = at_sign(35.0, 35.0, speed_mps=14.0)
    drive.ticks(3)
    before = len(drive.spoken())
    drive.comes_to(6.0)
    drive.ticks(15)
    assert len(drive.spoken()) == before


def at_line(line_m: float, speed_mps: float = 14.0, kind: str = "stop_line") -> Drive:
    drive = Drive(speed_mps=speed_mps)
    show(drive, line_m, kind=kind)
    drive.ticks(15)
    return drive


@pytest.mark.parametrize(
    ("kind", "stop"), [("stop_line", ["stop_line"]), ("light", []), ("yield_line", []), ("crossing", [])]
)
def test_a_stop_line_that_a_map_knows_is_stopped_at_before_its_sign_can_be_read(kind: str, stop: list[str]) -> None:
    drive = at_line(60.0, kind=kind)
    assert wanted(drive) == stop
    assert ("Stop at the line" in drive.spoken()) is bool(stop)


def test_its_sign_takes_its_place_once_it_is_read() -> None:
    drive = at_line(50.0)
    drive.tick(fact("sign", "stop", track_id=2, distance_m=52.0))
    assert wanted(drive) == ["stop_sign"]
    drive.ticks(20)
    alone = at_line(50.0)
    alone.ticks(21)
    assert drive.spoken() == alone.spoken(), "the sign is no news"


def test_a_light_explains_it() -> None:
    drive = at_line(50.0)
    drive.tick(fact("light", "light:green", track_id=4, distance_m=52.0))
    assert wanted(drive) == []


def test_who_has_stood_at_it_may_go_on_whether_or_not_the_sign_is_read_then() -> None:
    drive = at_line(EGO_HALF_M + 1.0, speed_mps=0.0)
    assert wanted(drive) == []
    drive.tick(fact("sign", "stop", track_id=2, distance_m=EGO_HALF_M + 2.0))
    drive.comes_to(2.0)
    for step in range(1, 16):
        show(drive, EGO_HALF_M + 1.0 - 0.2 * step)
        drive.tick()
        assert wanted(drive) == []


@pytest.mark.parametrize("line_m", [8.0, 40.0, 120.0])
def test_a_line_never_raises_the_target(line_m: float) -> None:
    assert at_line(line_m).target_mps <= at_line(line_m, kind="crossing").target_mps


def past_the_sign(far_m: float, *, seen_again: bool = False) -> Drive:
    """Stood at a stop sign, went on and passed it; another track had shown one at `far_m` when it was 90 m away."""
    drive = Drive(speed_mps=14.0)
    drive.tick(fact("sign", "stop", track_id=1, distance_m=far_m))
    while (left_m := 90.0 - travelled_m(drive)) > 5.0:
        near = [fact("sign", "stop", track_id=2, distance_m=left_m)] if left_m < 60.0 else []
        again = [fact("sign", "stop", track_id=1, distance_m=far_m - travelled_m(drive))] if seen_again else []
        drive.tick(*near, *again)
        drive.comes_to(min(14.0, (4.0 * left_m) ** 0.5))
    drive.comes_to(0.0)
    drive.ticks(3)
    assert "stop_sign" not in wanted(drive) or stops(drive.state)[0].room_m > 8.0
    drive.comes_to(4.0)
    drive.ticks(6)
    drive.tick(fact("sign", "stop", track_id=2, distance_m=-1.0, passed=True))
    return drive


def travelled_m(drive: Drive) -> float:
    """Since the first sign was seen."""
    speeds = [seen.ego.message.speed_mps or 0.0 for _, seen, _ in drive.history[2:] if seen.ego is not None]
    return sum(speeds) * TICK / 1e9


@given(st.floats(100.0, 130.0))
def test_a_stop_sign_followed_from_afar_under_another_track_asks_for_no_second_stop(far_m: float) -> None:
    assert wanted(past_the_sign(far_m)) == []


@given(st.floats(110.0, 170.0))
def test_a_second_stop_sign_that_was_seen_beside_the_first_is_stopped_for(far_m: float) -> None:
    assert wanted(past_the_sign(far_m, seen_again=True)) == ["stop_sign"]


@given(st.floats(190.0, 250.0))
def test_one_that_is_too_far_behind_the_first_for_the_same_is_stopped_for(far_m: float) -> None:
    assert wanted(past_the_sign(far_m)) == ["stop_sign"]


@pytest.mark.parametrize(("gains_mps2", "told"), [(1.6, True), (0.0, False)])
def test_a_driver_who_speeds_up_towards_the_line_behind_a_queue_is_told_while_there_is_time_to_react(
    gains_mps2: float, told: bool
) -> None:
    drive, room_m = Drive(speed_mps=2.2 if gains_mps2 else 3.0), 8.0
    drive.acceleration_mps2 = gains_mps2
    while room_m > 5.0:
        show(drive, room_m + EGO_HALF_M)
        drive.tick(fact("sign", "stop", track_id=2, distance_m=room_m + EGO_HALF_M))
        assert drive.speed_mps is not None
        drive.speed_mps += gains_mps2 / 10.0
        room_m -= drive.speed_mps / 10.0
    assert ("Stop at the line" in drive.spoken()) is told
