"""A CAN log beside a recording: its frames on the bus, and the ego speed that the CAN service will read from them."""

import itertools
from collections import Counter
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any, NamedTuple

from msgspec.structs import replace

from domain.units import MPS_PER, MPS_PER_KNOT
from drivemcp.errors import UserError
from drivemcp.files.bus_description import key_of, load_description, selections, unsound
from drivemcp.files.can_logs.log import CHANNELS_LOOK, CanLog, check_log, listed
from drivemcp.files.encodings import toml_text
from drivemcp.files.folders import files_beside
from drivemcp.paths import data
from proto import topics
from proto.sensors import CanFrame, CanFrames
from services.player.recording import TimedMessage

FORMATS = (".asc", ".blf", ".log", ".mf4", ".trc")
"""Looked for beside a recording; what else is read is named with --can."""
OUR_DBC = "vehicles/sim/sim.dbc"
OUR_SIGNAL = "VehicleSpeed"
BUS = "can0"
BATCH_S = 0.02
SPEED_UNITS = {
    **dict.fromkeys(("m/s", "mps", "m/sec", "meters/second", "metres/second", "meter/sec"), 1.0),
    **dict.fromkeys(("km/h", "kmh", "kph", "km/hr"), MPS_PER["km/h"]),
    **dict.fromkeys(("mph", "mi/h", "miles/h", "miles/hour"), MPS_PER["mph"]),
    "kn": MPS_PER_KNOT, "knots": MPS_PER_KNOT,
}  # fmt: skip
"""A unit in a DBC or in a track's header, in lower case, in m/s."""

DBC_SPELLINGS = {
    **dict.fromkeys(("kmph", "unit_kilometerperhour"), "km/h"), **dict.fromkeys(("meter/s", "unit_meterpersecon"), "m/s"),
    **dict.fromkeys(("mile/h", "miles/h", "unit_mileperhour"), "mph"),
}  # fmt: skip
"""More spellings that bus descriptions have of them."""


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
    """The CAN log of a recording: of the same name beside a file, or inside a folder. Raises UserError where there are several."""
    found = files_beside(source, FORMATS)
    if len(found) > 1:
        raise UserError(
            f"{source} has several CAN logs: {', '.join(each.name for each in found)}; name one with --can, or --can none"
        )
    return found[0] if found else None


def speed_signal(dbc: Path | None, signal: str, unit: str) -> SpeedSignal:
    """The signal (`NAME` or `MESSAGE.NAME`) in our bus description, or in a given one. Raises UserError naming the file and
    what it holds.
    """
    path = dbc or data(OUR_DBC)
    database = load_description(path)
    wanted = signal or (OUR_SIGNAL if dbc is None else "")
    all_signals = [(message, each) for message in database.messages for each in message.signals]
    found = [(m, each) for m, each in all_signals if wanted in (each.name, f"{m.name}.{each.name}")]
    if len(found) > 1:
        if len({m.name for m, _ in found}) == 1:
            ids = ", ".join(f"0x{m.frame_id:X}" for m, _ in found)
            raise UserError(
                f"{path}: {found[0][0].name}.{found[0][1].name} is described {len(found)} times ({ids}); keep or rename one of them"
            )
        choices = ", ".join(f"{m.name}.{each.name} (0x{m.frame_id:X}, {each.unit or 'no unit'})" for m, each in found)
        raise UserError(f"{path}: {wanted!r} is in several messages; choose one with --speed-signal: {choices}")
    if not found:
        speeds = sorted({each.name for _, each in all_signals if "speed" in each.name.lower()})
        missing = f"has no signal {wanted!r}" if wanted else "needs --speed-signal"
        raise UserError(f"{path} {missing}; its speeds: {', '.join(speeds[:8]) or 'none named for speed'}")
    message, speed = found[0]
    if why := unsound(path, database).get(key_of(message)):
        raise UserError(f"{path}: the message of {speed.name} is described wrongly: {why}")
    try:
        list(selections(message, speed))
    except UserError as error:
        raise UserError(f"{path}: {error}") from error
    factor = _factor(path, speed.name, unit or speed.unit or "")
    return SpeedSignal(
        path, speed.name, message.frame_id, message.is_extended_frame, message.protocol == "j1939", message.name, factor
    )


