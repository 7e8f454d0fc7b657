"""Tracks of signs, panels and lights in one camera's pictures, so that their readings can be joined over time."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

from proto.perception import ObjectClass
from services.perception.detect.detection import Detection
from services.perception.track.association import greedy

KEEP_S = 0.8
"""A track unseen for longer has ended: at 5 pictures a second three of them may fail."""
REACH_SIZES, REACH_PX = 0.5, 3.0
"""How far from its expected place a box may lie, in box sizes and in pixels. Faces stacked on
one post lie a whole size apart: where the approach is known, one never takes the other's track."""
BLIND_SIZES, BLIND_PX = 1.2, 6.0
"""The same for a track seen once, whose approach is unknown."""
REACH_GROWTH_PER_S = 0.5
SIZE_RATIO = 1.8
POSITION_GAIN, VELOCITY_GAIN = 0.8, 0.5
FASTEST_GROWTH_PER_S = 3.0
NEAREST_SHARE = 0.4
"""A prediction never brings a thing nearer than to this share of its distance."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Approach:
    """How a standing thing moves in the picture as the ego drives on: away from (u, v), by this share per second."""

    growth_per_s: float
    u_px: float
    v_px: float


@dataclass(frozen=True, slots=True, kw_only=True)
class ImageTrack:
    """Centre and logarithm of the size with their changes per second, those of a turning camera left out, at `stamp_ns`."""

    track_id: int
    kind: ObjectClass
    u_px: float
    v_px: float
    log_size: float
    du_px_s: float = 0.0
    dv_px_s: float = 0.0
    growth_per_s: float = 0.0
    stamp_ns: int = 0
    hits: int = 1
    blind: bool = False
    """Seen once, and nothing told how it would move."""

    def at(self, stamp_ns: int, turn_px_s: float) -> ImageTrack:
        """Where it is expected then: what is approached at a steady speed grows and moves as one over its distance, and all
        moves aside as the camera turns.
        """
        dt = (stamp_ns - self.stamp_ns) / 1e9
        nearer = 1.0 / max(1.0 - max(self.growth_per_s, 0.0) * dt, NEAREST_SHARE)
        return replace(
            self,
            u_px=self.u_px + (self.du_px_s * nearer + turn_px_s) * dt,
            v_px=self.v_px + self.dv_px_s * dt * nearer,
            log_size=self.log_size + (math.log(nearer) if self.growth_per_s > 0 else self.growth_per_s * dt),
            du_px_s=self.du_px_s * nearer**2,
            dv_px_s=self.dv_px_s * nearer**2,
            growth_per_s=self.growth_per_s * nearer,
        )


class ImageTracker:
    """One for each camera; ids come from a source shared with all other trackers."""

    def __init__(self, ids: Iterator[int]) -> None:
        self._ids = ids
        self.tracks: tuple[ImageTrack, ...] = ()

    def step(
        self,
        stamp_ns: int,
        detections: Sequence[Detection],
        approaches: Sequence[Approach | None] | None = None,
        turn_px_s: float = 0.0,
    ) -> list[int]:
        """The track id of each detection of the picture taken at `stamp_ns`; `approaches` help new tracks.

        `turn_px_s`: how fast what is far moves to the right, because the ego turns to the left.
        """
        known = approaches if approaches is not None else [None] * len(detections)
        tracks = [track for track in self.tracks if 0 <= (stamp_ns - track.stamp_ns) / 1e9 <= KEEP_S]
        pairs = greedy(
            (cost, left, right)
            for left, track in enumerate(tracks)
            for right, detection in enumerate(detections)
            for cost in _costs(track, detection, stamp_ns, turn_px_s)
        )
        owners = [0] * len(detections)
        for left, right in pairs:
            tracks[left] = _follow(tracks[left], detections[right], stamp_ns, turn_px_s)
            owners[right] = tracks[left].track_id
        for right, detection in enumerate(detections):
            if not owners[right]:
                tracks.append(_born(next(self._ids), detection, stamp_ns, known[right]))
                owners[right] = tracks[-1].track_id
        self.tracks = tuple(tracks)
        return owners


def _size(detection: Detection) -> float:
    return math.sqrt(max(detection.width_px * detection.height_px, 1.0))


def _costs(track: ImageTrack, detection: Detection, stamp_ns: int, turn_px_s: float) -> Iterator[float]:
    dt = (stamp_ns - track.stamp_ns) / 1e9
    if track.kind != detection.kind or dt <= 0:
        return
    expected = track.at(stamp_ns, turn_px_s)
    size = math.exp(min(expected.log_size, 8.0))
    loose = 1.0 + REACH_GROWTH_PER_S * dt
    u, v = detection.centre_px
    reach_px = BLIND_SIZES * size + BLIND_PX if track.blind else REACH_SIZES * size + REACH_PX
    apart = math.hypot(u - expected.u_px, v - expected.v_px) / reach_px
    ratio = abs(math.log(_size(detection)) - expected.log_size) / math.log(SIZE_RATIO)
    if apart <= loose and ratio <= loose:
        yield apart + 0.5 * ratio


def _born(track_id: int, detection: Detection, stamp_ns: int, approach: Approach | None) -> ImageTrack:
    u, v = detection.centre_px
    growth = min(approach.growth_per_s, FASTEST_GROWTH_PER_S) if approach is not None else 0.0
    away = (u - approach.u_px, v - approach.v_px) if approach is not None else (0.0, 0.0)
    return ImageTrack(
        track_id=track_id,
        kind=detection.kind,
        u_px=u,
        v_px=v,
        log_size=math.log(_size(detection)),
        du_px_s=away[0] * growth,
        dv_px_s=away[1] * growth,
        growth_per_s=growth,
        stamp_ns=stamp_ns,
        blind=approach is None,
    )


def _follow(track: ImageTrack, detection: Detection, stamp_ns: int, turn_px_s: float) -> ImageTrack:
    """Alpha-beta steps; the second hit of a blind track sets the velocities outright."""
    dt = (stamp_ns - track.stamp_ns) / 1e9
    expected = track.at(stamp_ns, turn_px_s)
    gain = 1.0 if track.blind else VELOCITY_GAIN
    u, v = detection.centre_px
    off_u, off_v = u - expected.u_px, v - expected.v_px
    off_size = math.log(_size(detection)) - expected.log_size
    return replace(
        expected,
        u_px=expected.u_px + POSITION_GAIN * off_u,
        v_px=expected.v_px + POSITION_GAIN * off_v,
        log_size=expected.log_size + POSITION_GAIN * off_size,
        du_px_s=expected.du_px_s + gain * off_u / dt,
        dv_px_s=expected.dv_px_s + gain * off_v / dt,
        growth_per_s=min(expected.growth_per_s + gain * off_size / dt, FASTEST_GROWTH_PER_S),
        stamp_ns=stamp_ns,
        hits=track.hits + 1,
        blind=False,
    )
