"""What the tools of the MCP-CAN catalogue answer: its names and shapes."""

from collections.abc import Iterable
from typing import Annotated

import msgspec

from proto.vehicle import DtcText
from services.can.errors import MalformedFrame
from services.can.profiles.dbc import Dbc
from services.can.tools.replies import unit_name
from services.can.vehicle import Vehicle

NS = 1_000_000_000
MAX_ROWS = 2000
MAX_DURATION_S = 600.0

Scalar = float | int | str
FrameId = Annotated[int | str, msgspec.Meta(description="arbitration id, a number or hex text", examples=["0x1A0"])]


FrameBytes = Annotated[list[int], msgspec.Meta(description="bytes of the frame, as numbers", examples=[[255, 12, 0]])]


class FrameRow(msgspec.Struct, frozen=True, kw_only=True, omit_defaults=True):
    """A frame as it was heard: seconds since 1970 at the source, id in hex, bytes; of a known message one signal.
    `held_back` says why there are no bytes.
    """

    timestamp: float
    arbitration_id: str
    data: list[int]
    signal_name: str | None = None
    signal_value: Scalar | None = None
    held_back: str | None = None


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
    """The newest value of every signal heard, frames heard since start, seconds since start. `held_back` says what is
    not among them; empty where nothing is held back.
    """

    signals: dict[str, SignalNow]
    frame_count: int
    uptime_s: float
    malformed: int = 0
    held_back: str = ""


class CodeReport(msgspec.Struct, frozen=True, kw_only=True, omit_defaults=True):
    """Trouble codes in words; age_s is that of the oldest unit's answer, and None where none has answered yet: then
    nothing is known. `missing`: the listed units that gave no list when they were last asked.
    """

    stored: tuple[DtcText, ...]
    pending: tuple[DtcText, ...]
    age_s: float | None
    warning_lamps: tuple[str, ...]
    missing: tuple[str, ...] = ()


def parse_id(text: int | str) -> int:
    """An arbitration id given as a number or as hex text. Raises ValueError."""
    value = text if isinstance(text, int) else int(text, 16)
    if not 0 <= value < 1 << 29:
        raise ValueError(f"{text!r} is no arbitration id")
    return value


def window_ns(duration_s: float, now_ns: int) -> int:
    """Where a window of this length that ends now begins."""
    return now_ns - int(min(max(duration_s, 0.0), MAX_DURATION_S) * NS)


def decoded(descriptions: Iterable[Dbc], arbitration_id: int | str, data: list[int]) -> DecodedFrame:
    """A frame that the caller has, decoded by the first description that knows its id."""
    complaint = ""
    for dbc in descriptions:
        try:
            return DecodedFrame(status="ok", signals=dbc.decode(parse_id(arbitration_id), bytes(data)))
        except (MalformedFrame, ValueError) as error:
            complaint = complaint or str(error)
    return DecodedFrame(status="error", message=complaint)


def code_report(vehicle: Vehicle, language: str, now_ns: int) -> CodeReport:
    """The trouble codes that the units last reported."""
    stamp_ns, names = vehicle.stored.stamp_ns, vehicle.profile.ecu_names
    silent = sorted({*vehicle.stored.missing, *vehicle.pending.missing})
    return CodeReport(
        stored=tuple(vehicle.book.explain(code, language) for code in vehicle.stored.codes),
        pending=tuple(vehicle.book.explain(code, language) for code in vehicle.pending.codes),
        age_s=None if stamp_ns is None else round(max(0.0, (now_ns - stamp_ns) / NS), 3),
        warning_lamps=vehicle.assessment.degradation.warning_lamps,
        missing=tuple(unit_name(names, unit) for unit in silent),
    )
