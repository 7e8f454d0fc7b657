"""The simulator service: drives a scenario on the bus; decides nothing."""

import math
import threading
from collections.abc import Callable
from pathlib import Path
from typing import Annotated, Any

import msgspec

from drivemcp.bus.received import Received
from drivemcp.config import ServiceConfig
from drivemcp.errors import ConfigError, LockstepError, ToolFailed
from drivemcp.node import Node
from drivemcp.paths import data
from drivemcp.service import Service
from proto import topics
from proto.decision import BrakeCommand
from proto.truth import ScenarioState
from services.simulator.car.command_order import CommandOrder
from services.simulator.driver.kinds import DriverKind
from services.simulator.lockstep import EPOCH_NS, Conductor
from services.simulator.realtime import RealTime
from services.simulator.scenario.load import ScenarioError, load_scenario, read_fault
from services.simulator.scenario.plan import Scenario
from services.simulator.sensors.camera_process import Studio, StudioError
from services.simulator.session import CAMERAS, Outgoing, SensorSet, Session

STATE_PERIOD_S = 0.5
LONGEST_S = 3600.0
BROKE_OFF = "the drive broke off; the service's log says why"
NEVER_BEGAN = "the drive could not begin; the service's log says why"


class SimulatorConfig(ServiceConfig, frozen=True, kw_only=True):
    """What to drive, and which sensors the car has."""

    scenario: str = "urb-rain"
    """The name of a shipped scenario, or the path of a TOML or JSON file."""
    seed: int = 1
    """Varies traffic, looks and noise."""
    driver: DriverKind = "drawn"
    """`drawn`: the driver of the seed; `absent`: a driver that does nothing; others: see `driver/kinds.py`."""
    brakes_until_s: float | None = None
    """From this second on no braking command reaches the car, for what the driver does without them; unset: all do."""
    seconds: float | None = None
    """How long; unset: what the scenario says; 0: to the end of the route."""
    autostart: bool = True
    """The drive begins with the service; else at the call of `start_scenario`."""
    again: bool = False
    """Where a drive comes to its end, another begins with the next seed, until it is stopped. Not in lockstep."""
    cameras: tuple[str, ...] = ("front", "tele")
    """Cameras that are drawn, of `front` and `tele`."""
    lidar: bool = True
    """LiDAR sweeps are published."""
    lidar_at_crossings: bool = False
    """Without `lidar`, sweeps while a vehicle near by drives across the ego's way: for runs whose other sensors are modelled."""
    gnss: bool = True
    """Positions are published."""
    map: bool = True
    """The map around the car is published."""
    weather: bool = True
    """Rain, temperature and light are published."""
    can: bool = True
    """CAN frames are published."""
    can_bus: str = "can0"
    """Name of that bus."""
    dbc: str = "vehicles/sim/sim.dbc"
    """Bus description of the simulated car."""
    faults: tuple[str, ...] = ()
    """Faults of the car beside the scenario's own: PRESET@SECONDS or PRESET:SEVERITY@SECONDS."""
    ahead_ms: float = 200.0
    """How much earlier than its instant a step is computed: long enough to draw its pictures. Not in lockstep."""
    stale_ms: float = 150.0
    """What sensors measured longer ago than this is dropped; only state goes out late. Not in lockstep."""
    camera_niceness: int = 0
    """How far the process that draws stands back for the others."""


