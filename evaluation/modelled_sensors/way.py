"""The way that the ego went, over the ground: what stands by the road shows from there."""

import math
from itertools import pairwise
from typing import NamedTuple

from evaluation.modelled_sensors.card import Ghost
from evaluation.modelled_sensors.sight import Point, turn_rad


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

    def place(self, ahead_m: float, left_m: float) -> Point:
        """The one that lies so far ahead, and to the left, of where it came to."""
        c, s = math.cos(self.heading_rad), math.sin(self.heading_rad)
        return self.x_m + ahead_m * c - left_m * s, self.y_m + ahead_m * s + left_m * c

    def seen(self, place: Point) -> Point:
        """How far ahead of there a place lies, and to the left."""
        dx, dy = place[0] - self.x_m, place[1] - self.y_m
        c, s = math.cos(self.heading_rad), math.sin(self.heading_rad)
        return dx * c + dy * s, dy * c - dx * s


def recorded_ways(ghost: Ghost) -> tuple[Way, ...]:
    """Where the ego was at each recorded box, from where it was at the first."""
    found = [Way()]
    for last, now in pairwise(ghost.boxes):
        found.append(found[-1].on(now.driven_m - last.driven_m, now.turned_rad))
    return tuple(found)
