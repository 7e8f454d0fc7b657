"""The corruption of one drive as a value machine: a message in, what leaves of it out; knows no bus and reads no clock."""

from collections.abc import Callable
from typing import Any, NamedTuple

import msgspec

from evaluation.corruption.actors import Actors
from evaluation.corruption.encounters import Encounters
from evaluation.corruption.sensors import Cameras, Stamps
from evaluation.corruption.signs import Signs
from evaluation.corruption.spec import CorruptionSpec
from evaluation.corruption.truths import Truths
from evaluation.corruption.windows import Window, window_at
from proto import topics
from proto.perception import Boxes, Tracks
from proto.scene import Facts
from proto.sensors import CameraFrame, LidarSweep
from proto.topics import Topic
from proto.truth import Corrupted, CorruptionKind, Truth


class Left(NamedTuple):
    """What leaves: the message (None: nothing), its stamp, and what is to be told of the corruption."""

    message: Any
    stamp_ns: int
    records: tuple[Corrupted, ...] = ()


class Corruptor:
    """Give it what is published, in the order in which it is; a topic that it does not corrupt leaves as it came."""

    def __init__(self, spec: CorruptionSpec) -> None:
        self.spec = spec
        self._truths = Truths()
        self._encounters = Encounters(self._truths)
        self._signs, self._actors = Signs(spec, self._encounters), Actors(spec, self._truths)
        self._cameras, self._stamps = Cameras(spec), Stamps(spec)
        self._began_ns: int | None = None
        self._told: set[tuple[str, str, int]] = set()
        self._table: dict[str, Callable[[Any, str, int], Left]] = {
            topics.CAMERA.name: self._camera,
            topics.LIDAR.name: self._lidar,
            topics.BOXES.name: self._boxes,
            topics.TRACKS.name: self._tracks,
            topics.FACTS.name: self._facts,
        }

    def truth(self, truth: Truth, stamp_ns: int) -> None:
        """Which signs and actors there are, and when the drive began."""
        self._truths.add(truth, stamp_ns)

    def moved(self, speed_mps: float, now_ns: int) -> None:
        """The ego's speed; without truth, the way driven distinguishes encounters."""
        self._encounters.move(speed_mps, now_ns)

    def leave(self, topic: Topic[Any], message: msgspec.Struct, id: str, stamp_ns: int) -> Left:
        """What leaves of a message."""
        corrupt = self._table.get(topic.name)
        return Left(message, stamp_ns) if corrupt is None else corrupt(message, id, stamp_ns)

    def _camera(self, frame: CameraFrame, id: str, stamp_ns: int) -> Left:
        since_ns = self._since(stamp_ns)
        after, windows = self._cameras.frame(frame, id, since_ns)
        records = [self._window(kind, f"camera/{id}", window, stamp_ns, since_ns) for kind, window in windows.items()]
        return Left(after, self._stamps.shifted(f"camera/{id}", stamp_ns, since_ns), _some(records))

    def _lidar(self, sweep: LidarSweep, id: str, stamp_ns: int) -> Left:
        since_ns = self._since(stamp_ns)
        window = window_at(self.spec, "lidar_loss", self.spec.lidar_loss, id, since_ns)
        if window is None:
            return Left(sweep, self._stamps.shifted(f"lidar/{id}", stamp_ns, since_ns))
        return Left(None, stamp_ns, _some([self._window("lidar_loss", f"lidar/{id}", window, stamp_ns, since_ns)]))

    def _boxes(self, boxes: Boxes, id: str, stamp_ns: int) -> Left:
        return Left(self._actors.boxes(boxes, self._since(stamp_ns)), stamp_ns)

    def _tracks(self, tracks: Tracks, id: str, stamp_ns: int) -> Left:
        since_ns = self._since(stamp_ns)
        after, windows = self._actors.tracks(tracks, stamp_ns, since_ns)
        records = [
            self._window("dropout", actor, window, stamp_ns, since_ns, camera=tracks.camera, track_id=number)
            for actor, (window, number) in windows.items()
        ]
        return Left(after, stamp_ns, _some(records))

    def _facts(self, facts: Facts, id: str, stamp_ns: int) -> Left:
        after, records = self._signs.facts(facts, stamp_ns)
        return Left(after, stamp_ns, tuple(records))

    def _since(self, stamp_ns: int) -> int:
        """Since the drive began: by truth, else since the first message."""
        if self._truths.origin_ns is not None:
            return stamp_ns - self._truths.origin_ns
        self._began_ns = stamp_ns if self._began_ns is None else self._began_ns
        return stamp_ns - self._began_ns

    def _window(
        self, kind: CorruptionKind, subject: str, window: Window, stamp_ns: int, since_ns: int,
        camera: str = "", track_id: int = 0,
    ) -> Corrupted | None:  # fmt: skip
        """The record of a window, once."""
        if (kind, subject, window.start_ns) in self._told:
            return None
        self._told.add((kind, subject, window.start_ns))
        began_ns = stamp_ns - since_ns
        return Corrupted(
            kind=kind, subject=subject, stamp_ns=stamp_ns, from_ns=began_ns + window.start_ns,
            until_ns=began_ns + window.end_ns, camera=camera, track_id=track_id,
        )  # fmt: skip


def _some(records: list[Corrupted | None]) -> tuple[Corrupted, ...]:
    return tuple(record for record in records if record is not None)
