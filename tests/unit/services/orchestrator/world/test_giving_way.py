"""Where one gives way, or nobody says who goes first: slow enough before anybody is seen to come."""

import msgspec
import pytest
from hypothesis import given
from hypothesis import strategies as st

from proto.decision import Advisory
from proto.scene import Facts
from proto.sensors import StopLine
from services.orchestrator.observations.inputs import Stamped
from services.orchestrator.world.actors import EGO_HALF_M
from services.orchestrator.world.giving_way import BEFORE_MIDDLE_M, READY_MPS, place
from tests.unit.services.orchestrator.support import FEW, SECOND, TICK, Drive, fact

FAR_M = 200.0


def coming(
    *,
    speed_mps: float = 13.0,
    road: str = "urban",
    line_m: float | None = None,
    kind: str = "yield_line",
    junction_m: float | None = None,
) -> Drive:
    """A drive in a town with a limit of 50, long told, that comes to a place; distances from the ego's centre."""
    drive = Drive(speed_mps=speed_mps, road=road)
    drive.ticks(60)
    show(drive, line_m, junction_m, kind)
    drive.tick()
    return drive


def show(drive: Drive, line_m: float | None, junction_m: float | None, kind: str = "yield_line") -> None:
    drive.lines = (StopLine(distance_m=line_m, kind=kind),) if line_m is not None else ()  # type: ignore[arg-type]
    drive.junction_m = junction_m


def told(drive: Drive) -> list[Advisory]:
    return [t.advisory for _, _, t in drive.history if t.advisory.kind != "SILENT" and t.advisory.topic == "give_way"]


def approach(drive: Drive, *, line: bool, from_m: float = 100.0) -> None:
    """At its speed to the line (or the place of one) and ten metres past it; the junction's middle is 11 m behind it."""
    assert drive.speed_mps is not None
    step_m, way_m = drive.speed_mps / 10.0, from_m
    while way_m > -10.0:
        show(drive, way_m if line and way_m > -2.0 else None, way_m + 11.0 if way_m > -11.0 else None)
        drive.tick()
        way_m -= step_m


def test_who_comes_fast_is_told_in_time_and_once() -> None:
    drive = coming(line_m=100.0)
    approach(drive, line=True)
    words = told(drive)
    assert [word.directive for word in words] == ["Give way"]
    assert words[0].asked_mps == pytest.approx(READY_MPS)
    assert words[0].target_why == "give_way"
    assert words[0].urgency == "advice"
    # 1.9 s to react, then down at 2 m/s^2, to the line
    way_m = 13.0 * 1.9 + (13.0**2 - READY_MPS**2) / 4.0
    assert f"In {way_m:.0f} m" in words[0].justification or f"In {way_m - 1:.0f} m" in words[0].justification


def test_a_junction_of_the_map_that_nothing_rules_is_told_as_one() -> None:
    drive = coming(junction_m=111.0)
    approach(drive, line=False)
    assert [word.directive for word in told(drive)] == ["Junction: slow down"]


def test_who_is_slow_enough_hears_nothing() -> None:
    drive = coming(speed_mps=7.5, line_m=100.0)
    approach(drive, line=True)
    assert told(drive) == []


@pytest.mark.parametrize(("braking_mps2", "words"), [(0.0, 1), (1.0, 1), (2.0, 0)])
def test_who_slows_down_as_hard_as_it_takes_hears_nothing(braking_mps2: float, words: int) -> None:
    # 12 m/s down to 25 km/h within 27.75 m take 1.73 m/s^2
    drive = coming(speed_mps=12.0)
    drive.acceleration_mps2 = -braking_mps2
    show(drive, 30.0, None)
    drive.tick()
    assert drive.target_mps == pytest.approx(READY_MPS)
    assert len(told(drive)) == words


def test_the_next_one_is_news() -> None:
    drive = coming(line_m=100.0)
    approach(drive, line=True)
    approach(drive, line=True, from_m=150.0)
    assert len(told(drive)) == 2


def test_a_sign_asks_for_it_where_no_map_knows_the_line() -> None:
    drive = coming()
    drive.tick(fact("sign", "yield", track_id=4, distance_m=40.0))
    assert drive.target_mps == pytest.approx(READY_MPS)
    here = place(drive.state)
    assert here is not None
    assert here.why == "give_way"
    assert here.confidence == pytest.approx(0.95)


def test_a_sign_beside_the_line_of_the_map_is_the_same_place() -> None:
    drive = coming(line_m=30.0)
    drive.tick(fact("sign", "yield", track_id=4, distance_m=20.0))
    here = place(drive.state)
    assert here is not None
    assert here.room_m == pytest.approx(30.0 - EGO_HALF_M, abs=1.5)


@pytest.mark.parametrize("kind", ["stop_line", "light", "yield_line"])
def test_a_junction_with_a_line_is_ruled_until_it_is_passed(kind: str) -> None:
    drive = coming(line_m=60.0, junction_m=71.0, kind=kind)
    seen = []
    for step in range(80):
        way_m = 60.0 - step
        show(drive, way_m if way_m > -2.0 else None, way_m + 11.0 if way_m > -11.0 else None, kind)
        drive.comes_to(10.0)
        drive.tick()
        here = place(drive.state)
        seen.append(here.why if here is not None else "")
    assert "junction" not in seen


