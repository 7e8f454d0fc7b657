"""The reference line of a road: straights and arcs, sampled once; places are (s along, d to the left) in metres."""

import math
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
STEP_M = 1.0


@dataclass(frozen=True, slots=True)
class Bend:
    """One piece of the line: its length and its curvature (1/m, left positive; 0 is straight)."""

    length_m: float
    curvature: float = 0.0


@dataclass(frozen=True, slots=True, eq=False)
class Spine:
    """Samples every ``STEP_M``: arc length, place, heading (not wrapped) and curvature, each of shape (N,)."""

    s_m: Array
    x_m: Array
    y_m: Array
    yaw_rad: Array
    curvature: Array
    _yaws: list[float] = field(init=False)
    _xs: list[float] = field(init=False)
    _ys: list[float] = field(init=False)
    _per_m: float = field(init=False)

    def __post_init__(self) -> None:
        # Single places are asked for thousands of times a second; lists answer ten times faster than arrays.
        for name, values in (("_yaws", self.yaw_rad), ("_xs", self.x_m), ("_ys", self.y_m)):
            object.__setattr__(self, name, values.tolist())
        object.__setattr__(self, "_per_m", (len(self.s_m) - 1) / float(self.s_m[-1]))

    def sample(self, values: list[float], s_m: float) -> float:
        """One of this line's sampled quantities at s, evenly between samples, held at the ends."""
        at = s_m * self._per_m
        if at <= 0.0:
            return values[0]
        low = int(at)
        if low >= len(values) - 1:
            return values[-1]
        here = values[low]
        return here + (values[low + 1] - here) * (at - low)

    @property
    def length_m(self) -> float:
        """Length of the line."""
        return float(self.s_m[-1])

    def yaw(self, s_m: float) -> float:
        """Heading of the line at s."""
        return self.sample(self._yaws, s_m)

    def place(self, s_m: float, d_m: float = 0.0) -> tuple[float, float]:
        """World x and y of (s, d); before the start and after the end the line goes on straight."""
        inside = min(max(s_m, 0.0), self.length_m)
        yaw, over = self.yaw(inside), s_m - inside
        x = self.sample(self._xs, inside) + over * math.cos(yaw) - d_m * math.sin(yaw)
        y = self.sample(self._ys, inside) + over * math.sin(yaw) + d_m * math.cos(yaw)
        return x, y

    def places(self, s_m: Array, d_m: Array) -> Array:
        """World points (N, 2) of many (s, d) inside the line."""
        yaw = np.interp(s_m, self.s_m, self.yaw_rad)
        x = np.interp(s_m, self.s_m, self.x_m) - d_m * np.sin(yaw)
        y = np.interp(s_m, self.s_m, self.y_m) + d_m * np.cos(yaw)
        return np.stack([x, y], axis=1)

    def project(self, x_m: float, y_m: float) -> tuple[float, float]:
        """(s, d) of the nearest point of the line."""
        near = int(np.argmin((self.x_m - x_m) ** 2 + (self.y_m - y_m) ** 2))
        yaw = float(self.yaw_rad[near])
        dx, dy = x_m - float(self.x_m[near]), y_m - float(self.y_m[near])
        along, across = dx * math.cos(yaw) + dy * math.sin(yaw), dy * math.cos(yaw) - dx * math.sin(yaw)
        return self._on_arc(near, along, across)

    def _on_arc(self, near: int, along: float, across: float) -> tuple[float, float]:
        # The piece around a sample is an arc: going straight for half a step would jump sideways in a bend.
        bend = float(self.curvature[near])
        if abs(bend) < 1e-6 or near in (0, len(self.s_m) - 1):
            return float(self.s_m[near]) + along, across
        radius = 1.0 / bend
        turned = math.atan2(along * math.copysign(1, bend), (radius - across) * math.copysign(1, bend))
        return float(self.s_m[near]) + turned * radius, radius - math.copysign(math.hypot(along, radius - across), bend)


def build_spine(bends: tuple[Bend, ...]) -> Spine:
    """Sample straights and arcs, starting at the origin along x."""
    ends = np.r_[0.0, np.cumsum([bend.length_m for bend in bends])]
    turned = np.r_[0.0, np.cumsum([bend.length_m * bend.curvature for bend in bends])]
    s = np.linspace(0.0, float(ends[-1]), round(float(ends[-1]) / STEP_M) + 1)
    piece = np.clip(np.searchsorted(ends, s, side="right") - 1, 0, len(bends) - 1)
    middle_yaw, step = np.interp((s[1:] + s[:-1]) / 2, ends, turned), np.diff(s)
    x, y = np.r_[0.0, np.cumsum(np.cos(middle_yaw) * step)], np.r_[0.0, np.cumsum(np.sin(middle_yaw) * step)]
    return Spine(s, x, y, np.interp(s, ends, turned), np.array([bend.curvature for bend in bends])[piece])
