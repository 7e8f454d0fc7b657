"""What the buses carried, as far as it may be told: curated signals, and the rest only where raw access is allowed."""

from difflib import get_close_matches

from proto.sensors import CanFrame
from services.can.diagnostics.addresses import ANSWER_IDS
from services.can.errors import HeldBack, UnknownSignal
from services.can.profiles.dbc import pgn_of
from services.can.profiles.privacy import HELD_BACK, VIN_HELD_BACK, held_back, spells_vin
from services.can.tools.answers import MAX_ROWS, NS, FrameRow, Sample, Scalar, SignalNow, Snapshot, parse_id
from services.can.vehicle import Vehicle

VIN_GROUPS = frozenset({0xFEEC, 0xEB00})
"""Groups of SAE J1939 that may hold the identification number: itself, and the pieces of a long message."""


def frame_rows(
    vehicle: Vehicle, since_ns: int, arbitration_id: int | str | None = None, signal_name: str | None = None
) -> list[FrameRow]:
    """Frames of all buses, the newest 2000, oldest first; with the named signal or the first that may be told. A frame
    of which nothing may be told is left out. Raises ValueError, ProfileError for an unknown signal, HeldBack.
    """
    ids = None if arbitration_id is None else frozenset({parse_id(arbitration_id)})
    buses = tuple(vehicle.descriptions)
    if signal_name is not None:
        bus, of_signal = _place(vehicle, signal_name)
        buses, ids = (bus,), of_signal if ids is None else ids & of_signal
    if ids and not any(_may_be_told(vehicle, bus, each) for bus in buses for each in ids):
        raise HeldBack(f"{', '.join(f'0x{each:X}' for each in sorted(ids))}: no curated signal; raw_access is off")
    rows = [row for bus in buses for frame in vehicle.history.since(since_ns, ids, MAX_ROWS, bus)
            if (row := _row(vehicle, bus, frame, signal_name)) is not None]  # fmt: skip
    return sorted(rows, key=lambda row: row.timestamp)[-MAX_ROWS:]


def samples(vehicle: Vehicle, signal_name: str, since_ns: int) -> list[Sample]:
    """A signal's values in the history. Raises ProfileError for an unknown signal, HeldBack for one not curated."""
    bus, ids = _place(vehicle, signal_name)
    frames = vehicle.history.since(since_ns, ids, MAX_ROWS, bus)
    told = ((frame.stamp_ns / NS, _signals(vehicle, bus, frame).get(signal_name)) for frame in frames)
    return [Sample(timestamp=stamp_s, value=value) for stamp_s, value in told if value is not None]


def snapshot(vehicle: Vehicle, now_ns: int, started_ns: int) -> Snapshot:
    """The newest value of every signal heard that may be told."""
    signals: dict[str, SignalNow] = {}
    hidden: list[str] = []
    for bus, dbc in vehicle.descriptions.items():
        for frame in vehicle.history.latest(bus):
            message = dbc.find((frame.extended, frame.arbitration_id))
            age_s = round(max(0.0, (now_ns - frame.stamp_ns) / NS), 3)
            if message is not None and _held_back(vehicle, bus, frame) == VIN_HELD_BACK:
                hidden.append(message.name)
            for name, value in _signals(vehicle, bus, frame).items():
                unit = message.get_signal_by_name(name).unit or "" if message is not None else ""
                signals[name] = SignalNow(value=value, unit=unit, message=message.name if message else "", age_s=age_s)
    return Snapshot(
        signals=signals,
        frame_count=vehicle.history.seen,
        uptime_s=round((now_ns - started_ns) / NS, 3),
        malformed=vehicle.board.malformed,
        held_back=held_back(vehicle.privacy, hidden),
    )


def told_names(vehicle: Vehicle, bus: str, extended: bool, arbitration_id: int) -> frozenset[str]:
    """The signals of a described message that may be told; none of one that may spell the identification number."""
    message = vehicle.descriptions[bus].find((extended, arbitration_id))
    frame = CanFrame(stamp_ns=0, arbitration_id=arbitration_id, data=b"", extended=extended)
    if message is None or _held_back(vehicle, bus, frame) == VIN_HELD_BACK:
        return frozenset()
    if vehicle.privacy.raw_access:
        return frozenset(signal.name for signal in message.signals)
    return _curated(vehicle, bus, extended, arbitration_id)


