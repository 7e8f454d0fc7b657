"""The CAN service: binds one car's buses to topics and tools; decides nothing."""

from collections.abc import Callable, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Annotated, TypeVar

import msgspec

from drivemcp.config import ServiceConfig
from drivemcp.errors import ConfigError, ToolFailed
from drivemcp.node import Node
from drivemcp.paths import data
from drivemcp.service import Service
from proto import topics
from proto.sensors import CanFrame
from proto.vehicle import DtcText, VehicleHealth
from services.can.buses import replay
from services.can.buses.guarded import GuardedLink, Rule, TransmitPolicy
from services.can.buses.link import FrameLink
from services.can.buses.opening import BusConfig, check_buses, open_links
from services.can.diagnostics import gate
from services.can.diagnostics.addresses import is_extended
from services.can.diagnostics.client import Refused
from services.can.diagnostics.trouble_codes import DtcBook
from services.can.errors import HeldBack, ProfileError, UnknownSignal
from services.can.health import degradation
from services.can.j1939.bus import J1939Bus
from services.can.profiles.dbc import Dbc
from services.can.profiles.privacy import Privacy, installation_salt
from services.can.profiles.profile import Profile, find_descriptions, load_profile
from services.can.recorded import log_tools
from services.can.tools import answers, diagnostic_tools, disclosure, j1939_tools, transmit_tools, uds_tools
from services.can.tools.answers import CodeReport, DecodedFrame, FrameBytes, FrameId, FrameRow, Sample, Snapshot
from services.can.vehicle import Vehicle

NS = 1_000_000_000
R = TypeVar("R")

Seconds = Annotated[
    float, msgspec.Meta(ge=0.0, le=600.0, description="length of the window that ends now, s", examples=[2.0])
]
Language = Annotated[
    str, msgspec.Meta(description="en, de, fr, nl, pl, it or es (summaries: en or de)", examples=["de"])
]
SignalName = Annotated[
    str,
    msgspec.Meta(
        description="signal of the bus description; get_vehicle_snapshot lists them", examples=["VehicleSpeed"]
    ),
]
Trouble = Annotated[str, msgspec.Meta(description="trouble code", examples=["P0301"])]


class CanConfig(ServiceConfig, frozen=True, kw_only=True):
    """Which buses, which car, and what may be sent."""

    profile: str = "vehicles/sim/profile.toml"
    """The car's profile."""
    description_folders: tuple[str, ...] = ()
    """Where bus descriptions lie that are not beside the profile."""
    buses: tuple[BusConfig, ...] = (BusConfig(),)
    diagnostics_bus: str = ""
    """Where the control units are asked. Empty: on the first bus."""
    ego_hz: float = 20.0
    """How often `ego` is published."""
    degradation_hz: float = 2.0
    """How often `can/degradation` is published."""
    history_mb: Annotated[float, msgspec.Meta(gt=0.0, le=1024.0)] = 16.0
    """Set aside for the last frames of each bus: 78 bytes a frame, so 51 s of a full bus of 4000 frames a second."""
    poll_dtcs_s: float | None = None
    """How often trouble codes are asked for. Unset: every 4 s in simulation, never on a real bus, where nothing is
    sent unasked.
    """
    allow_fault_scenarios: bool = False
    """Whether `activate_fault_scenario` may give the simulated car faults."""
    raw_access: bool | None = None
    """Whether tools tell raw bytes and signals that are not curated. Unset: of our simulated car alone."""
    allow_vin: bool = False
    """Whether the vehicle's identification number is told; else its hash."""
    log_folder: str = ""
    """Where recorded logs lie that tools may list and read. Empty: none."""
    vin_salt_file: str = ""
    """Where the salt of that hash is kept, made at the first start. Empty: a new salt, so another hash, at every start."""


def build(config: CanConfig, node: Node) -> None:
    """Wire one car."""

    def send(bus: str, arbitration_id: int, payload: bytes) -> None:
        frame = CanFrame(
            stamp_ns=node.clock.now_ns(),
            arbitration_id=arbitration_id,
            data=payload,
            extended=is_extended(arbitration_id),
        )
        links[bus].transmit((frame,))

    def refused(bus: str, arbitration_id: int, payload: bytes, reason: str) -> None:
        links[bus].note(arbitration_id, payload, is_extended(arbitration_id), reason)

    vehicle = _vehicle(config, lambda *frame: send(asked.name, *frame), lambda *why: refused(asked.name, *why))
    check_buses(config.buses, vehicle.profile.buses)
    asked = _asked(config)
    opened = open_links(config.buses, node)
    links = {bus.name: _guarded(opened[bus.name], bus, config, node) for bus in config.buses}
    groups = {bus: J1939Bus(partial(send, bus), partial(refused, bus)) for bus in links if _speaks_j1939(vehicle, bus)}
    j1939_tools.offer(node, vehicle, groups)
    replay.offer(node, opened)
    transmit_tools.offer(node, links, asked.name)
    log_tools.offer(node, vehicle, config.log_folder)
    _offer_reading(node, vehicle)
    _offer_health(node, vehicle)
    uds_tools.offer(node, vehicle)
    diagnostic_tools.offer(node, vehicle, fault_scenarios=config.allow_fault_scenarios and asked.carried)
    _publish(config, node, vehicle, links, groups)