class Simulator:
    """One node's drives, one after another."""

    def __init__(self, config: SimulatorConfig, node: Node) -> None:
        unknown = sorted(set(config.cameras) - set(CAMERAS))
        if unknown:
            raise ConfigError(f"cameras: there is no camera {unknown[0]!r}; there are {', '.join(CAMERAS)}")
        self._config, self._node, self._lock = config, node, threading.Lock()
        self._studio: Studio | None = None
        self._drive: RealTime | Conductor | None = None
        self._starting: threading.Thread | None = None
        self._stop = threading.Event()
        self._wanted = 0
        self._driven: tuple[Scenario, int, float] | None = None
        self.problem = ""
        try:
            self._faults = tuple(map(read_fault, config.faults))
        except ValueError as error:
            raise ConfigError(f"faults: {error}") from error

    # Starting and stopping ----------------------------------------------------------------------------------------------

    def begin(self, scenario: Scenario, seed: int, seconds: float) -> None:
        """Start a drive on a thread of its own, because the first picture takes seconds; an earlier drive ends."""
        with self._lock:
            self._halt()
            self._stop.clear()
            self.problem = ""
            self._driven = scenario, seed, seconds
            self._wanted += 1
            wanted = self._wanted
            drive = (scenario, seed, seconds, wanted)
            self._starting = threading.Thread(
                target=self._prepare, args=(*drive, self._starting), name="simulator-start", daemon=True
            )
            self._starting.start()

    def _prepare(
        self, scenario: Scenario, seed: int, seconds: float, wanted: int, before: threading.Thread | None
    ) -> None:
        if before is not None:
            before.join()  # one thread at a time speaks to the cameras
        try:
            self._set_off(scenario, seed, seconds, wanted)
        except StudioError as error:
            self._node.log.error("no pictures: %s", error)
            self._give_up(wanted, str(error))
        except Exception:  # whatever it is, a caller that waits for the drive is told that none comes
            self._node.log.exception("the drive cannot begin")
            self._give_up(wanted, NEVER_BEGAN)

    def _give_up(self, wanted: int, why: str) -> None:
        with self._lock:
            if wanted != self._wanted:
                return  # another drive was asked for since
            self._drive, self.problem = None, why
        self._node.run_soon(self.report)  # at once: in lockstep no timer fires before the first step

    def _set_off(self, scenario: Scenario, seed: int, seconds: float, wanted: int) -> None:
        session = self._session(scenario, seed, seconds)
        studio = self._open_studio(session, seed)
        with self._lock:
            if wanted != self._wanted or self._stop.is_set():
                return
            if self._node.lockstep:
                self._drive = Conductor(session, studio, self._publish, self._conduct)
                self._node.run_soon(self._step)
            else:
                drive = RealTime(
                    session,
                    studio,
                    self._publish,
                    self._node.clock.now_ns,
                    ahead_ns=round(self._config.ahead_ms * 1e6),
                    stale_ns=round(self._config.stale_ms * 1e6),
                )
                drive.start()
                self._drive = drive  # once it lives: `report` takes one that does not for one that broke off
            self._node.log.info("driving %s, seed %d, %.0f s", scenario.name, seed, session.seconds)

    def _session(self, scenario: Scenario, seed: int, seconds: float) -> Session:
        config = self._config
        present = SensorSet(
            cameras=config.cameras,
            lidar=config.lidar,
            gnss=config.gnss,
            map=config.map,
            weather=config.weather,
            can=config.can,
            lidar_at_crossings=config.lidar_at_crossings,
        )
        return Session(
            msgspec.structs.replace(scenario, faults=(*scenario.faults, *self._faults)),
            seed,
            seconds=seconds,
            epoch_ns=EPOCH_NS,
            dbc=data(config.dbc),
            bus=config.can_bus,
            present=present,
            lockstep=config.lockstep,
            driver=config.driver,
            brakes_until_s=math.inf if config.brakes_until_s is None else config.brakes_until_s,
        )

    def _open_studio(self, session: Session, seed: int) -> Studio | None:
        if not self._config.cameras:
            return None
        if self._studio is None:
            cameras = [CAMERAS[name] for name in self._config.cameras]
            self._studio = Studio(cameras, seed, self._config.camera_niceness)
        self._studio.load(session.world.scene())
        return self._studio

    def halt(self) -> None:
        """End the drive, if there is one."""
        with self._lock:
            self._halt()

    def _halt(self) -> None:
        self._stop.set()
        self._wanted += 1
        drive, self._drive = self._drive, None
        if isinstance(drive, RealTime):
            drive.stop()

    def close(self) -> None:
        """End everything."""
        self.halt()
        if self._starting is not None:
            self._starting.join(10.0)
        if self._studio is not None:
            self._studio.close()
            self._studio = None

    # Lockstep -------------------------------------------------------------------------------------------------------------

    def _step(self) -> None:
        drive = self._drive
        if not isinstance(drive, Conductor) or self._stop.is_set():
            return
        try:
            goes_on = drive.step()
        except (LockstepError, StudioError) as error:
            self._break_off(drive, str(error))
            return
        except BaseException:
            self._break_off(drive, BROKE_OFF)
            raise
        self._node.run_soon(self._step if goes_on else self.report)

    def _break_off(self, drive: Conductor, why: str) -> None:
        self.problem = why
        self._node.log.error("the drive ends: %s", why)
        drive.session.finished = True
        self.report()

    def _conduct(self, now_ns: int) -> None:
        self._node.conduct_step(now_ns)

    # What goes out and comes in ---------------------------------------------------------------------------------------------

    def _publish(self, out: Outgoing, stamp_ns: int) -> None:
        self._node.publish(out.topic, out.message, id=out.id, stamp_ns=stamp_ns)

    def reach(self, act: Callable[[Session], None]) -> None:
        """Let a message act on the session of the present drive."""
        drive = self._drive
        if isinstance(drive, RealTime):
            session = drive.session
            drive.deliver(lambda: act(session))
        elif isinstance(drive, Conductor):
            act(drive.session)

    def requested(self, frames: Any) -> None:
        """Frames for the car's units."""
        drive = self._drive
        if isinstance(drive, RealTime):
            drive.request(frames.frames)
        elif isinstance(drive, Conductor):
            now_ns = self._node.clock.now_ns()
            answers = drive.session.request(frames.frames, now_ns)
            if answers:
                message = type(frames)(frames=tuple(answers))
                self._node.publish(topics.CAN_RX, message, id=self._config.can_bus, stamp_ns=now_ns)

    def _go_round(self) -> None:
        assert self._driven is not None
        scenario, seed, seconds = self._driven
        self.begin(scenario, seed + 1, seconds)

    def state(self) -> ScenarioState:
        """Where the drive stands."""
        drive = self._drive
        if drive is None:
            name = Path(self._config.scenario).stem
            told = ScenarioState(scenario=name, seed=self._config.seed, time_s=0.0, duration_s=0.0, running=False)
        else:
            told = drive.session.scenario_state(drive.session.world.time_s)
        if not self.problem:
            return told
        return msgspec.structs.replace(told, running=False, finished=True, problem=self.problem)

    def report(self) -> None:
        """Publish the state where no step does: before the start, and after the end."""
        drive = self._drive
        if isinstance(drive, RealTime) and not drive.alive and not drive.completed and not self.problem:
            self.problem = BROKE_OFF
            self._node.log.error(self.problem)
        if self._config.again and isinstance(drive, RealTime) and not drive.alive and drive.session.finished:
            self._go_round()
            return
        driving = drive.alive if isinstance(drive, RealTime) else drive is not None and not drive.session.finished
        if not driving:
            self._node.publish(topics.SCENARIO, self.state())


