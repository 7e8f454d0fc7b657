"""Which buses there are, by configuration: a carried one, an adapter, or a recording; and what opens each."""

from collections.abc import Iterable, Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import can
import msgspec

from drivemcp.errors import ConfigError, UserError
from drivemcp.files.can_logs.log import CanLog, check_channel, check_log
from services.can.buses.link import FrameLink, NodeLink, PythonCanLink
from services.can.buses.replay import Replay, ReplayLink, Step

if TYPE_CHECKING:
    from drivemcp.node import Node

CARRIED = "zenoh"
ArbitrationId = Annotated[int, msgspec.Meta(ge=0, lt=1 << 29, description="arbitration id")]
BitRate = Annotated[int, msgspec.Meta(gt=0, description="bit/s")]


class BusConfig(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """One bus of the car."""

    name: Annotated[str, msgspec.Meta(pattern=r"^[A-Za-z0-9_-]+$")] = "can0"
    """As the profile names it."""
    interface: str = CARRIED
    """`zenoh`: frames on can/<channel>/rx and tx. Else a python-can interface: socketcan, slcan, pcan, vector, ..."""
    channel: str | int = ""
    """Of the interface; empty: the name of the bus. Some adapters count their channels and want a number."""
    bitrate: BitRate | None = None
    """Bit rate of the interface, bit/s; unset: as the interface is set."""
    fd: bool = False
    """Whether the bus is CAN FD."""
    data_bitrate: BitRate | None = None
    """Bit rate of the data phase of CAN FD, bit/s."""
    options: dict[str, str | int | float | bool] = msgspec.field(default_factory=dict)
    """What else the interface takes, by python-can's names."""
    recording: str = ""
    """Instead of an interface a log file: .asc, .blf, .csv, .log (candump), .mf4, .trc. `channel` then picks one of
    several in the log, as python-can counts them, and may be left empty where the log has one.
    """
    speed: Annotated[float, msgspec.Meta(gt=0.0, le=1000.0)] = 1.0
    """Of the replay; 2 is twice as fast. The clock of the service sets the pace."""
    loop: bool = False
    """A recording begins again at its end."""
    step_frames: Annotated[int, msgspec.Meta(ge=0)] = 0
    """Recorded frames at each lockstep step or call of `step_recording`; 0: by `step_ms`."""
    step_ms: Annotated[float, msgspec.Meta(ge=0.0)] = 0.0
    """Not paced but stepped: so many frames, or so much recorded time, at each lockstep step or call of
    step_recording.
    """

    transmit: bool = True
    """Whether anything may be sent on it: requests to control units and flow control. Changing services take more."""
    transmit_ids: tuple[ArbitrationId, ...] = ()
    """Only these ids may be sent on; empty: every id of a diagnostic request."""

    @property
    def carried(self) -> bool:
        """Whether topics carry the frames, as those of a simulated car."""
        return self.interface == CARRIED and not self.recording

    @property
    def port(self) -> str | int:
        """The channel of the interface."""
        return self.name if self.channel == "" else self.channel


def check_buses(buses: Sequence[BusConfig], known: Iterable[str]) -> None:
    """That each bus has its own name, and one that the profile knows. Raises ConfigError naming the field."""
    names = [bus.name for bus in buses]
    if not buses:
        raise ConfigError("buses: the list is empty; name at least one bus")
    for number, name in enumerate(names):
        if name in names[:number]:
            raise ConfigError(f"buses[{number}].name: there are two buses named {name!r}")
    described = sorted(known)
    for number, name in enumerate(names):
        if described and name not in described:
            raise ConfigError(f"buses[{number}].name: the profile has no bus {name!r}; it has {', '.join(described)}")


def open_links(buses: Sequence[BusConfig], node: "Node") -> dict[str, FrameLink]:
    """The way to each bus, by its name. Raises ConfigError naming the bus that cannot be opened."""
    return {bus.name: _link(bus, f"buses[{number}]", node) for number, bus in enumerate(buses)}


def _link(bus: BusConfig, place: str, node: "Node") -> FrameLink:
    if bus.recording:
        return _replay(bus, place, node)
    if bus.carried:
        return NodeLink(node, str(bus.port))
    if node.lockstep and bus.interface != "virtual":
        raise ConfigError(f"{place}.interface: lockstep is for simulation; {bus.interface} is a real car's bus")
    return PythonCanLink(partial(_open, bus, place), node)


def _replay(bus: BusConfig, place: str, node: "Node") -> ReplayLink:
    if bus.interface != CARRIED:
        raise ConfigError(f"{place}: name an interface or a recording, not both")
    if bus.step_frames and bus.step_ms:
        raise ConfigError(f"{place}: name step_frames or step_ms, not both")
    path = Path(bus.recording)
    try:
        check_log(path, f"{place}.recording")
        check_channel(path, str(bus.channel), f"{place}.channel")
    except UserError as error:
        raise ConfigError(str(error)) from None
    step = Step(frames=bus.step_frames, ms=bus.step_ms) if bus.step_frames or bus.step_ms else None
    replay = Replay(CanLog(path, str(bus.channel)), speed=bus.speed, loop=bus.loop)
    if replay.ended:
        raise ConfigError(f"{place}.recording: {path.name} holds no frame to replay; {replay.log.nothing}")
    return ReplayLink(replay, step, node)


def _open(bus: BusConfig, place: str) -> Any:
    """python-can's bus. What drivers raise where adapter, library or option is missing is told in one line."""
    if bus.interface not in can.interfaces.BACKENDS:
        known = ", ".join(sorted(can.interfaces.BACKENDS))
        raise ConfigError(f"{place}.interface: python-can knows no {bus.interface!r}; there are {known}")
    try:
        return can.Bus(channel=bus.port, interface=bus.interface, ignore_config=True, **_arguments(bus))
    except (can.CanError, OSError, ValueError, TypeError, ImportError, AttributeError) as error:
        reason = " ".join(str(error).split())
        raise ConfigError(f"{place}: cannot open {bus.interface} {bus.port}: {reason}") from error


def _arguments(bus: BusConfig) -> dict[str, Any]:
    given = {"bitrate": bus.bitrate, "fd": bus.fd or None, "data_bitrate": bus.data_bitrate}
    return {name: value for name, value in given.items() if value is not None} | bus.options
