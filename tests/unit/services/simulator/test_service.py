"""The simulator on a bus: by the wall clock, in lockstep, and by its tools."""

import threading
from pathlib import Path
from typing import Any

import msgspec
import pytest

from drivemcp.errors import ConfigError
from drivemcp.testing import TestBus, bus
from proto import topics
from proto.sensors import CanFrame, CanFrames
from services.simulator.realtime import RealTime
from services.simulator.sensors.camera_process import Order, Studio, StudioError
from services.simulator.service import SERVICE, SimulatorConfig
from services.simulator.session import CAMERAS
from services.simulator.truth.snapshot import Snapshot
from services.simulator.world import World
from tests.unit.services.simulator._scenes import scenario, scenario_text


@pytest.fixture
def file(tmp_path: Path) -> str:
    path = tmp_path / "mine.toml"
    path.write_text(scenario_text(speed=80), encoding="utf-8")
    return str(path)


def config(file: str, **changes: Any) -> SimulatorConfig:
    return SimulatorConfig(**{"scenario": file, "cameras": (), "seconds": 1.5, **changes})


def test_a_drive_by_the_wall_clock_publishes_its_sensors_and_ends(file: str) -> None:
    with bus() as stack:
        states, fixes = stack.collect(topics.SCENARIO), stack.collect(topics.GNSS)
        sweeps, frames = stack.collect(topics.LIDAR, id="top"), stack.collect(topics.CAN_RX, id="can0")
        stack.start(SERVICE, config(file, stale_ms=3600e3))  # a machine that stalls drops nothing
        end = states.wait(lambda state: state.finished)
        assert end.scenario == "test"
        assert len(fixes.messages) == 15
        assert 1 <= len(sweeps.messages) <= 15, "who is behind gets the newest alone"
        assert len(frames.messages) == 30
        gaps = [later.stamp_ns - sooner.stamp_ns for sooner, later in zip(fixes.infos, fixes.infos[1:], strict=False)]
        assert min(gaps) >= 100_000_000


