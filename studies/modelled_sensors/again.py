"""A kept drive (`studies.tracking.recording`) seen by perception and drivelm, without a bus: a recording in a minute."""

from collections.abc import Callable
from pathlib import Path

import msgspec

from drivemcp.paths import data
from evaluation.run.spec import RunSpec
from evaluation.run.world import world_of
from proto.perception import Tracks
from proto.scene import Fact, Facts
from proto.truth import Truth
from services.drivelm.country.country_belief import oncoming_cue, seen_to_come
from services.drivelm.country.surroundings import surroundings
from services.drivelm.front_end import FrontEnd, Sighting
from services.drivelm.service import DrivelmConfig, load_reader
from services.perception.checks.decoding import open_picture
from services.perception.detect.detector import DetectorOptions
from services.perception.detect.loading import load_detector
from services.perception.pipeline import Perception
from services.perception.weather.camera_weather import WeatherModel
from services.perception.weather.watch import WeatherWatch
from services.simulator.environment.weather import WeatherCourse, atmosphere
from services.simulator.sensors import measurements
from services.simulator.session import CAMERAS
from studies.modelled_sensors.recording import Recording
from studies.tracking.recording import DriveName, Look, Step, recording

SETTLE_NS, SURROUNDINGS_NS = 100_000_000, 1_000_000_000


def name_of(path: Path) -> DriveName:
    """The drive that a kept file holds, from its name: SCENARIO-SEED-SECONDS[-cut-ins].msgpack, a place's slashes as underscores."""
    stem, cut_ins = path.stem.removesuffix("-cut-ins"), path.stem.endswith("-cut-ins")
    scenario, seed, seconds = stem.rsplit("-", 2)
    return DriveName(scenario=scenario.replace("_", "/"), seed=int(seed), seconds=float(seconds), cut_ins=cut_ins)


class Onlooker:
    """Perception and drivelm as their services wire them, in the order of the steps."""

    def __init__(self, told: Recording) -> None:
        options = DetectorOptions(threads=1, score_floor=0.3)
        self.perception = Perception(load_detector(data("models/detector.onnx"), options))
        self.front_end = FrontEnd(load_reader(DrivelmConfig()), home="DEU")
        self.told = told
        self._watch = WeatherWatch(
            WeatherModel(data("models/weather.onnx")),
            lambda weather, stamp_ns: told.camera_weather.append((stamp_ns, weather)),
            None,
        )
        self.calibrations = {name: measurements.calibration(camera) for name, camera in CAMERAS.items()}
        for name, calibration in self.calibrations.items():
            self.perception.calibrate(name, calibration)

    def step(self, step: Step) -> None:
        """What one step of the simulator gives to be seen."""
        self.perception.ego(step.stamp_ns, step.ego)
        if step.sweep is not None:
            self.perception.sweep(step.stamp_ns, step.sweep)
        if step.map is not None:
            self.perception.map(step.stamp_ns, step.map)
        for look in step.looks:
            self._see(look, step.stamp_ns)
        if step.stamp_ns % SETTLE_NS == 0:
            self._say(self.front_end.settle(step.stamp_ns, step.ego.speed_mps), step.stamp_ns)
        if step.stamp_ns % SURROUNDINGS_NS == 0:
            where = self.front_end.country_belief
            self._say(surroundings(where, self.front_end.road_type, step.stamp_ns), step.stamp_ns)

    def _see(self, look: Look, stamp_ns: int) -> None:
        seen = self.perception.see(look.camera, stamp_ns, look.frame)
        self.told.boxes.append((stamp_ns, seen.boxes))
        sighting = Sighting(
            camera=look.camera,
            stamp_ns=stamp_ns,
            boxes=seen.boxes.boxes,
            open_picture=lambda: open_picture(look.frame),
            calibration=self.calibrations[look.camera],
        )
        if seen.lanes is not None:
            self.front_end.here = self.front_end.here._replace(
                ego_lane_id=seen.lanes.ego_lane_id,
                lateral_offset_m=seen.lanes.lateral_offset_m,
                lane_width_m=max(2.5, seen.lanes.lane_width_m),
                road_class=seen.lanes.road_class if seen.lanes.source == "map" else "",
            )
        self._say(self.front_end.see(sighting), stamp_ns)
        if seen.tracks is not None:
            self.told.tracks.append((stamp_ns, seen.tracks))
            self._hear(seen.tracks)
            self._watch.offer(look.camera, stamp_ns, look.frame, self.perception.measured(look.camera, look.frame))

    def _hear(self, tracks: Tracks) -> None:
        where = self.front_end.country_belief
        for track in tracks.tracks:
            if seen_to_come(track, tracks.ego_speed_used_mps):
                where = where.with_cue(("oncoming", track.track_id), oncoming_cue(track.y_m), "oncoming")
        if where is not self.front_end.country_belief:
            self.front_end.believe(where)

    def _say(self, facts: tuple[Fact, ...], stamp_ns: int) -> None:
        if facts:
            self.told.facts.append((stamp_ns, Facts(facts=facts)))


def see_again(path: Path) -> Recording:
    """The recording of a kept drive. Rain and darkness are the scenario's where the drive was kept before truth told them."""
    name = name_of(path)
    told = Recording(spec=RunSpec(scenario=name.scenario, seed=name.seed, seconds=name.seconds))
    onlooker, complete = Onlooker(told), _weather_of(told.spec)
    for step in recording(name, path.parent):
        told.truths.append((step.stamp_ns, complete(step.truth)))
        onlooker.step(step)
    return told


def _weather_of(spec: RunSpec) -> Callable[[Truth], Truth]:
    plan, _ = world_of(spec)
    course = WeatherCourse(plan.weather)

    def complete(truth: Truth) -> Truth:
        if truth.rain_mm_h is not None:
            return truth
        weather = course.at(truth.time_s)
        night = atmosphere(weather, plan.daylight).night
        seen_m = truth.visibility_m if truth.visibility_m is not None else weather.visibility_m
        return msgspec.structs.replace(truth, rain_mm_h=weather.rain_mm_h, dark=night, visibility_m=seen_m)

    return complete
