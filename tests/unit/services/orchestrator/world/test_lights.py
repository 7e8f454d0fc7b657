"""A red light stands until its own lamp is read green or it is passed."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from proto.scene import Fact, Facts
from proto.sensors import StopLine
from services.orchestrator.observations.inputs import Stamped
from services.orchestrator.state import Light
from services.orchestrator.world.stops import stops
from tests.unit.services.orchestrator.support import FEW, SECOND, TICK, Drive, fact, replace


def lamp(state: str, *, track_id: int = 1, distance_m: float | None = 30.0, **fields: object) -> Fact:
    return fact("light", f"light:{state}", track_id=track_id, distance_m=distance_m, **fields)


def show(drive: Drive, *lamps: tuple[Fact, int]) -> Light | None:
    """A tick with lamps read in frames so many nanoseconds old."""
    now_ns = drive.now_ns + TICK
    facts = tuple(replace(each, frame_stamp_ns=now_ns - age_ns) for each, age_ns in lamps)
    drive.tick(facts=(Stamped(seq=1, stamp_ns=now_ns, message=Facts(facts=facts)),))
    return drive.state.light


def state(drive: Drive) -> str | None:
    return drive.state.light.state if drive.state.light is not None else None


def at_red(distance_m: float | None = 30.0, speed_mps: float = 5.0) -> Drive:
    drive = Drive(speed_mps=speed_mps)
    drive.tick(lamp("red", distance_m=distance_m))
    assert state(drive) == "red"
    return drive


@pytest.mark.parametrize("other", [lamp("green", track_id=2, distance_m=130.0), lamp("green", track_id=2)])
@pytest.mark.parametrize("first", [True, False])
def test_another_lamps_green_ends_no_red_that_is_seen(other: Fact, first: bool) -> None:
    drive = at_red()
    both = (other, lamp("red")) if first else (lamp("red"), other)
    for _ in range(3):
        drive.tick(*both)
        assert state(drive) == "red"
    drive.tick(other)
    assert state(drive) == "red", "it is out of sight for one frame only"


def test_its_own_green_ends_a_red() -> None:
    drive = at_red()
    drive.tick(lamp("green"))
    assert state(drive) == "green"


def test_the_green_of_a_lamp_found_again_under_another_number_ends_a_red() -> None:
    drive = at_red(speed_mps=0.0)
    drive.ticks(40)
    drive.tick(lamp("green", track_id=7, distance_m=130.0))
    assert state(drive) == "red", "that is the next junction's"
    drive.tick(lamp("green", track_id=8, distance_m=36.0))
    assert state(drive) == "green"


@pytest.mark.parametrize("held", ["red", "amber", "red_amber", "green"])
def test_a_lamp_seen_from_behind_across_the_junction_ends_no_lit_one(held: str) -> None:
    drive = Drive(speed_mps=0.0)
    drive.tick(lamp(held))
    drive.ticks(15 if held == "green" else 40)
    for distance_m in (42.0, 36.0, 30.0):
        drive.tick(lamp("off", track_id=7, distance_m=distance_m))
        assert state(drive) == held, "its back looks as a lamp that is off"


def test_a_lamp_seen_from_behind_hides_no_red_of_the_next_junction() -> None:
    behind, red = lamp("off", track_id=7, distance_m=20.0), lamp("red", distance_m=130.0)
    for lamps in ((behind, red), (red, behind)):
        drive = Drive(speed_mps=5.0)
        for each in lamps:
            drive.tick(each)
        assert state(drive) == "red"


def test_a_lamp_that_is_switched_off_is_off() -> None:
    drive = at_red(speed_mps=0.0)
    drive.tick(lamp("off"))
    assert state(drive) == "off"


others_off = st.builds(
    lamp,
    st.just("off"),
    track_id=st.integers(2, 5),
    distance_m=st.none() | st.floats(-60.0, 300.0),
    confidence=st.floats(0.9, 1.0),
)


@FEW
@given(st.lists(st.tuples(st.integers(1, 40), others_off), max_size=8))
def test_no_lamp_that_is_off_ends_the_red_of_another(shown: list[tuple[int, Fact]]) -> None:
    drive = at_red(30.0, speed_mps=0.0)
    for after, off in shown:
        drive.ticks(after)
        drive.tick(off)
        assert state(drive) == "red"


def test_the_nearer_of_two_junctions_counts() -> None:
    drive = Drive(speed_mps=5.0)
    for order in (1, -1):
        drive.tick(*(lamp("green", distance_m=20.0), lamp("red", track_id=2, distance_m=130.0))[::order])
        assert state(drive) == "green"
    drive.tick(lamp("green", distance_m=20.0), lamp("red", track_id=2, distance_m=60.0))
    assert state(drive) == "red"


def test_the_other_lamp_of_a_junction_confirms_a_red() -> None:
    drive = at_red(speed_mps=0.0)
    for _ in range(30):
        drive.tick(lamp("red", track_id=2, distance_m=33.0))
    light = drive.state.light
    assert light is not None
    assert (light.state, light.seen_ns) == ("red", drive.now_ns)
    drive.tick(lamp("red", track_id=3, distance_m=130.0))
    assert drive.state.light is not None
    assert drive.state.light.distance_m == 33.0


@pytest.mark.parametrize("age_ns", [TICK + 1, SECOND, 3600 * SECOND, -3600 * SECOND])
def test_a_green_from_before_the_red_or_from_the_future_ends_nothing(age_ns: int) -> None:
    drive = at_red()
    assert show(drive, (lamp("green"), age_ns)) is not None
    assert state(drive) == "red"
    drive.tick()
    assert state(drive) == "red"


@pytest.mark.parametrize("age_ns", [3 * SECOND, 3600 * SECOND, -3600 * SECOND])
def test_a_green_from_long_ago_or_from_the_future_is_none(age_ns: int) -> None:
    assert show(Drive(), (lamp("green"), age_ns)) is None


def test_a_red_from_the_future_can_be_ended() -> None:
    drive = Drive()
    show(drive, (lamp("red"), -3600 * SECOND))
    assert state(drive) == "red"
    drive.tick(lamp("green"))
    assert state(drive) == "green"


@pytest.mark.parametrize("distance_m", [30.0, None])
def test_silence_ends_no_red_while_the_ego_stands(distance_m: float | None) -> None:
    drive = at_red(distance_m, speed_mps=0.0)
    target_mps = drive.target_mps
    drive.ticks(800)
    assert state(drive) == "red"
    assert drive.target_mps <= target_mps


def test_a_red_ends_when_it_is_passed_and_not_before() -> None:
    drive = at_red(30.0, speed_mps=0.4)
    drive.ticks(700)
    assert state(drive) == "red", "28 m took more than a minute"
    drive.ticks(150)
    assert state(drive) is None


def test_a_red_that_was_never_ranged_is_forgotten_a_minute_later_on_the_way() -> None:
    drive = at_red(None, speed_mps=5.0)
    drive.ticks(595)
    assert state(drive) == "red"
    drive.ticks(10)
    assert state(drive) is None


others = st.builds(
    lamp,
    st.sampled_from(("green", "off", "red", "amber")),
    track_id=st.integers(2, 5),
    distance_m=st.none() | st.floats(20.0, 300.0),
    confidence=st.floats(0.0, 1.0),
    believed=st.booleans(),
)


@FEW
@given(st.lists(st.lists(st.tuples(others, st.integers(-5 * SECOND, 90 * SECOND)), max_size=3), max_size=8))
def test_no_other_lamp_ends_a_red_that_was_just_seen(ticks: list[list[tuple[Fact, int]]]) -> None:
    drive = at_red(30.0, speed_mps=0.0)
    for each in ticks:
        show(drive, *each, (lamp("red"), 0))
        assert state(drive) in ("red", "amber")


def test_who_drives_off_below_a_light_out_of_view_is_told_to_look_and_not_to_stop() -> None:
    drive = at_red(distance_m=3.0, speed_mps=0.0)
    drive.ticks(5)
    assert drive.target_mps == 0.0, "it was red a moment ago"
    drive.ticks(10)
    drive.comes_to(1.2)
    ticked = drive.ticks(3)
    assert ticked.fused.directive == "Check the light"
    assert not ticked.fused.hazard
    assert 0.0 < drive.target_mps <= 20 / 3.6
    assert not any(event.kind == "stop_required" for event in ticked.events)


def test_a_light_out_of_view_is_red_again_once_it_is_seen_so() -> None:
    drive = at_red(distance_m=3.0, speed_mps=0.0)
    drive.ticks(40)
    drive.tick(lamp("red", distance_m=3.0))
    assert drive.target_mps == 0.0


@FEW
@given(st.floats(0.6, 20.0), st.floats(0.0, 60.0), st.integers(1, 60))
def test_a_red_stands_for_who_comes_to_it_however_long_it_is_out_of_view(
    speed: float, distance_m: float, ticks: int
) -> None:
    drive = at_red(distance_m=distance_m, speed_mps=speed)
    drive.ticks(ticks)
    light = drive.state.light
    assert light is None or not light.lost_at_line


@FEW
@given(st.floats(7.5, 60.0), st.integers(31, 90))
def test_a_red_stands_for_who_stands_in_a_queue_before_it_and_sees_it_no_more(distance_m: float, ticks: int) -> None:
    drive = at_red(distance_m=distance_m, speed_mps=0.0)
    drive.ticks(ticks)
    assert state(drive) == "red"
    assert drive.state.light is not None
    assert not drive.state.light.lost_at_line


def test_a_green_that_leaves_the_pictures_wears_off_and_asks_nobody_to_look() -> None:
    drive = Drive(speed_mps=0.0)
    drive.tick(lamp("green", distance_m=3.0))
    for _ in range(40):
        ticked = drive.tick()
        assert drive.state.light is None or not drive.state.light.lost_at_line
        assert "light" not in ticked.fused.directive


def test_a_doubted_red_that_is_none_stops_nobody_later() -> None:
    drive = Drive(speed_mps=5.0)
    ticked = drive.tick(lamp("red", distance_m=18.0, confidence=0.32, believed=False))
    assert any(event.kind == "stop_required" for event in ticked.events), "a doubted red asks for care"
    ticked = drive.tick(lamp("red", distance_m=17.5, confidence=0.0, believed=False, withdrawn=True))
    assert state(drive) is None
    assert not any(event.kind == "stop_required" for event in ticked.events)


@FEW
@given(
    st.floats(0.6, 1.0),
    st.lists(st.tuples(st.integers(1, 4), st.floats(0.0, 1.0), st.floats(-5.0, 80.0)), max_size=6),
)
def test_no_withdrawal_ends_a_red_that_was_sure(sure: float, told: list[tuple[int, float, float]]) -> None:
    drive = Drive(speed_mps=0.0)
    drive.tick(lamp("red", confidence=sure))
    for track_id, confidence, distance_m in told:
        drive.tick(
            lamp("red", track_id=track_id, confidence=confidence, distance_m=distance_m, believed=False, withdrawn=True)
        )
        assert state(drive) == "red"


@FEW
@given(st.integers(2, 9), st.floats(0.0, 0.59))
def test_no_withdrawal_of_another_light_ends_a_red(track_id: int, confidence: float) -> None:
    drive = Drive(speed_mps=0.0)
    drive.tick(lamp("red", confidence=confidence, believed=False))
    drive.tick(lamp("red", track_id=track_id, confidence=0.0, believed=False, withdrawn=True))
    assert state(drive) == "red"


@pytest.mark.parametrize("absurd_m", [-1e9, -50.0, 1e6, 1e300])
@pytest.mark.parametrize("passed", [False, True])
def test_a_distance_that_no_lamp_has_takes_no_red_away(absurd_m: float, passed: bool) -> None:
    drive = at_red(speed_mps=12.0)
    stood = drive.target_mps
    drive.tick(lamp("red", distance_m=absurd_m))
    assert drive.target_mps <= stood
    drive.tick(lamp("red", distance_m=25.0, passed=passed))
    assert state(drive) == "red"
    assert drive.target_mps <= stood


@pytest.mark.parametrize("kind", ["light", "crossing", "stop_line"])
@pytest.mark.parametrize("light_m", [30.0, 60.0, 90.0])
def test_a_line_of_the_map_far_behind_a_red_light_is_not_its_line(kind: str, light_m: float) -> None:
    drive = Drive(speed_mps=13.0)
    before_mps, at_m = drive.target_mps, light_m
    while at_m > 5.0:
        drive.lines = (StopLine(distance_m=at_m + 120.0, kind=kind),)  # type: ignore[arg-type]
        ticked = drive.tick(lamp("red", distance_m=at_m))
        assert "red_light" in {event.detail for event in ticked.events if event.kind == "stop_required"} or at_m > 55.0
        assert drive.target_mps >= before_mps - 0.2 - 1e-9
        before_mps, at_m = drive.target_mps, at_m - 0.1 * min(13.0, drive.target_mps)
        drive.speed_mps = min(13.0, drive.target_mps)
    assert drive.target_mps < (10.0 if light_m < 45.0 else 4.0)


@FEW
@given(light_m=st.floats(-2.0, 120.0), speed_mps=st.floats(1.0, 20.0), ticks=st.integers(1, 15))
def test_an_unknown_speed_brings_a_red_light_without_a_line_no_farther_away(
    light_m: float, speed_mps: float, ticks: int
) -> None:
    known, unknown = Drive(speed_mps=speed_mps), Drive(speed_mps=speed_mps)
    for drive in (known, unknown):
        drive.lines = (StopLine(distance_m=250.0, kind="light"),)
        drive.tick(lamp("red", distance_m=light_m))
    unknown.speed_mps = None
    for drive in (known, unknown):
        drive.ticks(ticks)
    assert unknown.target_mps <= known.target_mps + 1e-9 or known.state.light is None
    assert state(unknown) == "red"


def test_a_red_light_that_is_passed_binds_no_more() -> None:
    drive = Drive(speed_mps=10.0)
    free_mps = drive.target_mps
    drive.lines = (StopLine(distance_m=250.0, kind="light"),)
    drive.tick(lamp("red", distance_m=5.0))
    assert drive.target_mps < free_mps
    drive.ticks(10)
    assert not [stop for stop in stops(drive.state) if stop.why == "red_light"]
    assert drive.target_mps == pytest.approx(free_mps)


@given(across_m=st.floats(8.0, 40.0), speed_mps=st.floats(2.0, 14.0), next_m=st.floats(80.0, 200.0))
def test_behind_its_line_the_ego_is_not_to_stop_before_a_light_across_the_junction(
    across_m: float, speed_mps: float, next_m: float
) -> None:
    drive, line_m = Drive(speed_mps=speed_mps), 10.0
    while line_m > -1.0:
        drive.lines = tuple(StopLine(distance_m=at_m, kind="light") for at_m in (line_m, line_m + next_m))
        drive.tick(lamp("green", distance_m=line_m + across_m))
        line_m -= 0.1 * speed_mps
    drive.lines = (StopLine(distance_m=line_m + next_m, kind="light"),)
    drive.tick(lamp("red", distance_m=line_m + across_m))
    red = [stop for stop in stops(drive.state) if stop.why == "red_light"]
    assert all(stop.room_m > line_m + across_m for stop in red)


@pytest.mark.parametrize("believed", [True, False])
@pytest.mark.parametrize("again", [True, False])
def test_a_red_of_one_doubted_picture_lowers_the_target_and_is_spoken_of_once_a_second_shows_it(
    believed: bool, again: bool
) -> None:
    drive = Drive(speed_mps=12.0)
    drive.ticks(20)
    before = drive.tick().advisory.target_mps
    red = lamp("red", distance_m=25.0, believed=believed, confidence=0.7)
    first = drive.tick(red).advisory
    assert before is not None
    assert first.target_mps is not None
    assert first.target_mps < before
    second = drive.tick(*([red] if again else [])).advisory
    said = [each.directive for each in (first, second) if each.kind != "SILENT"]
    assert said == (["Stop: red light"] if believed or again else [])


@pytest.mark.parametrize(("mapped", "seen"), [(False, False), (True, False), (False, True)])
def test_a_red_that_the_pictures_of_three_seconds_do_not_show_bounds_and_is_told_by_a_mapped_line_alone(
    mapped: bool, seen: bool
) -> None:
    drive, at_m = Drive(speed_mps=10.0), 80.0
    free_mps = drive.ticks(20).advisory.target_mps
    while at_m > 20.0:
        drive.lines = (StopLine(distance_m=at_m - 3.0, kind="light"),) if mapped else ()
        drive.tick(*([lamp("red", distance_m=at_m)] if seen or at_m > 75.0 else []))
        at_m -= 1.0
    target_mps = drive.history[-1][2].advisory.target_mps
    assert free_mps is not None
    assert target_mps is not None
    assert target_mps < free_mps
    assert ("Stop: red light" in drive.spoken()) == (mapped or seen)
