"""A CAN log beside a recording: its frames on the bus, and the ego speed that the CAN service will read from them."""

import json
import struct
import zlib
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any, NamedTuple

import can
from cantools.database import load_file
from cantools.database.errors import Error as CantoolsError

from domain.units import MPS_PER, MPS_PER_KNOT
from drivemcp.errors import UserError
from drivemcp.paths import data
from proto import topics
from proto.sensors import CanFrame, CanFrames
from services.player.recording import TimedMessage

FORMATS = (".asc", ".blf", ".log", ".mf4", ".trc")
"""Looked for beside a recording; what else python-can reads is named with --can."""
OUR_DBC = "vehicles/sim/sim.dbc"
OUR_SIGNAL = "VehicleSpeed"
BUS = "can0"
BATCH_S = 0.02
SPEED_UNITS = {
    "m/s": 1.0, "mps": 1.0,
    **dict.fromkeys(("km/h", "kmh", "kph", "km/hr"), MPS_PER["km/h"]), **dict.fromkeys(("mph", "mi/h"), MPS_PER["mph"]),
    "kn": MPS_PER_KNOT, "knots": MPS_PER_KNOT,
}  # fmt: skip
"""A unit in a DBC or in a track's header, in lower case, in m/s."""
_BROKEN = (ValueError, KeyError, IndexError, struct.error, zlib.error, EOFError, can.CanError, can.io.blf.BLFParseError)


class SpeedSignal(NamedTuple):
    """Where the ego speed stands: the DBC, the signal, its message, and what turns its value into m/s."""

    dbc: Path
    signal: str
    arbitration_id: int
    extended: bool
    """29 bits."""
    j1939: bool
    """Its description says so: then any priority and sender of the same parameter group will do."""
    message: str
    factor: float


def log_beside(source: Path) -> Path | None:
    """The CAN log of a recording: of the same name beside a file, the first by name inside a folder."""
    if source.is_dir():
        inside = sorted(file for file in source.iterdir() if file.suffix.lower() in FORMATS)
        return inside[0] if inside else None
    found = (source.with_suffix(suffix) for suffix in FORMATS)
    return next((file for file in found if file.is_file() and file != source), None)


def speed_signal(dbc: Path | None, signal: str, unit: str) -> SpeedSignal:
    """The signal in our bus description, or in a given one. Raises UserError naming the file and what it holds."""
    path = dbc or data(OUR_DBC)
    signals = _signals(path)
    name = signal or (OUR_SIGNAL if dbc is None else "")
    if name not in signals:
        likely = ", ".join(sorted(each for each in signals if "speed" in each.lower())[:8]) or "none named for speed"
        wanted = f"has no signal {name!r}" if name else "needs --speed-signal"
        raise UserError(f"{path} {wanted}; its speeds: {likely}")
    message, found = signals[name]
    factor = _factor(path, name, unit or found.unit or "")
    return SpeedSignal(
        path, name, message.frame_id, message.is_extended_frame, message.protocol == "j1939", message.name, factor
    )


def _signals(path: Path) -> dict[str, tuple[Any, Any]]:
    try:
        database: Any = load_file(str(path))
    except (OSError, CantoolsError, ValueError, KeyError, TypeError) as error:
        raise UserError(f"{path} cannot be read as a bus description: {_one_line(error)}") from None
    return {signal.name: (message, signal) for message in reversed(database.messages) for signal in message.signals}


def _factor(path: Path, name: str, unit: str) -> float:
    factor = SPEED_UNITS.get(unit.strip().lower())
    if factor is None:
        raise UserError(f"{path}: {name} is in {unit!r}; give --speed-unit: {', '.join(SPEED_UNITS)}")
    return factor


def check_log(path: Path, speed: SpeedSignal) -> None:
    """That the log can be read and carries the signal. Raises UserError."""
    seen = 0
    for message in messages(path):
        seen += 1
        if _carries(message, speed):
            return
    raise UserError(
        f"{path}: none of its {seen} frames is 0x{speed.arbitration_id:X} ({speed.message}), which carries {speed.signal} in "
        f"{speed.dbc.name}; give --dbc and --speed-signal, or --can none"
    )