def _guarded(link: FrameLink, bus: BusConfig, config: CanConfig, node: Node) -> GuardedLink:
    """The bus behind what may leave on it."""
    policy = TransmitPolicy(
        bus=bus.name,
        interface="recording" if bus.recording else bus.interface,
        transmit_allowed=bus.transmit and not bus.recording,
        write_services_allowed=bus.transmit
        and not bus.recording
        and bool(config.trusted_keys or config.trusted_keys_file),
        allowlist=tuple(f"0x{each:X}" for each in bus.transmit_ids) or gate.SENDABLE,
    )
    rule = Rule(check=gate.check_at_bus, purpose=gate.purpose, writes=gate.writes)
    ids = frozenset(bus.transmit_ids)
    return GuardedLink(link, policy, rule, transmit=bus.transmit, ids=ids, clock=node.clock.now_ns)


def _speaks_j1939(vehicle: Vehicle, bus: str) -> bool:
    """Whether the profile says so, or the description of one of its messages."""
    dbc = vehicle.descriptions[bus]
    return vehicle.profile.buses[bus].protocol == "j1939" or any(map(dbc.is_j1939, dbc.messages.values()))


def _asked(config: CanConfig) -> BusConfig:
    """The bus on which control units are asked."""
    name = config.diagnostics_bus
    asked = next((bus for bus in config.buses if not name or bus.name == name), None)
    if asked is None:
        names = ", ".join(bus.name for bus in config.buses)
        raise ConfigError(f"diagnostics_bus: there is no bus {name!r}; there are {names}")
    return asked


def _vehicle(config: CanConfig, send: Callable[[int, bytes], None], refused: Refused) -> Vehicle:
    path = data(config.profile)
    try:
        profile = load_profile(path)
        folders = tuple(map(Path, config.description_folders))
        files = find_descriptions(profile, path, folders)
        descriptions = {
            bus: Dbc(*files[bus], strict=rule.strict, protocol=rule.protocol) for bus, rule in profile.buses.items()
        }
        return Vehicle(
            descriptions,
            profile,
            DtcBook.load(data("vehicles/dtc.toml")),
            send,
            history_mb=config.history_mb,
            diagnostics_bus=config.diagnostics_bus or "".join(bus.name for bus in config.buses[:1]),
            privacy=_privacy(config, profile),
            refused=refused,
        )
    except ProfileError as error:
        raise ConfigError(str(error)) from error


def _privacy(config: CanConfig, profile: Profile) -> Privacy:
    simulated = bool(profile.fault_scenarios) and all(bus.carried for bus in config.buses)
    return Privacy(
        salt=installation_salt(Path(config.vin_salt_file) if config.vin_salt_file else None),
        raw_access=simulated if config.raw_access is None else config.raw_access,
        allow_vin=config.allow_vin,
    )


class _Publisher:
    """Puts frames into the vehicle and tells what comes of them."""

    def __init__(self, node: Node, vehicle: Vehicle, groups: Mapping[str, J1939Bus], ego_hz: float) -> None:
        self._node, self._vehicle, self._groups = node, vehicle, groups
        self._pace = _Pace(ego_hz)

    def on_frames(self, bus: str, frames: Sequence[CanFrame]) -> None:
        """Frames of a bus; the ego follows them, as fresh as the bus allows."""
        now_ns = self._node.clock.now_ns()
        self._vehicle.ingest(frames, now_ns, bus)
        if bus in self._groups:
            self._vehicle.board.ingest(self._groups[bus].feed(frames), now_ns, bus)
        self._ego(now_ns, 0.8)

    def watch(self) -> None:
        """A silent bus is news too."""
        self._ego(self._node.clock.now_ns(), 1.3)

    def degradation(self, links: Mapping[str, GuardedLink], poll_s: float) -> None:
        """The health of the car, and how its buses are."""
        now_ns, vehicle = self._node.clock.now_ns(), self._vehicle
        self._node.publish(topics.DEGRADATION, vehicle.degradation(now_ns))
        pieces = sum(group.malformed for group in self._groups.values())
        self._node.detail.update({f"bus {name}": link.state for name, link in links.items()})
        self._node.detail["frames"] = str(vehicle.history.seen)
        self._node.detail["malformed_frames"] = str(vehicle.board.malformed + vehicle.diagnostics.malformed + pieces)
        if poll_s > 0:
            vehicle.poll(now_ns, int(poll_s * NS))

    def _ego(self, now_ns: int, share: float) -> None:
        if self._pace.due(now_ns, share):
            stamp_ns = _stamp(self._vehicle, now_ns)
            self._node.publish(topics.EGO, self._vehicle.ego(now_ns), stamp_ns=stamp_ns)


