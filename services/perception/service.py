"""Binds the pipeline to the bus: pictures and what helps to understand them in; boxes, tracks and lanes out."""

from __future__ import annotations

import itertools
from pathlib import Path

from drivemcp.bus.received import Received
from drivemcp.config import ServiceConfig
from drivemcp.errors import ConfigError, ToolFailed
from drivemcp.inference import chosen
from drivemcp.node import Node
from drivemcp.paths import data
from drivemcp.registry import registered
from drivemcp.service import Service
from proto import topics
from proto.perception import Tracks
from proto.sensors import Calibration, CameraFrame, LidarSweep, MapView
from proto.vehicle import Ego
from services.perception.checks.decoding import Malformed
from services.perception.detect.detector import DetectorOptions
from services.perception.detect.loading import digest, load_detector
from services.perception.pipeline import Perception
from services.perception.track.tracker import Tracker
from services.perception.weather.camera_weather import WeatherModel
from services.perception.weather.watch import WeatherWatch


class PerceptionConfig(ServiceConfig, frozen=True, kw_only=True):
    """How pictures become tracks."""

    detector: str = ""
    """An ONNX file. Empty: the shipped detector. `drivemcp up --detector NAME` takes one of the models by name."""
    detector_layout: str = ""
    """Of a COCO-style detector whose outputs do not tell it: yolox, yolox-decoded, yolov5, yolov6, yolov8."""
    threads: int = 1
    """Processor cores; with 2 both looks at a wide picture are taken side by side."""
    providers: str = "cpu"
    """Execution providers of ONNX Runtime in their order, with commas: cpu, cuda, tensorrt, openvino, coreml."""
    score_floor: float = 0.3
    """Least score of a detector that names no floors; the shipped one has a floor per class."""
    late_ms: float = 300.0
    """Pictures that waited longer than this for their turn are dropped and counted, so that a backlog never builds up."""
    stale_ms: float = 1000.0
    """Tracks of an older picture are no answer to `list_tracks`."""
    closer_ms: float = 10.0
    """A picture that waited longer than this is not looked at more closely: what is told soon counts more than what is far."""
    tracking: bool = True
    """Off, for the evaluation: each picture's road users are new ones, of unknown speed. Refused outside lockstep."""


class Drops:
    """Counts what was dropped, by reason, and shows it in the service's health."""

    def __init__(self, node: Node) -> None:
        self._node = node
        self._counts: dict[str, int] = {}

    def add(self, what: str, why: object) -> None:
        """One more; the first of each kind is logged."""
        self._counts[what] = self._counts.get(what, 0) + 1
        self._node.detail[f"dropped_{what}"] = str(self._counts[what])
        if self._counts[what] in (1, 10, 100, 1000):
            self._node.log.warning("dropped %s number %d: %s", what, self._counts[what], why)


def _tracker(config: PerceptionConfig, node: Node) -> Tracker:
    if config.tracking:
        return Tracker()
    if not node.lockstep:
        raise ConfigError("perception.tracking = false knows no speeds and is for simulation: it needs lockstep")
    untracked: type[Tracker] = registered("drivemcp.trackers", "untracked", "perception.tracking")
    return untracked()


def build(config: PerceptionConfig, node: Node) -> None:
    """Load the detector and subscribe; raises DetectorError where the model cannot be used."""
    path = Path(config.detector) if config.detector else data("models/detector.onnx")
    providers = chosen(config.providers, "perception.providers")
    options = DetectorOptions(
        threads=config.threads, score_floor=config.score_floor, providers=providers, layout=config.detector_layout
    )
    detector = load_detector(path, options)
    node.detail["providers"] = ", ".join(providers)
    node.detail["detector"] = f"{detector.name} sha256:{digest(path)}"
    perception, drops = Perception(detector, tracker=_tracker(config, node)), Drops(node)
    latest: dict[str, tuple[int, Tracks]] = {}
    hurried = itertools.count(1)
    watch = WeatherWatch(
        WeatherModel(data("models/weather.onnx")),
        lambda weather, stamp_ns: node.publish(topics.CAMERA_WEATHER, weather, stamp_ns=stamp_ns),
        None if node.lockstep else node.run_soon,
    )
    node.on_close(watch.close)

    def on_picture(frame: CameraFrame, info: Received[CameraFrame]) -> None:
        waited_ms = (node.clock.now_ns() - info.sent_ns) / 1e6
        if not node.lockstep and waited_ms > config.late_ms:
            drops.add("late_pictures", f"it waited {waited_ms:.0f} ms")
            return
        try:
            in_time = node.lockstep or waited_ms <= config.closer_ms
            if not in_time:
                node.detail["looked_at_once"] = str(next(hurried))
            seen = perception.see(info.id, info.stamp_ns, frame, closer=in_time)
        except Malformed as error:
            drops.add("pictures", error)
            return
        node.publish(topics.BOXES, seen.boxes, stamp_ns=info.stamp_ns)
        for camera, road in perception.roads.items():
            node.detail[f"field_of_view_{camera}"] = road.told
        if seen.lanes is not None:
            node.publish(topics.LANES, seen.lanes, stamp_ns=info.stamp_ns)
        if seen.tracks is not None:
            node.publish(topics.TRACKS, seen.tracks, stamp_ns=info.stamp_ns)
            latest["tracks"] = (node.clock.now_ns(), seen.tracks)
            watch.offer(info.id, info.stamp_ns, frame, perception.measured(info.id, frame))

    def on_calibration(calibration: Calibration, info: Received[Calibration]) -> None:
        try:
            perception.calibrate(info.id, calibration)
        except Malformed as error:
            drops.add("calibrations", error)

    def on_sweep(sweep: LidarSweep, info: Received[LidarSweep]) -> None:
        try:
            perception.sweep(info.stamp_ns, sweep)
        except Malformed as error:
            drops.add("sweeps", error)

    def on_ego(ego: Ego, info: Received[Ego]) -> None:
        perception.ego(info.stamp_ns, ego)

    def on_map(view: MapView, info: Received[MapView]) -> None:
        perception.map(info.stamp_ns, view)

    node.subscribe(topics.CALIBRATION, on_calibration)
    node.subscribe(topics.LIDAR, on_sweep)
    node.subscribe(topics.EGO, on_ego)
    node.subscribe(topics.MAP, on_map)
    node.subscribe(topics.CAMERA, on_picture)

    @node.tool(deadline_ms=20, title="Tracked road users")
    def list_tracks() -> Tracks:
        """The road users tracked now: place and speed relative to the car, lane, confidence, and which one leads.

        Fails where no picture was understood within the last second.
        """
        known = latest.get("tracks")
        if known is None or node.clock.now_ns() - known[0] > config.stale_ms * 1e6:
            raise ToolFailed("no picture was understood within the last second", do="check the cameras")
        return known[1]


SERVICE = Service("perception", PerceptionConfig, build)