def test_a_drive_that_is_about_to_start_is_not_taken_for_one_that_broke_off(
    file: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    start = RealTime.start
    with bus() as stack:
        states = stack.collect(topics.SCENARIO)

        def held(drive: RealTime) -> None:
            states.wait_count(len(states.messages) + 2)  # told meanwhile, on the service's own thread
            start(drive)

        monkeypatch.setattr(RealTime, "start", held)
        stack.start(SERVICE, config(file))
        end = states.wait(lambda state: state.finished)
        assert end.problem == ""
        assert end.time_s == pytest.approx(1.5, abs=0.1)


def test_a_scenario_that_is_wrong_ends_the_start_with_file_and_field(tmp_path: Path) -> None:
    path = tmp_path / "bad.toml"
    path.write_text(scenario_text(rest='[[signs]]\nat_m = 100\ncodes = ["limit:35"]'), encoding="utf-8")
    with bus() as stack, pytest.raises(ConfigError, match=r"bad\.toml: signs\[0\]\.codes\[0\]"):
        stack.start(SERVICE, config(str(path)))


def test_a_camera_that_does_not_exist_is_refused(file: str) -> None:
    with bus() as stack, pytest.raises(ConfigError, match="there is no camera 'rear'"):
        stack.start(SERVICE, config(file, cameras=("rear",)))


def test_tools_start_and_stop_a_drive(file: str) -> None:
    with bus() as stack:
        states = stack.collect(topics.SCENARIO)
        stack.start(SERVICE, config(file, autostart=False))
        states.wait(lambda state: not state.running)
        started = stack.call("start_scenario", {"scenario": file, "seed": 7, "seconds": 60.0})
        assert started.status == "ok"
        states.wait(lambda state: state.running and state.seed == 7)
        stopped = stack.call("stop_scenario")
        assert stopped.result is not None
        assert stopped.result["running"] is False
        stack.wait_for(topics.SCENARIO, lambda state: not state.running)


def test_a_drive_goes_round_with_the_next_seed_until_it_is_stopped(file: str) -> None:
    with bus() as stack:
        states = stack.collect(topics.SCENARIO)
        stack.start(SERVICE, config(file, seconds=1.0, seed=3, again=True))
        states.wait(lambda state: state.running and state.seed == 5, 30.0)
        assert stack.call("stop_scenario").status == "ok"
        after = len(states.messages)
        assert not any(state.running for state in states.wait_count(after + 3)[after + 1 :])


def test_starting_an_unknown_scenario_is_a_tool_error(file: str) -> None:
    with bus() as stack:
        stack.start(SERVICE, config(file, autostart=False))
        outcome = stack.call("start_scenario", {"scenario": "no-such-place"})
        assert outcome.status == "tool_error"
        assert "no-such-place" in outcome.error


def test_a_request_on_the_car_s_bus_is_answered(file: str) -> None:
    request = CanFrames(frames=(CanFrame(stamp_ns=0, arbitration_id=0x7DF, data=bytes([2, 1, 0x0D, 0, 0, 0, 0, 0])),))
    with bus() as stack:
        states, frames = stack.collect(topics.SCENARIO), stack.collect(topics.CAN_RX, id="can0")
        stack.start(SERVICE, config(file, seconds=30.0))
        states.wait(lambda state: state.time_s > 0.2)
        stack.probe.publish(topics.CAN_TX, request, id="can0")
        frames.wait(lambda message: any(frame.arbitration_id == 0x7E8 for frame in message.frames))


def lockstep_run(file: str) -> list[bytes]:
    """All truths and positions of a lockstep drive, encoded."""
    with bus() as stack:
        truths, fixes = stack.collect(topics.TRUTH), stack.collect(topics.GNSS)
        states = stack.collect(topics.SCENARIO)
        stack.start(SERVICE, config(file, lockstep=True, seconds=2.0))
        states.wait(lambda state: state.finished)
        truths.wait_count(40)
        fixes.wait_count(20)
        return [msgspec.msgpack.encode(message) for message in [*truths.messages, *fixes.messages]]


def test_in_lockstep_two_drives_with_one_seed_are_the_same(file: str) -> None:
    assert lockstep_run(file) == lockstep_run(file)


def test_in_lockstep_stamps_are_the_simulation_s(file: str) -> None:
    with bus() as stack:
        clocks, states = stack.collect(topics.CLOCK), stack.collect(topics.SCENARIO)
        stack.start(SERVICE, config(file, lockstep=True, seconds=1.0))
        states.wait(lambda state: state.finished)
        clocks.wait_count(20)
        infos = clocks.infos
        assert [info.stamp_ns for info in infos[:3]] == [10**12 + step * 50_000_000 for step in (1, 2, 3)]
        assert all(tick.lockstep for tick in clocks.messages)


def test_a_lockstep_drive_that_breaks_off_says_so_and_ends(file: str, monkeypatch: pytest.MonkeyPatch) -> None:
    step = World.step

    def breaking(world: World, *inputs: Any) -> Snapshot:
        if world.time_s > 0.5:
            raise ArithmeticError("a bug")
        return step(world, *inputs)

    monkeypatch.setattr(World, "step", breaking)
    with bus() as stack:
        states = stack.collect(topics.SCENARIO)
        stack.start(SERVICE, config(file, lockstep=True, seconds=2.0))
        assert "broke off" in states.wait(lambda state: state.finished).problem


@pytest.mark.parametrize("lockstep", [False, True])
@pytest.mark.parametrize(
    ("trouble", "told"),
    [(StudioError("no OpenGL here"), "no OpenGL here"), (ArithmeticError("a bug"), "could not begin")],
)
def test_a_drive_that_cannot_begin_says_why_and_ends(
    file: str, lockstep: bool, trouble: Exception, told: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    def load(*_: object) -> None:
        raise trouble

    monkeypatch.setattr(Studio, "load", load)
    with bus() as stack:
        states = stack.collect(topics.SCENARIO)
        stack.start(SERVICE, config(file, cameras=("front",), lockstep=lockstep))
        state = states.wait(lambda state: state.finished)
        assert told in state.problem
        assert not state.running


@pytest.mark.filterwarnings("ignore::pytest.PytestUnhandledThreadExceptionWarning")
def test_a_drive_by_the_wall_clock_that_breaks_off_says_so_and_ends(file: str, monkeypatch: pytest.MonkeyPatch) -> None:
    def breaking(*_: object) -> Snapshot:
        raise ArithmeticError("a bug")

    monkeypatch.setattr(World, "step", breaking)
    with bus() as stack:
        states = stack.collect(topics.SCENARIO)
        stack.start(SERVICE, config(file))
        state = states.wait(lambda state: state.finished)
        assert "broke off" in state.problem
        assert not state.running


def test_a_start_that_failed_says_nothing_of_the_drive_that_was_asked_for_since(
    file: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    entered, go_on = threading.Event(), threading.Event()

    def load(*_: object) -> None:
        entered.set()
        go_on.wait(10.0)
        raise StudioError("too late")

    monkeypatch.setattr(Studio, "load", load)
    with bus() as stack:
        states = stack.collect(topics.SCENARIO)
        stack.start(SERVICE, config(file, cameras=("front",)))
        assert entered.wait(10.0)
        assert stack.call("stop_scenario").status == "ok"
        go_on.set()
        seen = len(states.messages)
        assert not any(state.problem for state in states.wait_count(seen + 2))


def open_studio(world: World) -> Studio:
    studio = Studio([CAMERAS["front"]], 1)
    try:
        studio.load(world.scene())
    except StudioError as error:
        studio.close()
        pytest.skip(f"no pictures here: {error}")
    return studio


def test_the_studio_draws_what_is_ordered_and_leaves_what_is_too_late() -> None:
    cv2, np = pytest.importorskip("cv2"), pytest.importorskip("numpy")
    world = World(scenario(), 1)
    studio = open_studio(world)
    try:
        scene = world.step().scene
        studio.order(Order(1, "front", scene))
        picture = studio.take(1, 30.0)
        assert picture is not None
        pixels = cv2.imdecode(np.frombuffer(picture.jpeg, np.uint8), cv2.IMREAD_COLOR)
        assert pixels.shape == (360, 640, 3)
        assert pixels.std() > 10
        studio.order(Order(2, "front", scene, until_ns=1))
        late = studio.take(2, 30.0)
        assert late is not None
        assert not late.jpeg
    finally:
        studio.close()


def test_a_picture_on_order_is_no_answer_to_the_next_world() -> None:
    world = World(scenario(), 1)
    studio = open_studio(world)
    try:
        for number in (1, 2, 3):
            studio.order(Order(number, "front", world.step().scene))
        studio.load(World(scenario(), 2).scene())
        assert studio.waiting == 0
        studio.order(Order(1, "front", world.step().scene))
        assert studio.take(1, 30.0) is not None
        assert studio.take(2) is None, "a picture of the world before"
    finally:
        studio.close()


def test_a_drive_with_cameras_publishes_pictures_and_counts_the_late_ones(file: str) -> None:
    with bus() as stack:
        states, pictures = stack.collect(topics.SCENARIO), stack.collect(topics.CAMERA, id="front")
        stack.start(SERVICE, config(file, cameras=("front",), seconds=2.0, ahead_ms=2000.0))
        while not any(state.time_s > 0.0 for state in states.messages):
            answer = stack.call("scenario_state")
            if answer.status == "tool_error":
                pytest.skip(f"no pictures here: {answer.error}")
            states.wait_count(len(states.messages) + 1, 60.0)
        end = states.wait(lambda state: state.finished, 60.0)
        assert len(pictures.messages) + end.late_frames == 20
        assert len(pictures.messages) >= 1
        assert pictures.messages[0].jpeg[:2] == b"\xff\xd8"


def test_closing_in_the_middle_of_a_drive_leaves_no_thread(file: str) -> None:
    stack: TestBus
    with bus() as stack:
        states = stack.collect(topics.SCENARIO)
        stack.start(SERVICE, config(file, seconds=60.0))
        states.wait(lambda state: state.time_s > 0.2)
    assert not [thread for thread in threading.enumerate() if thread.name.startswith("simulator-d")]
