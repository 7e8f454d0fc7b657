"""Logs written by python-can from the drive of a simulated car, and by hand."""

from pathlib import Path

import can

from drivemcp.files.can_logs.log import CanLog
from drivemcp.paths import data
from proto.sensors import CanFrame
from services.can.buses.link import to_message
from services.simulator.car.state import CarModel, Controls
from services.simulator.ecus.can_frames import FrameEncoder

NS = 1_000_000_000
START_S = 1_700_000_000.0
CLASSIC = (".asc", ".blf", ".csv", ".log", ".trc")
WITH_FD = (".asc", ".blf", ".log")


def drive(seconds: float, speed_mps: float = 13.9) -> list[CanFrame]:
    """What the simulated car sends."""
    encoder, model = FrameEncoder(data("vehicles/sim/sim.dbc")), CarModel()
    found: list[CanFrame] = []
    for number in range(round(seconds * 50)):
        now_ns = int(START_S * NS) + number * 20_000_000
        found += encoder.due(model.step(0.02, Controls(speed_mps=speed_mps)), now_ns)
    return found


def write(path: Path, frames: list[CanFrame], channel: int | str | None = None) -> Path:
    """A log by python-can."""
    with can.Logger(str(path)) as logger:
        for frame in frames:
            message = to_message(frame)
            message.channel = channel
            logger.on_message_received(message)
    return path


def candump(path: Path, times_s: list[float]) -> CanLog:
    """A log of frames with these times, numbered by their ids."""
    path.write_text("".join(f"({each:.6f}) can0 {number:03X}#11\n" for number, each in enumerate(times_s)))
    return CanLog(path)
