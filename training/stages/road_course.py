"""Where a random stage plays: the road's course and cross-section, and what each split may use."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

import numpy as np

from services.simulator.render.models.actors import FAMILIES
from services.simulator.scene.scene import Pose

Split = Literal["train", "test"]
FONTS = 8
ROAD_M = 420.0


@dataclass(frozen=True, slots=True)
class Place:
    """The road's course and cross-section: lanes on each side of the middle, in the driver's country."""

    bend_per_m: float
    lane_m: float
    lanes: int  # in each direction
    country: str
    town: bool
    pavement_m: float
    verge_m: float
    side: float  # +1: we drive on the right, so that our kerb lies at negative lateral offsets
    origin: Pose

    def at(self, s: float, lateral: float, turn: float = 0.0, z: float = 0.0) -> Pose:
        """A pose ``s`` metres on, ``lateral`` metres to the left of the middle, turned from the road's course."""
        k = self.bend_per_m
        heading = k * s
        x = math.sin(heading) / k if abs(k) > 1e-9 else s
        y = (1 - math.cos(heading)) / k if abs(k) > 1e-9 else 0.0
        x, y = x - math.sin(heading) * lateral, y + math.cos(heading) * lateral
        c, sn = math.cos(self.origin.yaw_rad), math.sin(self.origin.yaw_rad)
        return Pose(
            x_m=self.origin.x_m + c * x - sn * y,
            y_m=self.origin.y_m + sn * x + c * y,
            z_m=z,
            yaw_rad=self.origin.yaw_rad + heading + turn,
        )

    @property
    def edge_m(self) -> float:
        """Half the carriageway's width."""
        return self.lane_m * self.lanes + 0.35

    def line(self, lateral: float, start: float = -60.0, end: float = ROAD_M) -> np.ndarray:
        """A polyline along the road (N, 2)."""
        poses = [self.at(s, lateral) for s in np.arange(start, end + 0.1, 5.0)]
        return np.array([(pose.x_m, pose.y_m) for pose in poses])


def font(rng: np.random.Generator, split: Split) -> int:
    """A lettering that the split may use."""
    return int(rng.integers(FONTS - 1)) if split == "train" else FONTS - 1


def family(rng: np.random.Generator, split: Split) -> int:
    """A mesh family that the split may use."""
    return int(rng.integers(FAMILIES - 1)) if split == "train" else FAMILIES - 1
