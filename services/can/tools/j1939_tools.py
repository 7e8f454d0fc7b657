"""The J1939 tools of the MCP-CAN catalogue."""

from collections.abc import Callable, Mapping
from typing import Annotated, NamedTuple

import msgspec

from drivemcp.errors import ToolFailed
from drivemcp.files.bus_description import Key, key_of
from drivemcp.node import Node
from services.can.errors import MalformedFrame, RequestRefused
from services.can.j1939 import messages
from services.can.j1939.bus import Heard, J1939Bus
from services.can.j1939.messages import SpnFault
from services.can.j1939.transport import Group
from services.can.profiles.dbc import Dbc
from services.can.profiles.privacy import Privacy
from services.can.tools import answers
from services.can.tools.answers import FrameId, Scalar
from services.can.tools.diagnostic_tools import Byte, Timeout
from services.can.vehicle import Vehicle

NS = 1_000_000_000
DEADLINE_MS = 11_000.0
"""The longest wait for the line and for an answer, and a second."""

Seconds = Annotated[
    float, msgspec.Meta(gt=0.0, le=600.0, description="length of the window that ends now, s", examples=[3.0])
]
BusName = Annotated[
    str, msgspec.Meta(description="a J1939 bus of the vehicle profile; without: the first", examples=["truck"])
]
Pgn = Annotated[int, msgspec.Meta(ge=0, le=0x3FFFF, description="parameter group number", examples=[65262])]
Payload = Annotated[
    list[Byte], msgspec.Meta(max_length=1785, description="bytes of the message, as numbers", examples=[[255, 12, 0]])
]


class J1939Frame(msgspec.Struct, frozen=True, kw_only=True, omit_defaults=True):
    """`status`: ok or error. `destination` 255: all units. `signals` where the bus's description has the group."""

    status: str
    pgn: int | None = None
    priority: int | None = None
    source: int | None = None
    destination: int | None = None
    name: str | None = None
    signals: dict[str, Scalar] | None = None
    message: str | None = None


class PgnRow(msgspec.Struct, frozen=True, kw_only=True, omit_defaults=True):
    """A group as it was heard: from whom, how often since the start, how long ago, how many bytes."""

    pgn: int
    sources: list[int]
    count: int
    age_s: float
    length: int
    name: str | None = None


class GroupAnswer(msgspec.Struct, frozen=True, kw_only=True, omit_defaults=True):
    """One unit's answer: the group, or why it does not give it. `data` is empty without raw access."""

    source: int
    data: list[int]
    signals: dict[str, Scalar] | None = None
    vin: str | None = None
    refusal: str | None = None


class PgnAnswer(msgspec.Struct, frozen=True, kw_only=True, omit_defaults=True):
    """`status`: ok, refused or timeout."""

    status: str
    pgn: int
    responses: list[GroupAnswer]
    message: str | None = None


class UnitFaults(msgspec.Struct, frozen=True, kw_only=True):
    """What one unit broadcast last: lamps (off, on, error, not available) and active faults."""

    source: int
    age_s: float
    lamps: dict[str, str]
    flashing: tuple[str, ...]
    faults: tuple[SpnFault, ...]


class FaultReport(msgspec.Struct, frozen=True, kw_only=True, omit_defaults=True):
    """Active faults by unit. `heard_s`: how much of the window the service has listened; a unit that is silent says
    nothing.
    """

    units: list[UnitFaults]
    heard_s: float
    malformed: int = 0


class _Bus(NamedTuple):
    """A J1939 bus, and what of it may be told."""

    name: str
    heard: J1939Bus
    dbc: Dbc
    curated: Mapping[Key, frozenset[str]]
    privacy: Privacy


def offer(node: Node, vehicle: Vehicle, buses: Mapping[str, J1939Bus]) -> None:
    """Add them to the node."""
    started_ns = node.clock.now_ns()

    def on(bus: str) -> _Bus:
        name = bus or next(iter(buses), "")
        if name not in buses:
            known = (
                f"take one of {', '.join(buses)}"
                if buses
                else 'set protocol = "j1939" for a bus in the vehicle profile'
            )
            raise ToolFailed(f"no J1939 bus {name[:40]!r}", field="bus", do=known)
        return _Bus(name, buses[name], vehicle.descriptions[name], vehicle.curated[name], vehicle.privacy)

    @node.tool(deadline_ms=40)
    def decode_j1939_frame(arbitration_id: FrameId, data: Payload, bus: BusName = "") -> J1939Frame:
        """What a 29-bit id says by J1939, and the group's signals by the bus's description."""
        return _decoded(on(bus).dbc, arbitration_id, bytes(data))

    @node.tool(deadline_ms=100)
    def list_j1939_pgns(bus: BusName = "") -> list[PgnRow]:
        """The parameter groups heard on the bus since the start, messages sent in pieces too."""
        where = on(bus)
        return _rows(where.heard.heard(), where.dbc, node.clock.now_ns())

    @node.tool(deadline_ms=DEADLINE_MS, capability="diagnostic", read_only=True)
    def request_j1939_pgn(pgn: Pgn, timeout_s: Timeout = 2.0, bus: BusName = "") -> PgnAnswer:
        """Ask every unit for a parameter group (59904). Groups that clear, and the makers' own, are refused. Without raw
        access only curated signals are told; the identification number is told hashed, unless allowed.
        """
        return _asked(on(bus), pgn, timeout_s, node.clock.now_ns)

    @node.tool(deadline_ms=100)
    def read_j1939_dtcs(duration_s: Seconds = 3.0, bus: BusName = "") -> FaultReport:
        """Active faults (DM1) and lamps that units broadcast in the last seconds, at once. Sends nothing."""
        now_ns = node.clock.now_ns()
        return _faults(on(bus).heard.heard(), now_ns, duration_s, min(duration_s, (now_ns - started_ns) / NS))


