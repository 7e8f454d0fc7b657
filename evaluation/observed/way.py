"""The way that the ego went, over the ground: what stands by the road shows from there."""

import math
from itertools import pairwise
from typing import NamedTuple

from evaluation.observed.card import Ghost
from evaluation.observed.sight import turn_rad


class Way(NamedTuple):
    """Where the ego came to from where it began."""

    driven_m: float = 0.0
    x_m: float = 0.0
    y_m: float = 0.0
    heading_rad: float = 0.0

    def on(self, step_m: float, heading_rad: float) -> "Way":
        """One step farther, to that heading; in between it turns evenly."""
        middle_rad = self.heading_rad + turn_rad(self.heading_rad, heading_rad) / 2
        x_m, y_m = self.x_m + step_m * math.cos(middle_rad), self.y_m + step_m * math.sin(middle_rad)
        return Way(self.driven_m + step_m, x_m, y_m, heading_rad)

    def left_of_m(self, before: "Way") -> float:
        """How far to the left of the line along which it looked before."""
        dx, dy = self.x_m - before.x_m, self.y_m - before.y_m
        return dy * math.cos(before.heading_rad) - dx * math.sin(before.heading_rad)


def recorded_left_m(ghost: Ghost) -> tuple[float, ...]:
    """How far to the left of where it looked first the ego was at each recorded box."""
    at, found = Way(), [0.0]
    for last, now in pairwise(ghost.boxes):
        at = at.on(now.driven_m - last.driven_m, now.turned_rad)
        found.append(at.left_of_m(Way()))
    return tuple(found)
