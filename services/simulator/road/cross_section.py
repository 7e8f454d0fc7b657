"""Where lanes lie beside the spine: counted from the median outwards, mirrored after a changeover of sides."""

import math
from dataclasses import dataclass, field
from typing import Literal

import numpy as np

from services.simulator.road.spine import Array, Spine

Side = Literal["right", "left"]
Direction = Literal["forward", "oncoming"]

BULGE = 3.0
"""Before lanes change sides they draw apart, to this many times their distance from the spine, and cross at an angle."""
APPROACH_M, CROSSING_M = 35.0, 50.0
"""Length over which lanes draw apart (and together again), and over which they cross."""


@dataclass(frozen=True, slots=True, eq=False)
class CrossSection:
    """Lane offsets along the spine. Lanes of a direction are numbered from the median outwards."""

    spine: Spine
    lanes: int
    lane_width_m: float
    median_m: float
    side: Side = "right"
    changeover_m: float | None = None

    @property
    def half_width_m(self) -> float:
        """From the spine to the outer edge of the outermost lane."""
        return self.median_m / 2 + self.lanes * self.lane_width_m

    def keeps(self, s_m: float) -> Side:
        """The side of the road on which one drives at s; at the crossing itself the new one."""
        if self.changeover_m is None or s_m < self.changeover_m:
            return self.side
        return "left" if self.side == "right" else "right"

    def sign(self, s_m: float) -> float:
        """-1 where one keeps right (offsets are positive to the left), 1 where one keeps left."""
        return 1.0 if self.keeps(s_m) == "left" else -1.0

    def offset_m(self, s_m: Array, direction: Direction, lane: int) -> Array:
        """d of a lane's centre at each s."""
        plain = self.median_m / 2 + (lane + 0.5) * self.lane_width_m
        return plain * self._swing(s_m) * (1.0 if direction == "forward" else -1.0)

    def reach_m(self, s_m: float) -> float:
        """Half the width of the carriageway at s: wider where lanes change sides."""
        wide = self.half_width_m + (BULGE - 1.0) * self.half_width_m / 2
        if self.changeover_m is None:
            return self.half_width_m
        away = abs(s_m - self.changeover_m)
        share = min(max(1.0 - (away - CROSSING_M / 2) / APPROACH_M, 0.0), 1.0)
        return self.half_width_m + (wide - self.half_width_m) * (share * share * (3.0 - 2.0 * share))

    def span(self) -> tuple[float, float] | None:
        """Start and end of the changeover along the spine."""
        if self.changeover_m is None:
            return None
        reach = CROSSING_M / 2 + APPROACH_M
        return self.changeover_m - reach, self.changeover_m + reach

    def _swing(self, s_m: Array) -> Array:
        before = -1.0 if self.side == "right" else 1.0
        if self.changeover_m is None:
            return np.full_like(s_m, before)
        start, end = self.changeover_m - CROSSING_M / 2, self.changeover_m + CROSSING_M / 2
        apart = 1.0 + (BULGE - 1.0) * _smooth((s_m - start + APPROACH_M) / APPROACH_M)
        together = 1.0 + (BULGE - 1.0) * _smooth((end + APPROACH_M - s_m) / APPROACH_M)
        across = 1.0 - 2.0 * _smooth((s_m - start) / CROSSING_M)
        return before * across * np.minimum(apart, together)


@dataclass(frozen=True, slots=True, eq=False)
class LaneLine:
    """The centre of one lane, sampled at the spine's s: offset, its slope, and the lane's own curvature."""

    spine: Spine
    direction: Direction
    lane: int
    width_m: float
    offset_m: Array
    slope: Array
    curvature: Array
    _offsets: list[float] = field(init=False)
    _slopes: list[float] = field(init=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "_offsets", self.offset_m.tolist())
        object.__setattr__(self, "_slopes", self.slope.tolist())

    def offset_at(self, s_m: float) -> float:
        """d of the centre at s."""
        return self.spine.sample(self._offsets, s_m)

    def yaw_at(self, s_m: float) -> float:
        """Heading of the lane in its own driving direction, in the world frame."""
        lean = math.atan(self.spine.sample(self._slopes, s_m))
        return self.spine.yaw(min(max(s_m, 0.0), self.spine.length_m)) + lean + self.turn

    @property
    def turn(self) -> float:
        """Half a turn against the spine for oncoming lanes."""
        return 0.0 if self.direction == "forward" else math.pi

    def curvature_ahead(self, s_m: float, reach_m: float) -> float:
        """The sharpest curvature (1/m, unsigned) between s and s + reach along the spine."""
        low, high = sorted((int(s_m), int(s_m + reach_m) + 1))
        window = self.curvature[max(low, 0) : max(high, 1)]
        return float(window.max()) if len(window) else 0.0


def lane_line(section: CrossSection, direction: Direction, lane: int) -> LaneLine:
    """Sample one lane of a cross-section."""
    spine = section.spine
    offset = section.offset_m(spine.s_m, direction, lane)
    slope = np.gradient(offset, spine.s_m)
    curvature = np.abs(spine.curvature + np.gradient(slope, spine.s_m))
    return LaneLine(spine, direction, lane, section.lane_width_m, offset, slope, curvature)


def _smooth(share: Array) -> Array:
    clipped = np.clip(share, 0.0, 1.0)
    result: Array = clipped * clipped * (3.0 - 2.0 * clipped)
    return result