def _decoded(dbc: Dbc, arbitration_id: int | str, data: bytes) -> J1939Frame:
    try:
        number = answers.parse_id(arbitration_id)
    except ValueError as error:
        return J1939Frame(status="error", message=str(error))
    head = messages.header(number)
    return J1939Frame(status="ok", name=_name(dbc, number), signals=_signals(dbc, number, data), **head._asdict())


def _rows(heard: list[Heard], dbc: Dbc, now_ns: int) -> list[PgnRow]:
    by_pgn: dict[int, list[Heard]] = {}
    for each in heard:
        by_pgn.setdefault(each.group.header.pgn, []).append(each)
    return [_row(pgn, each, dbc, now_ns) for pgn, each in sorted(by_pgn.items())]


def _row(pgn: int, heard: list[Heard], dbc: Dbc, now_ns: int) -> PgnRow:
    newest = max((each.group for each in heard), key=lambda group: group.stamp_ns)
    return PgnRow(
        pgn=pgn,
        sources=sorted(each.group.header.source for each in heard),
        count=sum(each.count for each in heard),
        age_s=_age_s(newest, now_ns),
        length=len(newest.data),
        name=_name(dbc, messages.id_of(pgn, newest.header.source)),
    )


def _asked(bus: _Bus, pgn: int, timeout_s: float, clock: Callable[[], int]) -> PgnAnswer:
    try:
        found = bus.heard.ask(pgn, timeout_s, clock)
    except RequestRefused as error:
        return PgnAnswer(status="refused", pgn=pgn, responses=[], message=str(error))
    except TimeoutError as error:
        return PgnAnswer(status="timeout", pgn=pgn, responses=[], message=str(error))
    if not found:
        return PgnAnswer(status="timeout", pgn=pgn, responses=[], message=f"no unit answered within {timeout_s:g} s")
    responses = [_answer(group, bus) for group in {each.header.source: each for each in found}.values()]
    given = any(each.refusal is None for each in responses)
    return PgnAnswer(status="ok" if given else "refused", pgn=pgn, responses=responses)


def _answer(group: Group, bus: _Bus) -> GroupAnswer:
    source, data = group.header.source, list(group.data)
    if group.header.pgn == messages.ACKNOWLEDGEMENT:
        return GroupAnswer(source=source, data=data, refusal=messages.ANSWERS.get(data[0]) if any(data[:1]) else None)
    if group.header.pgn == messages.VEHICLE_IDENTIFICATION:
        text = group.data.split(b"*")[0].decode("ascii", "replace")
        return GroupAnswer(source=source, data=data if bus.privacy.allow_vin else [], vin=bus.privacy.vin(text))
    return GroupAnswer(source=source, data=data if bus.privacy.raw_access else [], signals=_told(group, bus))


def _told(group: Group, bus: _Bus) -> dict[str, Scalar] | None:
    """The group's signals; without raw access the curated ones."""
    head = group.header
    arbitration_id = messages.id_of(head.pgn, head.source, head.destination, head.priority)
    signals, message = _signals(bus.dbc, arbitration_id, group.data), bus.dbc.find((True, arbitration_id))
    if signals is None or message is None or bus.privacy.raw_access:
        return signals
    curated = bus.curated.get(key_of(message), frozenset())
    return {name: value for name, value in signals.items() if name in curated}


def _faults(heard: list[Heard], now_ns: int, duration_s: float, heard_s: float) -> FaultReport:
    units: list[UnitFaults] = []
    malformed = 0
    for group in (each.group for each in heard if each.group.header.pgn == messages.DM1):
        if (age_s := _age_s(group, now_ns)) > duration_s:
            continue
        try:
            told = messages.dm1(group.data)
        except MalformedFrame:
            malformed += 1
            continue
        units.append(
            UnitFaults(
                source=group.header.source, age_s=age_s, lamps=told.lamps, flashing=told.flashing, faults=told.faults
            )
        )
    return FaultReport(
        units=sorted(units, key=lambda unit: unit.source), heard_s=round(heard_s, 3), malformed=malformed
    )


def _age_s(group: Group, now_ns: int) -> float:
    return round(max(0.0, (now_ns - group.stamp_ns) / NS), 3)


def _name(dbc: Dbc, arbitration_id: int) -> str | None:
    message = dbc.find((True, arbitration_id))
    return None if message is None else str(message.name)


def _signals(dbc: Dbc, arbitration_id: int, data: bytes) -> dict[str, Scalar] | None:
    message = dbc.find((True, arbitration_id))
    return None if message is None else dict(dbc.signals_in(message, data))
