"""Tracks of signs, panels and lights in one camera's pictures, so that their readings can be joined over time."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

from proto.perception import ObjectClass
from services.perception.assignment import greedy
from services.perception.detection import Detection

KEEP_S = 0.8
"""A track unseen for longer has ended: at 5 pictures a second three of them may fail."""
REACH_SIZES = 1.2
"""How far from its expected place a box may lie, in box sizes ..."""
REACH_PX = 6.0
"""... and in pixels beside, for the car's nodding."""
REACH_GROWTH_PER_S = 2.0
SIZE_RATIO = 1.8
POSITION_GAIN, VELOCITY_GAIN = 0.8, 0.5


@dataclass(frozen=True, slots=True, kw_only=True)
class ImageTrack:
    """Centre and logarithm of the size with their changes per second, at `stamp_ns`."""

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

    def at(self, stamp_ns: int) -> ImageTrack:
        """Where it is expected then."""
        dt = (stamp_ns - self.stamp_ns) / 1e9
        return replace(
            self,
            u_px=self.u_px + self.du_px_s * dt,
            v_px=self.v_px + self.dv_px_s * dt,
            log_size=self.log_size + self.growth_per_s * dt,
        )


class ImageTracker:
    """One for each camera; ids come from a source shared with all other trackers."""

    def __init__(self, ids: Iterator[int]) -> None:
        self._ids = ids
        self.tracks: tuple[ImageTrack, ...] = ()

    def step(self, stamp_ns: int, detections: Sequence[Detection]) -> list[int]:
        """The track id of each detection of the picture taken at `stamp_ns`."""
        tracks = [track for track in self.tracks if (stamp_ns - track.stamp_ns) / 1e9 <= KEEP_S]
        pairs = greedy(
            (cost, left, right)
            for left, track in enumerate(tracks)
            for right, detection in enumerate(detections)
            for cost in _costs(track, detection, stamp_ns)
        )
        owners = [0] * len(detections)
        for left, right in pairs:
            tracks[left] = _follow(tracks[left], detections[right], stamp_ns)
            owners[right] = tracks[left].track_id
        for right, detection in enumerate(detections):
            if not owners[right]:
                tracks.append(_born(next(self._ids), detection, stamp_ns))
                owners[right] = tracks[-1].track_id
        self.tracks = tuple(tracks)
        return owners


def _size(detection: Detection) -> float:
    return math.sqrt(max(detection.width_px * detection.height_px, 1.0))


def _costs(track: ImageTrack, detection: Detection, stamp_ns: int) -> Iterator[float]:
    dt = (stamp_ns - track.stamp_ns) / 1e9
    if track.kind != detection.kind or dt <= 0:
        return
    expected = track.at(stamp_ns)
    size = math.exp(min(expected.log_size, 8.0))
    loose = 1.0 + (REACH_GROWTH_PER_S * dt if track.hits < 3 else REACH_GROWTH_PER_S * dt / 2)
    u, v = detection.centre_px
    apart = math.hypot(u - expected.u_px, v - expected.v_px) / (REACH_SIZES * size + REACH_PX)
    ratio = abs(math.log(_size(detection)) - expected.log_size) / math.log(SIZE_RATIO)
    if apart <= loose and ratio <= loose:
        yield apart + 0.5 * ratio


def _born(track_id: int, detection: Detection, stamp_ns: int) -> ImageTrack:
    u, v = detection.centre_px
    return ImageTrack(
        track_id=track_id,
        kind=detection.kind,
        u_px=u,
        v_px=v,
        log_size=math.log(_size(detection)),
        stamp_ns=stamp_ns,
    )


def _follow(track: ImageTrack, detection: Detection, stamp_ns: int) -> ImageTrack:
    """Alpha-beta steps; the second hit sets the velocities outright."""
    dt = (stamp_ns - track.stamp_ns) / 1e9
    expected = track.at(stamp_ns)
    gain = 1.0 if track.hits == 1 else VELOCITY_GAIN
    u, v = detection.centre_px
    off_u, off_v = u - expected.u_px, v - expected.v_px
    off_size = math.log(_size(detection)) - expected.log_size
    return replace(
        expected,
        u_px=expected.u_px + POSITION_GAIN * off_u,
        v_px=expected.v_px + POSITION_GAIN * off_v,
        log_size=expected.log_size + POSITION_GAIN * off_size,
        du_px_s=track.du_px_s + gain * off_u / dt,
        dv_px_s=track.dv_px_s + gain * off_v / dt,
        growth_per_s=track.growth_per_s + gain * off_size / dt,
        stamp_ns=stamp_ns,
        hits=track.hits + 1,
    )
