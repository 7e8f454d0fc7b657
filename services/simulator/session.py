"""One drive: the world with the car's units and all sensors, step by step, as messages to be published. Knows no bus."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import msgspec

from domain.kinematics import GRAVITY_MPS2
from proto import topics
from proto.decision import Advisory, BrakeCommand
from proto.sensors import CanFrame, CanFrames, ClockTick
from proto.topics import Topic
from proto.truth import ScenarioState
from services.simulator.car.braking import FULL_MPS2, decelerate
from services.simulator.car.car import Car
from services.simulator.car.state import CarState
from services.simulator.driver.driver import Advice
from services.simulator.driver.kinds import DriverKind
from services.simulator.ecus.bank import EcuBank
from services.simulator.ecus.can_frames import FrameEncoder
from services.simulator.scenario.plan import Scenario
from services.simulator.scene.scene import FRONT, TELE, CameraSpec, Scene
from services.simulator.sensors import measurements
from services.simulator.truth.message import truth_of
from services.simulator.truth.snapshot import Snapshot
from services.simulator.world import STEP_S, Inputs, World

STEP_NS = round(STEP_S * 1e9)
CAMERAS: dict[str, CameraSpec] = {camera.id: camera for camera in (FRONT, TELE)}
CAMERA_STEPS = {"front": (2, 0), "tele": (4, 1)}
"""Every so many steps, at this remainder: the two are never due in the same step, which evens out the load."""
LIDAR_STEPS, GNSS_STEPS, MAP_STEPS, SLOW_STEPS, STATE_STEPS = 2, 2, 2, 20, 10


@dataclass(frozen=True, slots=True)
class SensorSet:
    """Which sensors are there."""

    cameras: tuple[str, ...] = ("front", "tele")
    lidar: bool = True
    gnss: bool = True
    map: bool = True
    weather: bool = True
    can: bool = True
    lidar_at_crossings: bool = False
    """Without `lidar`: sweeps all the same while a vehicle near by drives across the ego's way."""


@dataclass(frozen=True, slots=True)
class Outgoing:
    """A message for a topic."""

    topic: Topic[Any]
    message: msgspec.Struct
    id: str | None = None


@dataclass(frozen=True, slots=True)
class Shot:
    """A picture that a camera takes at this step."""

    camera: str
    scene: Scene
    frame: int


@dataclass(frozen=True, slots=True)
class Batch:
    """All that one step gives."""

    snapshot: Snapshot
    stamp_ns: int
    messages: tuple[Outgoing, ...]
    shots: tuple[Shot, ...]


@dataclass(slots=True)
class _Mail:
    advice: list[Advice] = field(default_factory=list)
    brakes: list[BrakeCommand] = field(default_factory=list)
    frames: list[CanFrame] = field(default_factory=list)