def _row(vehicle: Vehicle, bus: str, frame: CanFrame, signal_name: str | None) -> FrameRow | None:
    signals, held_back = _signals(vehicle, bus, frame), _held_back(vehicle, bus, frame)
    if not signals and not vehicle.privacy.raw_access:
        return None
    name = signal_name if signal_name is not None else next(iter(signals), None)
    return FrameRow(
        timestamp=frame.stamp_ns / NS,
        arbitration_id=f"0x{frame.arbitration_id:X}",
        data=[] if held_back else list(frame.data),
        signal_name=name if name in signals else None,
        signal_value=signals.get(name) if name is not None else None,
        held_back=held_back,
    )


def _signals(vehicle: Vehicle, bus: str, frame: CanFrame) -> dict[str, Scalar]:
    """The signals of a frame that may be told."""
    found: dict[str, Scalar] = {}
    if frame.error or frame.remote or _held_back(vehicle, bus, frame) == VIN_HELD_BACK:
        return found
    dbc = vehicle.descriptions[bus]
    if (message := dbc.find((frame.extended, frame.arbitration_id))) is not None:
        found = dict(dbc.signals_in(message, frame.data))
    if vehicle.privacy.raw_access:
        return found
    allowed = _curated(vehicle, bus, frame.extended, frame.arbitration_id)
    return {name: value for name, value in found.items() if name in allowed}


def _held_back(vehicle: Vehicle, bus: str, frame: CanFrame) -> str | None:
    """Why a frame's bytes are not told; None where they are."""
    if not vehicle.privacy.raw_access:
        return HELD_BACK
    if vehicle.privacy.allow_vin:
        return None
    message = vehicle.descriptions[bus].find((frame.extended, frame.arbitration_id))
    group = pgn_of(frame.arbitration_id) if frame.extended else 0
    hides = frame.arbitration_id in ANSWER_IDS or group in VIN_GROUPS or (message is not None and spells_vin(message))
    return VIN_HELD_BACK if hides else None


def _curated(vehicle: Vehicle, bus: str, extended: bool, arbitration_id: int) -> frozenset[str]:
    message = vehicle.descriptions[bus].find((extended, arbitration_id))
    if message is None:
        return frozenset()
    return vehicle.curated[bus].get((bool(message.is_extended_frame), int(message.frame_id)), frozenset())


def _may_be_told(vehicle: Vehicle, bus: str, arbitration_id: int) -> bool:
    raw = vehicle.privacy.raw_access
    return raw or any(_curated(vehicle, bus, extended, arbitration_id) for extended in (False, True))


def _place(vehicle: Vehicle, signal_name: str) -> tuple[str, frozenset[int]]:
    """On which bus and under which ids a signal is heard; the curated one of several. Raises ProfileError, HeldBack."""
    for bus, messages in vehicle.curated.items():
        if ids := frozenset(key[1] for key, names in messages.items() if signal_name in names):
            return bus, ids
    for bus, dbc in vehicle.descriptions.items():
        if dbc.has_signal(signal_name):
            if not vehicle.privacy.raw_access:
                raise HeldBack(f"{signal_name} is no curated signal, and raw_access is off")
            return bus, frozenset({int(dbc.signal(signal_name)[0].frame_id)})
    raise UnknownSignal(signal_name[:80], _nearest_signal(vehicle, signal_name))


def _nearest_signal(vehicle: Vehicle, signal_name: str) -> str:
    """Names of signals that may be told, nearest first; the tool that lists them where none is near."""
    curated = {name for messages in vehicle.curated.values() for names in messages.values() for name in names}
    all_names = {name for dbc in vehicle.descriptions.values() for name in dbc.signal_names()}
    known = all_names if vehicle.privacy.raw_access else curated
    by_folded = {name.replace("_", "").casefold(): name for name in known}
    near = get_close_matches(signal_name[:80].replace("_", "").casefold(), by_folded, 3, 0.5)
    names = ", ".join(by_folded[each] for each in near)
    return f"write one of {names}" if names else "take a name that get_vehicle_snapshot lists"