def _publish(
    config: CanConfig, node: Node, vehicle: Vehicle, links: Mapping[str, GuardedLink], groups: Mapping[str, J1939Bus]
) -> None:
    poll_s = config.poll_dtcs_s if config.poll_dtcs_s is not None else (4.0 if _asked(config).carried else 0.0)
    publisher = _Publisher(node, vehicle, groups, config.ego_hz)
    node.every(1.0 / config.ego_hz, publisher.watch)
    node.every(1.0 / config.degradation_hz, lambda: publisher.degradation(links, poll_s))
    for name, link in links.items():
        link.listen(partial(publisher.on_frames, name))


class _Pace:
    """Keeps a rate, by the clock it is shown."""

    def __init__(self, rate_hz: float) -> None:
        self._period_ns = NS / rate_hz
        self._last_ns = 0

    def due(self, now_ns: int, share: float) -> bool:
        """Whether this share of a period has passed since the last time that it had."""
        if 0 <= now_ns - self._last_ns < share * self._period_ns:
            return False
        self._last_ns = now_ns
        return True


def _stamp(vehicle: Vehicle, now_ns: int) -> int:
    """The source's stamp of the speed, where it may be used; an ego without one is stamped now and says what is
    invalid.
    """
    reading = vehicle.board.read("speed_mps", now_ns)
    return reading.stamp_ns if reading.value is not None else now_ns


def _or_failed(function: Callable[[], R]) -> R:
    """An unknown name, a bad number or something held back is the caller's to mend."""
    try:
        return function()
    except UnknownSignal as error:
        raise ToolFailed(str(error), field="signal_name", do=error.do) from error
    except HeldBack as error:
        raise ToolFailed(str(error), do="take a curated signal, or allow raw_access in the vehicle profile") from error
    except (ProfileError, ValueError) as error:
        raise ToolFailed(str(error)) from error


def _offer_reading(node: Node, vehicle: Vehicle) -> None:
    started_ns = node.clock.now_ns()

    @node.tool(deadline_ms=200)
    def read_can_frames(duration_s: Seconds = 1.0) -> list[FrameRow]:
        """Frames heard in the last seconds, from the history, at once; at most the newest 2000. Without raw access only
        those with a curated signal, that signal's value, and no bytes.
        """
        since_ns = answers.window_ns(duration_s, node.clock.now_ns())
        return disclosure.frame_rows(vehicle, since_ns)

    @node.tool(deadline_ms=40)
    def decode_can_frame(arbitration_id: FrameId, data: FrameBytes) -> DecodedFrame:
        """Decode one frame by the car's bus description: id as a number or as hex text, data as bytes."""
        return answers.decoded(vehicle.descriptions.values(), arbitration_id, data)

    @node.tool(deadline_ms=200)
    def filter_frames(
        arbitration_id: FrameId | None = None, signal_name: SignalName | None = None, duration_s: Seconds = 1.0
    ) -> list[FrameRow]:
        """Frames heard in the last seconds with this id, or carrying this signal, with the signal's value."""
        since_ns = answers.window_ns(duration_s, node.clock.now_ns())
        return _or_failed(lambda: disclosure.frame_rows(vehicle, since_ns, arbitration_id, signal_name))

    @node.tool(deadline_ms=200)
    def monitor_signal(signal_name: SignalName, duration_s: Seconds = 2.0) -> list[Sample]:
        """The values of one signal over the last seconds, from the history, at once."""
        since_ns = answers.window_ns(duration_s, node.clock.now_ns())
        return _or_failed(lambda: disclosure.samples(vehicle, signal_name, since_ns))

    @node.tool(deadline_ms=100)
    def get_vehicle_snapshot() -> Snapshot:
        """The newest value, unit, message and age of every signal heard; without raw access of the curated ones."""
        return disclosure.snapshot(vehicle, node.clock.now_ns(), started_ns)


def _offer_health(node: Node, vehicle: Vehicle) -> None:
    @node.tool(deadline_ms=40)
    def read_dtcs(language: Language = "en") -> CodeReport:
        """The trouble codes that the control units last reported, in words, with the warning lamps. Sends nothing."""
        return answers.code_report(vehicle, language, node.clock.now_ns())

    @node.tool(deadline_ms=40)
    def explain_dtc(code: Trouble, language: Language = "en") -> DtcText:
        """A trouble code in words: system, severity, what it means, what to do next."""
        return _or_failed(lambda: vehicle.book.explain(code, language))

    @node.tool(deadline_ms=40)
    def vehicle_health(language: Language = "en") -> VehicleHealth:
        """Is the car fit to drive: degradation h, braking still to be had, faults, lamps, and advice."""
        return degradation.advise(vehicle.table, vehicle.assessment, vehicle.book, language)


SERVICE = Service("can", CanConfig, build)
