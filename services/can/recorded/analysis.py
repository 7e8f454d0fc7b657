"""What a recorded log holds: ids and their rates, the signals' ranges, trouble codes, and silences."""

import itertools
import statistics
from array import array
from collections import Counter
from pathlib import Path

import msgspec

from drivemcp.errors import UserError
from services.can.diagnostics.addresses import ANSWER_IDS, FUNCTIONAL_IDS, PHYSICAL_IDS
from services.can.j1939 import messages
from services.can.j1939.transport import CONNECTION, DATA
from services.can.profiles.dbc import pgn_of
from services.can.recorded.codes import Codes, CodeSeen, FaultSeen
from services.can.recorded.folder import Reading
from services.can.recorded.signals import Key, Signals
from services.can.tools.answers import Scalar
from services.can.vehicle import Vehicle

IDS_LIMIT, IDS_TOLD, SIGNALS_TOLD, GAPS_TOLD = 4096, 100, 400, 20
GAP_FRAMES, GAP_PERIODS, GAP_S = 10, 5.0, 0.5
"""A silence is told of an id heard ten times, from five usual periods and half a second on."""
ON_DEMAND = ANSWER_IDS | FUNCTIONAL_IDS | PHYSICAL_IDS
ON_DEMAND_GROUPS = frozenset({messages.REQUEST, messages.ACKNOWLEDGEMENT, CONNECTION, DATA})
"""Of J1939: requests, answers to them, and the pieces of long groups."""


class IdRow(msgspec.Struct, frozen=True, kw_only=True, omit_defaults=True):
    """An id as it was heard: how often, and by its median period how many times a second."""

    arbitration_id: str
    extended: bool
    count: int
    name: str | None = None
    channel: str | None = None
    rate_hz: float | None = None
    median_period_ms: float | None = None


class SignalRow(msgspec.Struct, frozen=True, kw_only=True, omit_defaults=True):
    """A signal's range; of one with names how often each was said."""

    name: str
    message: str
    unit: str
    min: float | None = None
    max: float | None = None
    mean: float | None = None
    first: float | None = None
    last: float | None = None
    samples: int | None = None
    values: dict[str, int] | None = None


class LogAnalysis(msgspec.Struct, frozen=True, kw_only=True, omit_defaults=True):
    """A log in short. `remark`: what could not be read; `held_back`: what may not be told; `ids_left_out`,
    `signals_left_out`: how many are not listed.
    """

    file: str
    frame_count: int
    error_frames: int
    truncated: bool
    duration_s: float
    distinct_ids: int
    ids: list[IdRow]
    signals: list[SignalRow]
    obd_dtcs: list[CodeSeen]
    j1939_dtcs: list[FaultSeen]
    timing_gaps: list[str]
    malformed: int = 0
    ids_left_out: int = 0
    signals_left_out: int = 0
    remark: str = ""
    held_back: str = ""


class _Range:
    """The numbers and names of one signal, counted as they come."""

    def __init__(self) -> None:
        self.count, self.total = 0, 0.0
        self.low = self.high = self.first = self.last = 0.0
        self.names: Counter[str] = Counter()

    def take(self, value: Scalar) -> None:
        if isinstance(value, str):
            self.names[value] += 1
            return
        number = float(value)
        if not self.count:
            self.low = self.high = self.first = number
        self.low, self.high, self.last = min(self.low, number), max(self.high, number), number
        self.count, self.total = self.count + 1, self.total + number