Seed = Annotated[int, msgspec.Meta(ge=0, description="number that varies traffic, looks and noise", examples=[7])]
Name = Annotated[
    str,
    msgspec.Meta(
        description="urb-rain, cross-border, dynamic-vsl, or the path of a scenario file", examples=["urb-rain"]
    ),
]
Seconds = Annotated[float, msgspec.Meta(ge=0, description="how long, s; 0: to the end of the route", examples=[60.0])]


def find_scenario(name: str) -> Scenario:
    """A shipped scenario by name, or a file by path. Raises ScenarioError and UserError."""
    return load_scenario(Path(name) if name.endswith((".toml", ".json")) else data(f"scenarios/{name}.toml"))


def length_s(scenario: Scenario, seconds: float | None) -> float:
    """How long to drive."""
    if seconds is None:
        return scenario.duration_s
    return seconds if seconds > 0 else LONGEST_S


def build(config: SimulatorConfig, node: Node) -> None:
    """Wire the simulator to its node."""
    simulator = Simulator(config, node)
    node.on_close(simulator.close)
    node.subscribe(topics.ADVISORY, lambda message, _: simulator.reach(lambda session: session.hear(message)))
    order = CommandOrder()

    def brake(command: BrakeCommand, info: Received[BrakeCommand]) -> None:
        if order.takes(info, node.clock.now_ns()):
            simulator.reach(lambda session: session.brake(command))

    node.subscribe(topics.BRAKE, brake)
    node.subscribe(topics.CAN_TX, lambda message, _: simulator.requested(message), id=config.can_bus)
    node.every(STATE_PERIOD_S, simulator.report)
    _add_tools(config, node, simulator)
    if node.lockstep:
        node.watch_services()
    if config.autostart:
        try:
            scenario = find_scenario(config.scenario)
        except ScenarioError as error:
            raise ConfigError(str(error)) from error
        simulator.begin(scenario, config.seed, length_s(scenario, config.seconds))


def _add_tools(config: SimulatorConfig, node: Node, simulator: Simulator) -> None:
    @node.tool(deadline_ms=2000, title="Start a scenario", read_only=False)
    def start_scenario(
        scenario: Name = config.scenario, seed: Seed = config.seed, seconds: Seconds | None = config.seconds
    ) -> ScenarioState:
        """Drive a scenario from its start; a running one ends."""
        try:
            found = find_scenario(scenario)
        except ValueError as error:
            raise ToolFailed(str(error), field="scenario", do="name a shipped scenario or a scenario file") from error
        simulator.begin(found, seed, length_s(found, seconds))
        return ScenarioState(
            scenario=found.name, seed=seed, time_s=0.0, duration_s=length_s(found, seconds), running=True
        )

    @node.tool(deadline_ms=6000, title="Stop the scenario", read_only=False)
    def stop_scenario() -> ScenarioState:
        """End the drive where it stands."""
        state = simulator.state()
        simulator.halt()
        return msgspec.structs.replace(state, running=False)

    @node.tool(deadline_ms=100, title="State of the scenario")
    def scenario_state() -> ScenarioState:
        """Which scenario is being driven, how far it is, and how many pictures came too late."""
        if simulator.problem:
            raise ToolFailed(simulator.problem)
        return simulator.state()


SERVICE = Service("simulator", SimulatorConfig, build)
