"""A run's truth beside what perception, drivelm and the advice said of it: what the model is fitted to and checked against."""

import gzip
import threading
from collections.abc import Callable
from pathlib import Path
from typing import Any

import msgspec

from drivemcp.bus.received import Received
from drivemcp.errors import MALFORMED, UserError
from drivemcp.node import Node
from evaluation.run.spec import RunSpec
from proto import topics
from proto.decision import Advisory, Decision
from proto.perception import Boxes, Tracks
from proto.scene import Facts
from proto.sensors import WeatherSensing
from proto.topics import Topic
from proto.truth import Truth
from proto.weather import CameraWeather


class Recording(msgspec.Struct, kw_only=True):
    """Messages by stamp (ns), each list in the order in which they came."""

    spec: RunSpec
    truths: list[tuple[int, Truth]] = []
    tracks: list[tuple[int, Tracks]] = []
    boxes: list[tuple[int, Boxes]] = []
    facts: list[tuple[int, Facts]] = []
    camera_weather: list[tuple[int, CameraWeather]] = []
    weather: list[tuple[int, WeatherSensing]] = []
    advisories: list[tuple[int, Advisory]] = []
    decisions: list[tuple[int, Decision]] = []


KEPT: dict[str, Topic[Any]] = {
    "truths": topics.TRUTH,
    "tracks": topics.TRACKS,
    "boxes": topics.BOXES,
    "facts": topics.FACTS,
    "camera_weather": topics.CAMERA_WEATHER,
    "weather": topics.WEATHER_SENSING,
    "advisories": topics.ADVISORY,
    "decisions": topics.DECISION,
}


def listener(recording: Recording) -> Callable[[Node], None]:
    """What `evaluation.run.host.drive` wants as `observe`: fills the recording."""
    lock = threading.Lock()

    def taker(name: str) -> Callable[[Any, Received[Any]], None]:
        def take(message: Any, info: Received[Any]) -> None:
            with lock:
                getattr(recording, name).append((info.stamp_ns, message))

        return take

    def observe(node: Node) -> None:
        for name, topic in KEPT.items():
            node.subscribe(topic, taker(name))

    return observe


def save(recording: Recording, path: Path) -> None:
    """Write it, packed."""
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(gzip.compress(msgspec.msgpack.encode(recording), 6))


def load(path: Path) -> Recording:
    """Read a recording. Raises UserError where the file is not a recording of this version."""
    try:
        return msgspec.msgpack.decode(gzip.decompress(path.read_bytes()), type=Recording)
    except (OSError, *MALFORMED) as error:
        raise UserError(f"{path}: not a recording of this version ({error})") from error
