"""Actors that drop out: their tracks and boxes are gone for a window, and come back under their old number."""

from collections.abc import Sequence

import msgspec

from evaluation.corruption.spec import CorruptionSpec
from evaluation.corruption.truths import Truths, actor_of
from evaluation.corruption.windows import Window, window_at
from proto.perception import Boxes, Track, Tracks

Windows = dict[str, tuple[Window, int]]
"""By actor: its window, and the track that it is just seen as."""


class Actors:
    """Corrupts tracks and boxes. An actor is known by truth, through changes of its track; else by its track's number."""

    def __init__(self, spec: CorruptionSpec, truths: Truths) -> None:
        self._spec, self._truths = spec, truths
        self._bound: dict[int, str] = {}

    def tracks(self, tracks: Tracks, stamp_ns: int, since_ns: int) -> tuple[Tracks, Windows]:
        """The tracks that are left, and the windows of the others by actor. `since_ns`: time since the drive began."""
        self._bind(tracks.tracks, stamp_ns)
        gone = {track.track_id: window for track in tracks.tracks if (window := self._window(track.track_id, since_ns))}
        if not gone:
            return tracks, {}
        left = tuple(track for track in tracks.tracks if track.track_id not in gone)
        lead = tracks.lead_track_id
        after = msgspec.structs.replace(tracks, tracks=left, lead_track_id=_next(left) if lead in gone else lead)
        return after, {self._bound[number]: (window, number) for number, window in gone.items()}

    def boxes(self, boxes: Boxes, since_ns: int) -> Boxes:
        """The boxes that are left. A box stays whose track was not told of yet: its actor is not known."""
        left = tuple(
            box
            for box in boxes.boxes
            if box.kind not in ("vehicle", "pedestrian") or self._window(box.track_id, since_ns) is None
        )
        return boxes if len(left) == len(boxes.boxes) else msgspec.structs.replace(boxes, boxes=left)

    def _bind(self, tracks: Sequence[Track], stamp_ns: int) -> None:
        truth = self._truths.at(stamp_ns)
        for track in tracks:
            bound = self._bound.get(track.track_id)
            found = actor_of(track, truth.actors, bound) if truth is not None else None
            self._bound[track.track_id] = found or bound or f"track/{track.track_id}"

    def _window(self, track_id: int, since_ns: int) -> Window | None:
        actor = self._bound.get(track_id)
        return None if actor is None else window_at(self._spec, "dropout", self._spec.dropout, actor, since_ns)


def _next(tracks: Sequence[Track]) -> int | None:
    """The number of the track that leads among those left, as perception would say: the next one in the path that goes our way."""
    ahead = [
        each for each in tracks if each.in_ego_path and not each.oncoming and each.kind != "pedestrian" and each.x_m > 0
    ]
    return min(ahead, key=lambda each: each.x_m).track_id if ahead else None