def _carries(message: Any, speed: SpeedSignal) -> bool:
    if message.is_extended_id != speed.extended:
        return False
    same = _group if speed.j1939 else int
    return same(message.arbitration_id) == same(speed.arbitration_id)


def _group(arbitration_id: int) -> int:
    """The parameter group of a 29-bit id (SAE J1939-21): without priority and source, and to one address without that."""
    to_one = (arbitration_id >> 16 & 0xFF) < 240
    return arbitration_id & (0x3FF0000 if to_one else 0x3FFFF00)


def messages(path: Path) -> Iterator[Any]:
    """Data frames of a log in its order. Raises UserError where python-can cannot read it."""
    try:
        _check_start(path)
        with can.LogReader(str(path)) as reader:
            for message in reader:
                if not message.is_error_frame and not message.is_remote_frame:
                    yield message
    except OSError as error:
        raise UserError(f"cannot read {path}: {error.strerror or error}") from None
    except NotImplementedError:
        raise UserError(
            f"{path}: python-can reads {path.suffix} only with the package asammdf: pip install asammdf"
        ) from None
    except _BROKEN as error:
        raise UserError(f"{path} is no CAN log that python-can can read: {_one_line(error)}") from None


def _check_start(path: Path) -> None:
    """python-can leaves a .blf open that does not begin like one."""
    if path.suffix.lower() == ".blf":
        with path.open("rb") as file:
            if file.read(4) != b"LOGG":
                raise ValueError("it does not begin like a .blf")


def can_messages(path: Path, offset_s: float) -> Iterator[TimedMessage]:
    """Frames in batches of 20 ms; the recording starts `offset_s` after the log's first frame. Stamps count from that start."""
    first_s: float | None = None
    batch: list[CanFrame] = []
    until_s = 0.0
    for message in messages(path):
        first_s = message.timestamp if first_s is None else first_s
        at_s = message.timestamp - first_s - offset_s
        if at_s < 0:
            continue
        if batch and at_s >= until_s:
            yield _timed_message(batch)
            batch = []
        if not batch:
            until_s = at_s + BATCH_S
        batch.append(_frame(message, at_s))
    if batch:
        yield _timed_message(batch)


def _timed_message(batch: list[CanFrame]) -> TimedMessage:
    return TimedMessage(batch[-1].stamp_ns / 1e9, topics.CAN_RX, CanFrames(frames=tuple(batch)), BUS)


def _frame(message: Any, at_s: float) -> CanFrame:
    return CanFrame(
        stamp_ns=round(at_s * 1e9),
        arbitration_id=message.arbitration_id,
        data=bytes(message.data),
        extended=message.is_extended_id,
        fd=message.is_fd,
    )


def rebased(frames: Iterable[CanFrame], start_ns: int) -> CanFrames:
    """The same frames, stamped by the clock on which the recording began."""
    return CanFrames(
        frames=tuple(
            CanFrame(
                stamp_ns=start_ns + each.stamp_ns,
                arbitration_id=each.arbitration_id,
                data=each.data,
                extended=each.extended,
                fd=each.fd,
            )
            for each in frames
        )
    )


def profile_of(speed: SpeedSignal) -> str:
    """A vehicle profile (TOML) for the CAN service that reads the ego speed and nothing else."""
    dbc, signal = json.dumps(str(speed.dbc.resolve())), json.dumps(speed.signal)
    return (
        f'name = "recording"\n[buses.can0]\ndescription = {dbc}\n'
        "[vehicle]\ntyre_nominal_bar = [2.4, 2.4, 2.4, 2.4]\n[ecus]\n[fields]\n"
        f'speed_mps = {{ vss = "Vehicle.Speed", signal = {signal}, unit = "m/s", dbc_unit = "m/s", '
        f"factor = {speed.factor!r}, minimum = 0.0, maximum = 83.4, "
        "max_step_per_s = 30.0, max_age_s = 0.5 }\n"
    )


def _one_line(error: Exception) -> str:
    return " ".join(str(error).split())[:200] or type(error).__name__
