"""Frames of every kind across a bus, and a bus that is lost and comes back."""

import re
import threading
from collections.abc import Callable, Sequence
from typing import Any, ClassVar

import can
import pytest
from hypothesis import given
from hypothesis import strategies as st

from drivemcp.files.can_logs.log import frame_of
from drivemcp.paths import data
from drivemcp.testing import bus
from proto import topics
from proto.sensors import CanFrame
from services.can.buses.link import NodeLink, PythonCanLink, to_message
from services.can.buses.opening import BusConfig
from services.can.buses.zenoh_bus import ZenohBus
from services.can.service import SERVICE, CanConfig
from services.simulator.car.state import CarModel, Controls
from services.simulator.ecus.can_frames import FrameEncoder

FD_LENGTHS = [0, 1, 2, 3, 4, 5, 6, 7, 8, 12, 16, 20, 24, 32, 48, 64]
NS = 1_000_000_000


@st.composite
def frames(draw: st.DrawFn) -> CanFrame:
    """A frame as a bus can carry it."""
    kind = draw(st.sampled_from(["classic", "fd", "remote", "error"]))
    extended = draw(st.booleans())
    length = draw(st.sampled_from(FD_LENGTHS if kind == "fd" else FD_LENGTHS[:9]))
    return CanFrame(
        stamp_ns=draw(st.integers(2 * NS * 10**9, 2 * NS * 10**9)),
        arbitration_id=draw(st.integers(0, (1 << (29 if extended else 11)) - 1)),
        data=b"" if kind == "remote" else draw(st.binary(min_size=length, max_size=length)),
        extended=extended,
        fd=kind == "fd",
        remote=kind == "remote",
        requested_bytes=length if kind == "remote" else 0,
        error=kind == "error",
        bitrate_switch=kind == "fd" and draw(st.booleans()),
        error_state=kind == "fd" and draw(st.booleans()),
    )


@given(frame=frames())
def test_a_frame_of_any_kind_is_the_same_after_python_can(frame: CanFrame) -> None:
    assert frame_of(to_message(frame), frame.stamp_ns) == frame


def test_every_kind_of_frame_crosses_the_carried_bus() -> None:
    sent = [
        can.Message(arbitration_id=0x123, data=bytes(range(64)), is_fd=True, bitrate_switch=True, is_extended_id=False),
        can.Message(arbitration_id=0x18FEF100, data=b"\x01\x02", is_extended_id=True),
        can.Message(arbitration_id=0x7FF, is_remote_frame=True, dlc=5, is_extended_id=False),
        can.Message(arbitration_id=0x04, is_error_frame=True, data=bytes(8), is_extended_id=False),
        can.Message(arbitration_id=1, data=bytes(12), is_fd=True, error_state_indicator=True, is_extended_id=False),
    ]
    with bus() as b:
        car = b.node("simulator")
        with ZenohBus("can0", link=NodeLink(b.node("tester"), "can0")) as port:
            _echo(car)
            for message in sent:
                port.send(message)
            heard = [port.recv(5.0) for _ in sent]
    assert all(
        one is not None and one.equals(other, None, check_channel=False) for one, other in zip(heard, sent, strict=True)
    )


def _echo(car: Any) -> None:
    """What is sent on the bus is heard on it."""
    car.subscribe(topics.CAN_TX, lambda message, _: car.publish(topics.CAN_RX, message, id="can0"), id="can0")


class Flaky(can.BusABC):
    """An adapter that can be pulled out, and a controller that can fall off its bus."""

    plugged = True
    off = False
    opened = 0
    garbled = 0
    failed = threading.Event()
    source: ClassVar[Callable[[], can.Message]]

    def __init__(self, channel: Any, **kwargs: Any) -> None:
        self._check()
        Flaky.opened += 1
        Flaky.off = False
        super().__init__(channel, **kwargs)

    def _check(self) -> None:
        if not Flaky.plugged:
            Flaky.failed.set()
            raise can.CanOperationError("no such device")

    def _recv_internal(self, timeout: float | None) -> tuple[can.Message | None, bool]:
        self._check()
        threading.Event().wait(0.01)  # a frame every 10 ms
        if Flaky.garbled > 0:
            Flaky.garbled -= 1
            raise ValueError("invalid literal for int() with base 16: 'x1'")
        return (None if Flaky.off else Flaky.source()), False

    def send(self, msg: can.Message, timeout: float | None = None) -> None:
        self._check()

    @property  # type: ignore[misc]
    def state(self) -> can.BusState:
        return can.BusState.ERROR if Flaky.off else can.BusState.ACTIVE