@pytest.mark.parametrize("reading", ["priority_road", "priority_here", "stop"])
def test_a_sign_rules_its_junction_before_and_behind_it(reading: str) -> None:
    drive = coming(junction_m=50.0)
    drive.tick(fact("sign", reading, track_id=4, distance_m=30.0))
    show(drive, None, 45.0)
    drive.tick()
    assert place(drive.state) is None
    show(drive, None, 16.0)
    drive.tick(fact("sign", reading, track_id=4, distance_m=0.0, passed=True))
    assert place(drive.state) is None
    for _ in range(101):  # the next junction is another one
        show(drive, None, None)
        drive.tick()
    show(drive, None, 40.0)
    drive.tick()
    here = place(drive.state)
    assert here is not None
    assert here.why == "junction"


def test_a_sign_that_is_not_believed_rules_nothing() -> None:
    drive = coming(junction_m=50.0)
    drive.tick(fact("sign", "priority_road", track_id=4, distance_m=30.0, believed=False, confidence=0.4))
    assert place(drive.state) is not None


@pytest.mark.parametrize(
    ("light", "ruled"), [("green", True), ("red", True), ("off", False)], ids=["green", "red", "off"]
)
def test_a_light_rules_it_unless_it_is_off(light: str, ruled: bool) -> None:
    drive = coming(junction_m=50.0)
    drive.tick(fact("light", f"light:{light}", track_id=4, distance_m=45.0))
    assert (place(drive.state) is None) == ruled


@pytest.mark.parametrize(
    ("road", "asked"), [("urban", True), ("living_street", True), ("rural", False), ("motorway", False)]
)
def test_only_in_town_others_may_come_from_any_junction(road: str, asked: bool) -> None:
    drive = coming(road=road, junction_m=40.0)
    assert (place(drive.state) is not None) == asked


@pytest.mark.parametrize(("country", "asked"), [("FRA", True), ("GBR", False), ("USA", False), ("unknown", True)])
def test_where_main_roads_show_no_sign_nothing_seen_is_no_reason(country: str, asked: bool) -> None:
    drive = coming(junction_m=100.0)
    drive.tick(fact("jurisdiction", country))
    show(drive, None, 40.0)
    drive.tick()
    assert (place(drive.state) is not None) == asked
    show(drive, 30.0, 41.0)  # a line is one everywhere
    drive.tick()
    assert place(drive.state) is not None


def test_on_a_road_of_unknown_kind_they_may() -> None:
    drive = coming(junction_m=40.0)
    environment = msgspec.structs.replace(drive.state.world.environment, road_type=None)
    state = msgspec.structs.replace(
        drive.state, world=msgspec.structs.replace(drive.state.world, environment=environment)
    )
    assert place(state) is not None


def test_a_map_that_falls_silent_takes_nothing_back() -> None:
    drive = coming(line_m=60.0)
    targets = []
    for _ in range(30):
        drive.tick(road=None)
        targets.append(drive.target_mps)
    assert targets == pytest.approx([READY_MPS] * 30)
    here = place(drive.state)
    assert here is not None
    assert here.room_m == pytest.approx(60.0 - EGO_HALF_M - 39.0, abs=3.0)
    for _ in range(25):
        drive.tick(road=None)
    assert place(drive.state) is None


def test_who_tells_no_speed_is_told() -> None:
    drive = coming(line_m=30.0)
    drive.comes_to(None)
    drive.state = msgspec.structs.replace(drive.state, memory=type(drive.state.memory)())
    drive.tick()
    assert told(drive)


def test_it_is_over_where_one_would_have_stood() -> None:
    drive = coming(line_m=0.5)
    show(drive, -1.5, None)
    drive.tick()
    assert drive.target_mps > READY_MPS
    show(drive, None, BEFORE_MIDDLE_M - 1.5)
    drive.tick()
    assert drive.target_mps > READY_MPS


distances = st.one_of(st.none(), st.floats(-20.0, FAR_M))


@FEW
@given(
    line_m=distances, junction_m=distances, speed_mps=st.floats(0.0, 40.0), road=st.sampled_from(["urban", "rural", "motorway"])
)  # fmt: skip
def test_no_place_ever_raises_the_target(
    line_m: float | None, junction_m: float | None, speed_mps: float, road: str
) -> None:
    with_it = coming(speed_mps=speed_mps, road=road, line_m=line_m, junction_m=junction_m)
    without = coming(speed_mps=speed_mps, road=road)
    assert with_it.target_mps <= without.target_mps


@FEW
@given(silent=st.integers(1, 40), line_m=st.floats(5.0, 120.0), speed_mps=st.floats(0.5, 25.0))
def test_silence_of_the_map_never_raises_the_target_before_the_line(
    silent: int, line_m: float, speed_mps: float
) -> None:
    known, lost = coming(speed_mps=speed_mps, line_m=line_m), coming(speed_mps=speed_mps, line_m=line_m)
    for step in range(1, silent + 1):
        way_m = line_m - speed_mps * step / 10.0
        show(known, way_m if way_m > -2.0 else None, None)
        known.tick()
        lost.tick(road=None)
        assert lost.target_mps <= known.target_mps + 1e-9


@FEW
@given(st.floats(-300.0, 3600.0))
def test_a_sign_read_in_a_frame_from_the_future_rules_the_next_junction_for_no_longer_than_another(
    ahead_s: float,
) -> None:
    drive = coming()
    sign = fact("sign", "priority_road", track_id=7, passed=True, distance_m=0.0)
    now_ns = drive.now_ns + TICK
    told_ns = now_ns + round(ahead_s * SECOND)
    read = Facts(facts=(msgspec.structs.replace(sign, frame_stamp_ns=told_ns),))
    drive.tick(facts=(Stamped(seq=1, stamp_ns=now_ns, message=read),))
    drive.ticks(110)
    show(drive, None, 40.0)
    assert drive.tick().fused.target_why == "junction"
