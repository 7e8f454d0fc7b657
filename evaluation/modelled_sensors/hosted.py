"""Perception and drivelm without pictures: services of the same names, topics and tools, which draw what they see from truth.

Both hear the simulator's truth, as nothing of production may. All that follows from a picture's boxes and readings is production's.
"""

from collections.abc import Callable, Mapping
from typing import Any

import msgspec
import numpy as np

from drivemcp.bus.received import Received
from drivemcp.errors import ToolFailed
from drivemcp.node import Node
from drivemcp.paths import data
from drivemcp.service import Service
from evaluation.corruption.chance import chance
from evaluation.modelled_sensors.boxes import Eye
from evaluation.modelled_sensors.card import Card, LooksLike, read_card, weather_name
from evaluation.modelled_sensors.reads import ModelledFrontEnd
from proto import topics
from proto.perception import Tracks
from proto.sensors import MapView
from proto.truth import Truth
from proto.vehicle import Ego
from proto.weather import CameraWeather, Within
from services.drivelm.service import Bindings, DrivelmConfig
from services.perception.detect.detection import Detection
from services.perception.pipeline import Perception
from services.perception.service import PerceptionConfig
from services.simulator.session import CAMERA_STEPS
from services.simulator.world import STEP_S

CARD = "models/observed.json"
SLOT_S = 10
OPEN_M = 50_000.0


class ModelledPerceptionConfig(PerceptionConfig, frozen=True, kw_only=True):
    """`observed`: the fitted model. `seed`: of what is drawn."""

    observed: str = CARD
    seed: int = 1
    cameras: tuple[str, ...] = ("front", "tele")


class ModelledDrivelmConfig(DrivelmConfig, frozen=True, kw_only=True):
    """As `ModelledPerceptionConfig`."""

    observed: str = CARD
    seed: int = 1


class Blind:
    """Stands where the pipeline wants a detector, and is never asked."""

    name = "modelled"

    def detect(self, rgb: np.ndarray[Any, Any], *, closer: bool = False) -> list[Detection]:
        return []


class ModelledPerception:
    """Boxes, tracks, lanes and the camera's weather, at the rates and stamps of pictures."""

    def __init__(self, config: ModelledPerceptionConfig, node: Node) -> None:
        self._node, self._seed, self._stale_ns = node, config.seed, config.stale_ms * 1e6
        card = read_card(data(config.observed))
        node.detail["detector"] = "modelled"
        self._weather, self._frames = card.weather, dict.fromkeys(config.cameras, 0)
        self._eyes = {name: Eye(card, name, config.seed) for name in config.cameras}
        self.pipeline = Perception(Blind())
        for name, eye in self._eyes.items():
            self.pipeline.calibrate(name, eye.calibration)
        self._latest: tuple[int, Tracks] | None = None
        node.subscribe(topics.EGO, self._on_ego)
        node.subscribe(topics.MAP, self._on_map)
        node.subscribe(topics.LIDAR, lambda sweep, info: self.pipeline.movers(info.stamp_ns, sweep))
        node.subscribe(topics.TRUTH, self._on_truth)
        node.tool(deadline_ms=20, title="Tracked road users")(self.list_tracks)

    def list_tracks(self) -> Tracks:
        """The road users tracked now: place and speed relative to the car, lane, confidence, and which one leads.

        Fails where no picture was understood within the last second.
        """
        if self._latest is None or self._node.clock.now_ns() - self._latest[0] > self._stale_ns:
            raise ToolFailed("no picture was understood within the last second; check the cameras")
        return self._latest[1]

    def _on_ego(self, ego: Ego, info: Received[Ego]) -> None:
        self.pipeline.ego(info.stamp_ns, ego)

    def _on_map(self, view: MapView, info: Received[MapView]) -> None:
        self.pipeline.map(info.stamp_ns, view)

    def _on_truth(self, truth: Truth, info: Received[Truth]) -> None:
        step = round(truth.time_s / STEP_S)
        for name in self._eyes:
            every, remainder = CAMERA_STEPS[name]
            if step % every == remainder:
                self._see(name, truth, info.stamp_ns)
        if step % round(1.0 / STEP_S) == 0 and self._weather:
            told = weather_told(self._weather, truth, self._seed)
            if told is not None:
                self._node.publish(topics.CAMERA_WEATHER, told, stamp_ns=info.stamp_ns)

    def _see(self, name: str, truth: Truth, stamp_ns: int) -> None:
        self._frames[name] += 1
        seen = self._eyes[name].understood(self.pipeline, truth, stamp_ns, self._frames[name])
        self._node.publish(topics.BOXES, seen.boxes, stamp_ns=stamp_ns)
        if seen.lanes is not None:
            self._node.publish(topics.LANES, seen.lanes, stamp_ns=stamp_ns)
        if seen.tracks is not None:
            self._node.publish(topics.TRACKS, seen.tracks, stamp_ns=stamp_ns)
            self._latest = self._node.clock.now_ns(), seen.tracks


def weather_told(rows: tuple[LooksLike, ...], truth: Truth, seed: int) -> CameraWeather | None:
    """What was once told of pictures in such weather, the same for ten seconds; None where no run had such weather.

    Visibility is shifted by as much as the true one differs from the true one of then.
    """
    alike = [row for row in rows if row.weather == weather_name(truth)]
    if not alike or truth.visibility_m is None:
        return None
    away = np.abs(np.log(np.array([row.open_m for row in alike]) / max(truth.visibility_m or OPEN_M, 10.0)))
    near = np.argsort(away, kind="stable")[: max(5, len(alike) // 4)]
    row = alike[int(near[int(chance(seed, "weather", int(truth.time_s) // SLOT_S) * len(near))])]
    told, ratio = row.told.visibility_m, truth.visibility_m / row.open_m
    if told is None or told.low >= OPEN_M:
        return row.told
    moved = Within(
        low=told.low * ratio, high=told.high if told.high >= OPEN_M else told.high * ratio, confidence=told.confidence
    )
    return msgspec.structs.replace(row.told, visibility_m=moved)


def _build_perception(config: ModelledPerceptionConfig, node: Node) -> None:
    ModelledPerception(config, node)


def _build_drivelm(config: ModelledDrivelmConfig, node: Node) -> None:
    card = read_card(data(config.observed))
    end = ModelledFrontEnd(card, config.seed, home=config.home, max_reads=config.max_reads)
    node.subscribe(topics.TRUTH, lambda truth, info: end.know(truth, info.stamp_ns))
    bindings = Bindings(config, node, end)
    for name in CAMERA_STEPS:
        bindings.calibrations.take(name, Eye(card, name, config.seed).calibration)


_BUILD: Mapping[str, tuple[type[Any], Callable[[Any, Node], None]]] = {
    "perception": (ModelledPerceptionConfig, _build_perception),
    "drivelm": (ModelledDrivelmConfig, _build_drivelm),
}
MODELLED = frozenset(_BUILD)
"""Services that a run with modelled sensors starts in place of production's."""


def modelled(service: Service[Any]) -> Service[Any]:
    """The service that stands for one of `MODELLED`; any other as it is."""
    if service.name not in _BUILD:
        return service
    config, build = _BUILD[service.name]
    return Service(service.name, config, build)


__all__ = ["CARD", "MODELLED", "Card", "modelled"]