def _factor(path: Path, name: str, unit: str) -> float:
    spelt = unit.strip().lower()
    factor = SPEED_UNITS.get(DBC_SPELLINGS.get(spelt, spelt))
    if factor is None:
        raise UserError(f"{path}: {name} is in {unit!r}; give --speed-unit: {', '.join(SPEED_UNITS)}")
    return factor


def open_log(path: Path, speed: SpeedSignal, channel: str) -> CanLog:
    """The log's bus that carries the signal, its first 50,000 records looked at. Raises UserError where no bus does, or several do."""
    check_log(path, "--can")
    log = CanLog(path)
    seen: Counter[str] = Counter()
    carrying: Counter[str] = Counter()
    for _, each, message in itertools.islice(log.messages(), CHANNELS_LOOK):
        seen[each] += 1
        carrying[each] += _carries(message, speed)
    carrying = +carrying
    if channel:
        carrying = Counter({channel: carrying[channel]} if carrying[channel] else {})
    if not seen:
        raise UserError(f"{path} holds no frame: {log.nothing}")
    if not carrying:
        where = f" of channel {channel} ({listed(path, seen)})" if channel else ""
        raise UserError(
            f"{path}: none of its {seen.total()} frames{where} is 0x{speed.arbitration_id:X} ({speed.message}), which carries "
            f"{speed.signal} in {speed.dbc.name}; give --dbc and --speed-signal, or --can none"
        )
    if len(carrying) > 1:
        raise UserError(
            f"{path}: 0x{speed.arbitration_id:X} ({speed.message}) is on {len(carrying)} buses: {listed(path, carrying)}; choose "
            "one with --can-channel"
        )
    log.channel = next(iter(carrying))
    log.left_out.update({each: count for each, count in seen.items() if each not in ("", log.channel)})
    return log


def _carries(message: Any, speed: SpeedSignal) -> bool:
    if message.is_extended_id != speed.extended:
        return False
    same = _group if speed.j1939 else int
    return same(message.arbitration_id) == same(speed.arbitration_id)


def _group(arbitration_id: int) -> int:
    """The parameter group of a 29-bit id (SAE J1939-21): without priority and source, and to one address without that."""
    to_one = (arbitration_id >> 16 & 0xFF) < 240
    return arbitration_id & (0x3FF0000 if to_one else 0x3FFFF00)


def can_messages(log: CanLog, offset_s: float) -> Iterator[TimedMessage]:
    """Frames in batches of 20 ms; the recording starts `offset_s` after the log's first frame. Stamps count from that start."""
    batch: list[CanFrame] = []
    until_s = 0.0
    for record in log:
        at_s = record.at_s - offset_s
        if at_s < 0 or record.frame.error or record.frame.remote:
            continue
        if batch and at_s >= until_s:
            yield _timed_message(batch)
            batch = []
        if not batch:
            until_s = at_s + BATCH_S
        batch.append(replace(record.frame, stamp_ns=round(at_s * 1e9)))
    if batch:
        yield _timed_message(batch)


def _timed_message(batch: list[CanFrame]) -> TimedMessage:
    return TimedMessage(batch[-1].stamp_ns / 1e9, topics.CAN_RX, CanFrames(frames=tuple(batch)), BUS)


def rebased(frames: Iterable[CanFrame], start_ns: int) -> CanFrames:
    """The same frames, stamped by the clock on which the recording began."""
    return CanFrames(frames=tuple(replace(each, stamp_ns=start_ns + each.stamp_ns) for each in frames))


def profile_of(speed: SpeedSignal) -> str:
    """A vehicle profile (TOML) for the CAN service that reads the ego speed and nothing else."""
    dbc, message, signal = (toml_text(each) for each in (str(speed.dbc.resolve()), speed.message, speed.signal))
    return (
        f'name = "recording"\n[buses.can0]\ndescription = {dbc}\n'
        "[vehicle]\ntyre_nominal_bar = [2.4, 2.4, 2.4, 2.4]\n[ecus]\n[fields]\n"
        f'speed_mps = {{ vss = "Vehicle.Speed", message = {message}, signal = {signal}, unit = "m/s", dbc_unit = "m/s", '
        f"factor = {speed.factor!r}, minimum = 0.0, maximum = 83.4, "
        "max_step_per_s = 30.0, max_age_s = 0.5 }\n"
    )