class Session:
    """A scenario being driven. `epoch_ns` is the stamp of its time zero."""

    def __init__(
        self,
        scenario: Scenario,
        seed: int,
        *,
        seconds: float,
        epoch_ns: int,
        dbc: Path,
        bus: str,
        present: SensorSet = SensorSet(),
        lockstep: bool = False,
        driver: DriverKind = "drawn",
        brakes_until_s: float = math.inf,
    ) -> None:
        self.world, self.scenario, self.seed = World(scenario, seed, driver), scenario, seed
        self.seconds, self.epoch_ns, self.bus, self._present = seconds, epoch_ns, bus, present
        self._lockstep, self._brakes_until_s = lockstep, brakes_until_s
        self._noise, self._boxes = measurements.SensorNoise(seed), measurements.StaticBoxes(self.world.static)
        self._encoder, self.ecus = FrameEncoder(dbc), EcuBank()
        self._faults = sorted(scenario.faults, key=lambda fault: fault.at_s)
        self._car = Car(seed, self.ecus.faults, self.world.course.at(0.0).air_c)
        self.state: CarState = self._car.state
        """As its control units know it."""
        self._mail, self._frames = _Mail(), dict.fromkeys(CAMERAS, 0)
        self.late_frames, self.finished = 0, False

    # What comes in ----------------------------------------------------------------------------------------------------

    def hear(self, advisory: Advisory) -> None:
        """A message to the driver; silence is not a message."""
        if advisory.kind == "SILENT" or not advisory.directive:
            return
        self._mail.advice.append(
            Advice(
                topic=advisory.topic,
                target_mps=advisory.asked_mps,
                limit_mps=advisory.told_limit_mps,
                warns=bool(advisory.hazard) or advisory.urgency in ("warning", "alarm"),
                ahead_mps=advisory.ahead_mps,
                slow=advisory.urgency != "info",
                seen=advisory.target_why in ("lead", "person", "give_way", "junction"),
            )
        )

    def brake(self, command: BrakeCommand) -> None:
        """A braking command arrives; from `brakes_until_s` on none does."""
        if self.world.time_s < self._brakes_until_s:
            self._mail.brakes.append(command)

    def request(self, frames: Sequence[CanFrame], now_ns: int) -> list[CanFrame]:
        """Frames sent on the bus to the units; what they answer at once."""
        return [answer for frame in frames for answer in self.ecus.on_frame(frame, self.state, now_ns)]

    # What goes out ------------------------------------------------------------------------------------------------------

    @property
    def next_stamp_ns(self) -> int:
        """The stamp of the next step."""
        return self.epoch_ns + round((self.world.time_s + STEP_S) * 1e9)

    def advance(self, ahead_s: float = 0.0) -> Batch:
        """Drive one step; `ahead_s`: how much earlier than its stamp the step is computed."""
        mail, self._mail = self._mail, _Mail()
        self._begin_faults()
        inputs = Inputs(
            advice=tuple(mail.advice),
            brakes=tuple(mail.brakes),
            car=self._car.ability(self.next_stamp_ns),
            heard_s_ago=ahead_s,
        )
        snapshot = self.world.step(inputs)
        self.finished = snapshot.ended or snapshot.time_s >= self.seconds - 1e-6
        stamp_ns = self.epoch_ns + round(snapshot.time_s * 1e9)
        return Batch(snapshot, stamp_ns, tuple(self._messages(snapshot, stamp_ns)), tuple(self._shots(snapshot)))

    def _begin_faults(self) -> None:
        while self._faults and self._faults[0].at_s <= self.world.time_s:
            fault = self._faults.pop(0)
            self.ecus.faults.activate(fault.preset, fault.severity)

    def scenario_state(self, time_s: float, running: bool = True) -> ScenarioState:
        """Where the drive stands."""
        return ScenarioState(
            scenario=self.scenario.name,
            seed=self.seed,
            time_s=time_s,
            duration_s=self.seconds,
            running=running and not self.finished,
            finished=self.finished,
            late_frames=self.late_frames,
        )

    def _messages(self, snapshot: Snapshot, stamp_ns: int) -> list[Outgoing]:
        step, present = snapshot.step, self._present
        out = [Outgoing(topics.CLOCK, ClockTick(now_ns=stamp_ns, lockstep=self._lockstep, step=step))]
        told = self._car.step(STEP_S, measurements.car_controls(snapshot), stamp_ns)
        self.state = told.units
        if present.can:
            frames = (*self._encoder.due(told.frames, stamp_ns, told.silent), *self.ecus.step(stamp_ns, told.units))
            out.append(Outgoing(topics.CAN_RX, CanFrames(frames=frames), self.bus))
        if present.map and step % MAP_STEPS == 0:
            out.append(Outgoing(topics.MAP, measurements.map_view(snapshot, self.world.route, self.world.lines)))
        if present.gnss and step % GNSS_STEPS == 0:
            out.append(Outgoing(topics.GNSS, measurements.gnss_fix(snapshot, self._noise)))
        if step % LIDAR_STEPS == 0 and (
            present.lidar or (present.lidar_at_crossings and measurements.somebody_crosses(snapshot))
        ):
            out.append(Outgoing(topics.LIDAR, measurements.lidar_sweep(snapshot, self._boxes, self._noise), "top"))
        if step % SLOW_STEPS == 1:
            out += self._slow(snapshot)
        return [*out, *self._about(snapshot)]

    def _slow(self, snapshot: Snapshot) -> list[Outgoing]:
        views = [
            Outgoing(topics.CALIBRATION, measurements.calibration(CAMERAS[name]), name)
            for name in self._present.cameras
        ]
        if self._present.weather:
            views.append(Outgoing(topics.WEATHER_SENSING, measurements.weather_sensing(snapshot, self._noise)))
        return views

    def _about(self, snapshot: Snapshot) -> list[Outgoing]:
        world = self.world
        distracted = world.driver.distracted(snapshot.time_s)
        truth = truth_of(
            snapshot,
            world.static,
            world.houses,
            world.lines,
            world.lights,
            distracted=distracted,
            faults=self.ecus.active,
            brake_share=self._brake_share(snapshot),
            driver_language=world.route.scenario.driver_language,
        )
        out = [Outgoing(topics.TRUTH, truth)]
        if snapshot.step % STATE_STEPS == 0 or self.finished:
            out.append(Outgoing(topics.SCENARIO, self.scenario_state(snapshot.time_s)))
        return out

    def _brake_share(self, snapshot: Snapshot) -> float:
        """What a full braking gives now, in ratio to what the road gives its tyres."""
        ego, film_mm = snapshot.ego, snapshot.weather.film_mm
        able = self._car.ability(self.epoch_ns + round(snapshot.time_s * 1e9))
        full = decelerate(FULL_MPS2, able, ego.mu, film_mm, ego.speed_mps, ego.locked)
        return min(1.0, full.mps2 / min(FULL_MPS2, ego.mu * GRAVITY_MPS2))

    def _shots(self, snapshot: Snapshot) -> list[Shot]:
        shots = []
        for name in self._present.cameras:
            every, remainder = CAMERA_STEPS[name]
            if snapshot.step % every == remainder:
                self._frames[name] += 1
                shots.append(Shot(name, snapshot.scene, self._frames[name]))
        return shots
