"""What the tools of the MCP-CAN catalogue answer: its names and shapes."""

import contextlib

import msgspec

from proto.sensors import CanFrame
from proto.vehicle import DtcText
from services.can.dbc import Dbc
from services.can.errors import MalformedFrame
from services.can.vehicle import Vehicle

NS = 1_000_000_000
MAX_ROWS = 2000
MAX_DURATION_S = 600.0

Scalar = float | int | str


class FrameRow(msgspec.Struct, frozen=True, kw_only=True, omit_defaults=True):
    """A frame as it was heard: seconds since 1970 at the source, id in hex, bytes; of a known message one signal."""

    timestamp: float
    arbitration_id: str
    data: list[int]
    signal_name: str | None = None
    signal_value: Scalar | None = None


class DecodedFrame(msgspec.Struct, frozen=True, kw_only=True, omit_defaults=True):
    """`status`: ok or error."""

    status: str
    signals: dict[str, Scalar] | None = None
    message: str | None = None


class Sample(msgspec.Struct, frozen=True, kw_only=True):
    """A signal's value at a time (seconds since 1970, the source's stamp)."""

    timestamp: float
    value: Scalar


class SignalNow(msgspec.Struct, frozen=True, kw_only=True):
    """A signal's newest value."""

    value: Scalar
    unit: str
    message: str
    age_s: float


class Snapshot(msgspec.Struct, frozen=True, kw_only=True):
    """The newest value of every signal heard, frames heard since start, seconds since start."""

    signals: dict[str, SignalNow]
    frame_count: int
    uptime_s: float
    malformed: int = 0


class CodeReport(msgspec.Struct, frozen=True, kw_only=True):
    """Trouble codes in words; age_s is None where no unit has answered yet, and then nothing is known."""

    stored: tuple[DtcText, ...]
    pending: tuple[DtcText, ...]
    age_s: float | None
    warning_lamps: tuple[str, ...]


def parse_id(text: int | str) -> int:
    """An arbitration id given as a number or as hex text. Raises ValueError."""
    value = text if isinstance(text, int) else int(text, 16)
    if not 0 <= value < 1 << 29:
        raise ValueError(f"{text!r} is no arbitration id")
    return value


def window_ns(duration_s: float, now_ns: int) -> int:
    """Where a window of this length that ends now begins."""
    return now_ns - int(min(max(duration_s, 0.0), MAX_DURATION_S) * NS)


def frame_rows(dbc: Dbc, frames: list[CanFrame], signal_name: str | None = None) -> list[FrameRow]:
    """Frames as rows; each with the named signal, or with the first one of its message."""
    return [_row(dbc, frame, signal_name) for frame in frames]


def _row(dbc: Dbc, frame: CanFrame, signal_name: str | None) -> FrameRow:
    signals: dict[str, Scalar] = {}
    with contextlib.suppress(MalformedFrame):  # heard all the same; only its meaning is unknown
        signals = dbc.decode(frame.arbitration_id, frame.data)
    name = signal_name if signal_name is not None else next(iter(signals), None)
    return FrameRow(
        timestamp=frame.stamp_ns / NS,
        arbitration_id=f"0x{frame.arbitration_id:X}",
        data=list(frame.data),
        signal_name=name if name in signals else None,
        signal_value=signals.get(name) if name is not None else None,
    )


def decoded(dbc: Dbc, arbitration_id: int | str, data: list[int]) -> DecodedFrame:
    """A frame that the caller has, decoded."""
    try:
        return DecodedFrame(status="ok", signals=dbc.decode(parse_id(arbitration_id), bytes(data)))
    except (MalformedFrame, ValueError) as error:
        return DecodedFrame(status="error", message=str(error))


def samples(vehicle: Vehicle, signal_name: str, since_ns: int) -> list[Sample]:
    """A signal's values in the history. Raises ProfileError for an unknown signal."""
    message, _ = vehicle.dbc.signal(signal_name)
    found = []
    for frame in vehicle.history.since(since_ns, frozenset({message.frame_id}), MAX_ROWS):
        try:
            value = vehicle.dbc.decode(frame.arbitration_id, frame.data)[signal_name]
        except (MalformedFrame, KeyError):
            continue
        found.append(Sample(timestamp=frame.stamp_ns / NS, value=value))
    return found


def snapshot(vehicle: Vehicle, now_ns: int, started_ns: int) -> Snapshot:
    """The newest value of every signal of every message heard."""
    signals: dict[str, SignalNow] = {}
    for frame in vehicle.history.latest():
        try:
            values = vehicle.dbc.decode(frame.arbitration_id, frame.data)
        except MalformedFrame:
            continue
        age_s = max(0.0, (now_ns - frame.stamp_ns) / NS)
        for name, value in values.items():
            message, signal = vehicle.dbc.signal(name)
            signals[name] = SignalNow(value=value, unit=signal.unit or "", message=message.name, age_s=round(age_s, 3))
    return Snapshot(
        signals=signals,
        frame_count=vehicle.history.seen,
        uptime_s=round((now_ns - started_ns) / NS, 3),
        malformed=vehicle.board.malformed,
    )


def ids_of(vehicle: Vehicle, arbitration_id: int | str | None, signal_name: str | None) -> frozenset[int] | None:
    """Which ids a filter means; None: all. Raises ValueError or ProfileError."""
    ids = None if arbitration_id is None else frozenset({parse_id(arbitration_id)})
    if signal_name is None:
        return ids
    message, _ = vehicle.dbc.signal(signal_name)
    of_signal = frozenset({int(message.frame_id)})
    return of_signal if ids is None else ids & of_signal


def code_report(vehicle: Vehicle, language: str, now_ns: int) -> CodeReport:
    """The trouble codes that the units last reported."""
    stamp_ns = vehicle.stored.stamp_ns
    return CodeReport(
        stored=tuple(vehicle.book.explain(code, language) for code in vehicle.stored.codes),
        pending=tuple(vehicle.book.explain(code, language) for code in vehicle.pending.codes),
        age_s=None if stamp_ns is None else round(max(0.0, (now_ns - stamp_ns) / NS), 3),
        warning_lamps=vehicle.assessment.degradation.warning_lamps,
    )
