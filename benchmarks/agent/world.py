"""The fixed world that the questions are asked in: all services in one process, and a car at 50 km/h with a fault of its ABS.

No camera sees anything, so that what is asked of the scene has one right answer: it is not known.
"""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from drivemcp.bus.session import wait_settled
from drivemcp.node import Node
from drivemcp.paths import data
from drivemcp.registry import load_service
from drivemcp.testing import TestBus, bus
from proto import topics
from proto.sensors import CanFrame, CanFrames
from proto.services import SERVICES
from services.gateway.service import SERVICE
from services.logger.service import LoggerConfig
from services.simulator.car.state import CarState
from services.simulator.ecus.bank import EcuBank
from services.simulator.ecus.can_frames import FrameEncoder
from services.simulator.service import SimulatorConfig

SPEED_MPS = 50.0 / 3.6
FAULT = "abs_fault"
NOTE = {"kind": "note", "key": "tyres", "value": {"mounted": "winter tyres", "since": "2026-10-20"}}
READY_S = 30.0


class Car:
    """Control units that answer, on a bus that carries the car's state."""

    def __init__(self, node: Node) -> None:
        self._node, self._units = node, EcuBank()
        self._encoder = FrameEncoder(data("vehicles/sim/sim.dbc"))
        self._moving = CarState(speed_mps=SPEED_MPS, wheel_speeds_mps=(SPEED_MPS,) * 4)
        self._units.activate(FAULT)
        node.subscribe(topics.CAN_TX, lambda message, _: self._asked(message.frames), id="can0")
        node.every(0.02, lambda: self._say(self._encoder.due(self._state(), node.clock.now_ns())))

    def _state(self) -> CarState:
        return self._units.affect(self._moving, self._node.clock.now_ns())

    def _asked(self, frames: tuple[CanFrame, ...]) -> None:
        now_ns, state = self._node.clock.now_ns(), self._state()
        self._say([answer for frame in frames for answer in self._units.on_frame(frame, state, now_ns)])

    def _say(self, frames: list[CanFrame]) -> None:
        if frames:
            self._node.publish(topics.CAN_RX, CanFrames(frames=tuple(frames)), id="can0")


@contextmanager
def world(folder: Path) -> Iterator[str]:
    """The gateway's address in the running world. Raises TimeoutError where it does not come up."""
    with bus() as b:
        configs = {
            "logger": LoggerConfig(out_dir=str(folder), secret_dir=str(folder / "secrets")),
            "simulator": SimulatorConfig(autostart=False),
        }
        for row in SERVICES:
            if row.tools:
                b.start(load_service(row.name), configs.get(row.name))
        Car(b.node("car"))
        gateway = b.start(SERVICE)
        offered = {tool for row in SERVICES for tool in row.tools} - {"step_recording"}
        if not wait_settled(lambda: offered <= gateway.catalogue().keys() and _reported(b), READY_S):
            raise TimeoutError(f"the world was not ready within {READY_S:.0f} s")
        b.call("remember", NOTE)
        yield gateway.detail["mcp"]


def _reported(b: TestBus) -> bool:
    """Whether the control units have told their codes."""
    told = b.call("read_dtcs")
    return told.ok and told.result is not None and bool(told.result["stored"])