def analyse(path: Path, vehicle: Vehicle) -> LogAnalysis:
    """Read a log through. Raises UserError where it holds no frame."""
    reading, signals, codes = Reading(path), Signals(vehicle), Codes()
    stamps: dict[Key, array[float]] = {}
    ranges: dict[tuple[str, str], _Range] = {}
    errors, unlisted, frames, end_s = 0, 0, 0, 0.0
    for at_s, channel, message in reading:
        if message.is_error_frame:
            errors += 1
            continue
        frames, end_s = frames + 1, at_s
        key = Key(channel, bool(message.is_extended_id), int(message.arbitration_id))
        if key not in stamps and len(stamps) >= IDS_LIMIT:
            unlisted += 1
        else:
            stamps.setdefault(key, array("d")).append(at_s)
        if message.is_remote_frame:
            continue
        carrier = signals.message_of(key)
        for name, value in signals.of(key, bytes(message.data)).items():
            if (found := ranges.get((name, carrier))) is None:
                found = ranges[name, carrier] = _Range()
            found.take(value)
        codes.take(key.extended, key.arbitration_id, bytes(message.data), at_s)
    if not frames and not errors:
        raise UserError(f"path: {path.name} holds no frame; {reading.log.nothing}")
    others = f"{unlisted} frames are of ids beyond the first {IDS_LIMIT}" if unlisted else ""
    rows = [_id_row(key, times, signals.message_of(key)) for key, times in stamps.items()]
    rows.sort(key=lambda row: (-row.count, row.arbitration_id))
    told = [_signal_row(name, message, signals, each) for (name, message), each in sorted(ranges.items())]
    return LogAnalysis(
        file=path.name,
        frame_count=frames,
        error_frames=errors,
        truncated=reading.truncated,
        duration_s=round(end_s, 3),
        distinct_ids=len(stamps),
        ids=rows[:IDS_TOLD],
        signals=told[:SIGNALS_TOLD],
        obd_dtcs=codes.seen(),
        j1939_dtcs=codes.faults_seen(),
        timing_gaps=_gaps(stamps, signals),
        malformed=reading.log.malformed,
        ids_left_out=max(0, len(rows) - IDS_TOLD),
        signals_left_out=max(0, len(told) - SIGNALS_TOLD),
        remark="; ".join(filter(None, (reading.remark, signals.remark, others))),
        held_back=signals.held_back,
    )


def _id_row(key: Key, times: "array[float]", name: str) -> IdRow:
    period_s = _period_s(times)
    return IdRow(
        arbitration_id=f"0x{key.arbitration_id:X}",
        extended=key.extended,
        count=len(times),
        name=name or None,
        channel=key.channel or None,
        rate_hz=round(1.0 / period_s, 2) if period_s else None,
        median_period_ms=None if period_s is None else round(1000.0 * period_s, 1),
    )


def _signal_row(name: str, message: str, signals: Signals, found: _Range) -> SignalRow:
    values = dict(found.names.most_common(50)) or None
    unit = signals.unit_of(name, message)
    if not found.count:
        return SignalRow(name=name, message=message, unit=unit, values=values)
    return SignalRow(
        name=name,
        message=message,
        unit=unit,
        min=round(found.low, 3),
        max=round(found.high, 3),
        mean=round(found.total / found.count, 3),
        first=round(found.first, 3),
        last=round(found.last, 3),
        samples=found.count,
        values=values,
    )


def _period_s(times: "array[float]") -> float | None:
    return statistics.median(after - before for before, after in itertools.pairwise(times)) if len(times) > 1 else None


def _on_demand(key: Key) -> bool:
    return key.arbitration_id in ON_DEMAND or (key.extended and pgn_of(key.arbitration_id) in ON_DEMAND_GROUPS)


def _gaps(stamps: dict[Key, "array[float]"], signals: Signals) -> list[str]:
    """The longest silence of each id that is sent by the clock, the longest first."""
    found: list[tuple[float, str]] = []
    for key, times in stamps.items():
        period_s = _period_s(times)
        if _on_demand(key) or len(times) < GAP_FRAMES or not period_s:
            continue
        gap_s, at_s = max((after - before, before) for before, after in itertools.pairwise(times))
        if gap_s > max(GAP_PERIODS * period_s, GAP_S):
            name = " ".join(filter(None, (f"0x{key.arbitration_id:X}", signals.message_of(key))))
            found.append(
                (gap_s, f"{name}: {gap_s:.2f} s gap at t={at_s:.1f} s (normally every {1000.0 * period_s:.0f} ms)")
            )
    return [words for _, words in sorted(found, reverse=True)[:GAPS_TOLD]]
