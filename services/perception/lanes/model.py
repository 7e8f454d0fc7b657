"""Which lane a point lies in: from the map's lanes, or a straight corridor before the ego where there is no map."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from proto.perception import Lanes
from proto.sensors import LanePath, MapView

Floats = NDArray[np.float64]
CORRIDOR_ID = "corridor"
CORRIDOR_WIDTH_M = 3.5


class _Course(NamedTuple):
    """The pieces of a polyline: where each starts (N, 2), its direction (N, 2), its length, and from where to where along it
    feet may lie (N each, metres); its ends are prolonged."""

    start: Floats
    unit: Floats
    length: Floats
    low: Floats
    high: Floats


@dataclass(frozen=True, slots=True, eq=False)
class Lane:
    """A lane's centre line (N, 2) from near to far in the ego frame."""

    lane_id: str
    centre: Floats
    width_m: float
    is_ego: bool = False
    oncoming: bool = False
    _course: _Course = field(init=False, repr=False)
    _ego_m: float = field(init=False, repr=False)
    """Along the line, to the ego's foot."""

    def __post_init__(self) -> None:
        object.__setattr__(self, "_course", _course(self.centre))
        object.__setattr__(self, "_ego_m", _foot(self._course, 0.0, 0.0)[0])

    def place(self, x_m: float, y_m: float) -> tuple[float, float]:
        """Distance along the lane from the ego's foot point and offset to its left; its ends run on straight."""
        along, left = _foot(self._course, x_m, y_m)
        return along - self._ego_m, left


@dataclass(frozen=True, slots=True, eq=False)
class LaneModel:
    """The lanes around the ego and which of them is its own."""

    lanes: tuple[Lane, ...]
    ego: Lane
    source: MapView | None

    def lane_of(self, x_m: float, y_m: float) -> Lane | None:
        """The lane whose middle is nearest, if the point lies in it or less than a quarter of its width beside it."""
        offsets = [(abs(lane.place(x_m, y_m)[1]), index) for index, lane in enumerate(self.lanes)]
        offset, index = min(offsets)
        return self.lanes[index] if offset <= 0.75 * self.lanes[index].width_m else None

    def message(self) -> Lanes:
        """The ego's lane on the wire."""
        offset = self.ego.place(0.0, 0.0)[1]
        if self.source is None:
            return Lanes(
                ego_lane_id=CORRIDOR_ID,
                lane_count=1,
                lane_width_m=CORRIDOR_WIDTH_M,
                lateral_offset_m=offset,
                source="corridor",
            )
        stop = min(
            (line for line in self.source.stop_lines if line.distance_m > -1.0),
            key=lambda line: line.distance_m,
            default=None,
        )
        return Lanes(
            ego_lane_id=self.ego.lane_id,
            lane_count=sum(not lane.oncoming for lane in self.lanes),
            lane_width_m=self.ego.width_m,
            lateral_offset_m=offset,
            source="map",
            stop_line_distance_m=stop.distance_m if stop else None,
            stop_line_kind=stop.kind if stop else "",
            junction_distance_m=self.source.junction_distance_m,
            segment_id=self.source.segment_id,
            road_class=self.source.road_class,
            carriageways_separated=self.source.carriageways_separated,
        )


def lane_model(view: MapView | None) -> LaneModel:
    """Lanes of a map view; the straight corridor where it is absent or holds no usable lane."""
    lanes = tuple(_lane(path) for path in view.lanes if _usable(path)) if view is not None else ()
    if not lanes:
        return LaneModel((_CORRIDOR,), _CORRIDOR, None)
    marked = [lane for lane in lanes if lane.is_ego]
    ego = marked[0] if marked else min(lanes, key=lambda lane: abs(lane.place(0.0, 0.0)[1]))
    return LaneModel(lanes, ego, view)


def _usable(path: LanePath) -> bool:
    points = np.array(path.points, dtype=np.float64).reshape(-1, 2) if path.points else np.zeros((0, 2))
    return len(points) >= 2 and bool(np.isfinite(points).all()) and 1.0 < path.width_m < 20.0


def _lane(path: LanePath) -> Lane:
    centre = np.array(path.points, dtype=np.float64)
    return Lane(path.lane_id, centre, path.width_m, is_ego=path.is_ego, oncoming=path.oncoming)


def _course(line: Floats) -> _Course:
    start, step = line[:-1], np.diff(line, axis=0)
    length = np.maximum(np.hypot(step[:, 0], step[:, 1]), 1e-9)
    low, high = np.zeros(len(length)), length.copy()
    low[0], high[-1] = -np.inf, np.inf
    return _Course(start, step / length[:, None], length, low, high)


def _foot(course: _Course, x_m: float, y_m: float) -> tuple[float, float]:
    """Arc length of the nearest point of a polyline (its ends prolonged) and the offset to its left."""
    start, unit, length, low, high = course
    away = np.array([x_m, y_m]) - start
    held = np.minimum(np.maximum((away * unit).sum(axis=1), low), high)
    gap = np.hypot(*(away - held[:, None] * unit).T)
    index = int(gap.argmin())
    left = unit[index, 0] * away[index, 1] - unit[index, 1] * away[index, 0]
    beside = float(np.copysign(gap[index], left)) if gap[index] > 1e-9 else 0.0
    return float(length[:index].sum() + held[index]), beside


_CORRIDOR = Lane(CORRIDOR_ID, np.array([[0.0, 0.0], [100.0, 0.0]]), CORRIDOR_WIDTH_M, is_ego=True)
