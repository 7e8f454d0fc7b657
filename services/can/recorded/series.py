"""One signal of a recorded log over its time, thinned out."""

import itertools
import math
from collections import Counter
from pathlib import Path

import msgspec

from drivemcp.errors import UserError
from services.can.recorded.folder import Reading
from services.can.recorded.signals import Key, Signals
from services.can.tools.answers import Scalar
from services.can.vehicle import Vehicle


class Point(msgspec.Struct, frozen=True, kw_only=True):
    """A value at a time, s after the log's first frame."""

    t_s: float
    value: Scalar


class LogSeries(msgspec.Struct, frozen=True, kw_only=True, omit_defaults=True):
    """A signal's points, its first and last among them; least, greatest and mean are of all samples."""

    signal: str
    message: str
    unit: str
    samples_total: int
    other_sources: list[str]
    points: list[Point]
    min: float | None = None
    max: float | None = None
    mean: float | None = None
    remark: str = ""


def series(path: Path, vehicle: Vehicle, signal_name: str, points: int, message: str = "") -> LogSeries:
    """The signal of that message, or of the one that carries it most often. Raises UserError where the log has none."""
    reading, signals = Reading(path), Signals(vehicle)
    found: dict[str, list[tuple[float, Scalar]]] = {}
    others: Counter[str] = Counter()
    for at_s, channel, each in reading:
        if each.is_error_frame or each.is_remote_frame:
            continue
        key = Key(channel, bool(each.is_extended_id), int(each.arbitration_id))
        value = signals.of(key, bytes(each.data), signal_name).get(signal_name)
        if value is None:
            continue
        name = signals.message_of(key)
        if message and name != message:
            others[name] += 1
        else:
            found.setdefault(name, []).append((at_s, value))
    if not found:
        raise UserError(_absent(path, vehicle, signal_name, message, sorted(others)))
    of = max(found, key=lambda name: len(found[name]))
    samples = found[of]
    numbers = [float(value) for _, value in samples if not isinstance(value, str)]
    return LogSeries(
        signal=signal_name,
        message=of,
        unit=signals.unit_of(signal_name, of),
        samples_total=len(samples),
        other_sources=sorted({*others, *found} - {of}),
        points=[Point(t_s=round(at_s, 3), value=value) for at_s, value in thinned(samples, points)],
        min=round(min(numbers), 3) if numbers else None,
        max=round(max(numbers), 3) if numbers else None,
        mean=round(math.fsum(numbers) / len(numbers), 3) if numbers else None,
        remark="; ".join(filter(None, (reading.remark, signals.remark))),
    )


def thinned(samples: list[tuple[float, Scalar]], points: int) -> list[tuple[float, Scalar]]:
    """At most so many, as even as they go, the first and the last among them."""
    if len(samples) <= points:
        return samples
    last = len(samples) - 1
    places = (round(number * last / (points - 1)) for number in range(points))
    return [samples[place] for place, _ in itertools.groupby(places)]


def _absent(path: Path, vehicle: Vehicle, signal_name: str, message: str, others: list[str]) -> str:
    shown = repr(signal_name[:60])
    if others:
        return f"message: {message[:60]!r} does not carry {shown} in {path.name}; take one of {', '.join(others[:10])}"
    if not any(dbc.has_signal(signal_name) for dbc in vehicle.descriptions.values()):
        return f"signal_name: no signal {shown} in the bus description; analyze_can_log names those of a log"
    return f"signal_name: {shown} is not in {path.name}, or may not be told; analyze_can_log names those that are"