@pytest.fixture
def adapter(monkeypatch: pytest.MonkeyPatch) -> type[Flaky]:
    monkeypatch.setitem(can.interfaces.BACKENDS, "flaky", (__name__, "Flaky"))
    Flaky.plugged, Flaky.off, Flaky.opened, Flaky.garbled = True, False, 0, 0
    Flaky.failed.clear()
    encoder, model = FrameEncoder(data("vehicles/sim/sim.dbc")), CarModel()
    Flaky.source = lambda: to_message(encoder.encode("Motion", model.step(0.01, Controls(speed_mps=11.0))))
    return Flaky


def test_an_adapter_pulled_out_makes_the_ego_unknown_and_comes_back_by_itself(adapter: type[Flaky]) -> None:
    with bus() as b:
        egos, health = b.collect(topics.EGO), b.collect(topics.HEALTH, id="can")
        b.start(SERVICE, CanConfig(buses=(BusConfig(interface="flaky"),)))
        egos.wait(lambda ego: ego.speed_mps is not None)
        adapter.plugged = False
        assert adapter.failed.wait(5.0)
        egos.messages.clear()
        ego = egos.wait(lambda ego: ego.speed_mps is None)
        assert "speed_mps" in ego.invalid
        outcome = b.call("send_obd_request", {"service": 1, "pid": 13, "timeout_s": 0.2})
        health.wait(lambda each: re.match("down: .*no such device", each.detail.get("bus can0", "")) is not None)
        adapter.plugged = True
        egos.messages.clear()
        ego = egos.wait(lambda ego: ego.speed_mps is not None)
        health.wait(lambda each: each.detail.get("bus can0", "") == "up, after 1 losses")
    assert ego.speed_mps == pytest.approx(11.0, abs=0.05)
    assert outcome.result is None or outcome.result["status"] == "timeout"
    assert adapter.opened == 2


def test_a_controller_off_its_bus_is_started_again(adapter: type[Flaky]) -> None:
    with bus() as b:
        health = b.collect(topics.HEALTH, id="can")
        b.start(SERVICE, CanConfig(buses=(BusConfig(interface="flaky"),)))
        adapter.off = True
        health.wait(lambda each: each.detail.get("bus can0", "") == "up, after 1 losses")
    assert adapter.opened == 2


def test_bytes_that_are_no_frame_end_nothing(adapter: type[Flaky]) -> None:
    with bus() as b:
        egos, health = b.collect(topics.EGO), b.collect(topics.HEALTH, id="can")
        b.start(SERVICE, CanConfig(buses=(BusConfig(interface="flaky"),)))
        egos.wait(lambda ego: ego.speed_mps is not None)
        adapter.garbled = 3
        health.wait(lambda each: each.detail.get("bus can0", "").startswith("up; 3 times no frame, last: invalid"))
        egos.messages.clear()
        egos.wait(lambda ego: ego.speed_mps is not None)
        adapter.garbled = 100
        health.wait(lambda each: each.detail.get("bus can0", "") == "up, after 1 losses")
    assert adapter.opened == 2


class Scripted:
    """An adapter that gives these one after another, at once: frames, or errors that it raises."""

    state = can.BusState.ACTIVE

    def __init__(self, script: list[can.Message | Exception]) -> None:
        self._script = iter(script)
        self.opened = 0

    def open(self) -> "Scripted":
        self.opened += 1
        return self

    def recv(self, timeout: float) -> can.Message | None:
        given = next(self._script, None)
        if isinstance(given, Exception):
            raise given
        if given is None:
            threading.Event().wait(min(timeout, 0.005))
        return given

    def shutdown(self) -> None:
        pass


def numbered(number: int) -> can.Message:
    return can.Message(arbitration_id=number, data=b"\x01", timestamp=2e9, is_extended_id=False)


def read(adapter: Scripted, last: int) -> tuple[list[int], PythonCanLink]:
    """The ids that were handed over, up to the last one."""
    heard: list[int] = []
    done = threading.Event()

    def hear(frames: Sequence[CanFrame]) -> None:
        heard.extend(each.arbitration_id for each in frames)
        if last in heard:
            done.set()

    with bus() as b:
        link = PythonCanLink(adapter.open, b.node("can"))
        link.listen(hear)
        assert done.wait(10.0)
    return heard, link


def test_bytes_that_are_no_frame_cost_no_frame_before_them() -> None:
    script: list[can.Message | Exception] = []
    for number in range(150):
        script += [numbered(3 * number), numbered(3 * number + 1), ValueError("no hex")]
    adapter = Scripted([*script, numbered(999)])
    heard, link = read(adapter, 999)
    assert heard == [*sorted(each.arbitration_id for each in script if isinstance(each, can.Message)), 999]
    assert (link.garbled, adapter.opened) == (150, 1)


def test_frames_heard_before_an_adapter_is_lost_count() -> None:
    adapter = Scripted([numbered(1), numbered(2), can.CanOperationError("unplugged"), numbered(3)])
    heard, link = read(adapter, 3)
    assert heard == [1, 2, 3]
    assert (link.state, adapter.opened) == ("up, after 1 losses", 2)
