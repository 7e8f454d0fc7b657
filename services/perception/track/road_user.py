"""Road users as sightings of one picture, and as what is known of them over time."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import msgspec

from proto.perception import ActorClass
from services.perception.range.sizes import PERSON, Body
from services.perception.track.kalman import Estimate, Fix


class OverGround(NamedTuple):
    """A velocity over ground in the ego's axes, and one sigma of either part."""

    ahead_mps: float
    across_mps: float
    sigma_mps: float


@dataclass(frozen=True, slots=True, eq=False)
class Sighting:
    """A detection placed in the ego frame: `fix` of the near surface, the body it seems to have."""

    kind: ActorClass
    fix: Fix
    score: float
    body: Body = PERSON
    across_sigma_mps: float = 2.0
    """Of its speed across, should it be new; it is taken to have none."""
    over_ground: OverGround | None = None
    """Where two sweeps tell it."""
    boxed: bool = True
    """A box says what its range is of, and may be wrong; False: its returns do, by moving together."""


class Tracked(msgspec.Struct, frozen=True, eq=False):
    """A track's state between two instants."""

    track_id: int
    kind: ActorClass
    estimate: Estimate
    body: Body
    born_ns: int
    seen_ns: int
    steady_ns: int
    """Since when it is seen without a break, and where it was expected."""
    placed_ns: int
    """When its range was last taken from what was seen, not from where it was expected."""
    hits: int = 1
    sure: float = 0.0
    """Mean score recently, pictures without it as 0."""
    confirmed: bool = False
    """It was sure enough to be published."""
    ranges: int = 0
    """How often its range was measured, not guessed from size or ground."""
    missed: bool = False
    """The last picture of its place did not show it."""
    ground_vx_mps: float | None = None
    ax_mps2: float = 0.0

    @property
    def ranged(self) -> bool:
        """Whether its range was measured at least once."""
        return self.ranges > 0


@dataclass(frozen=True, slots=True, eq=False)
class EgoState:
    """The ego at an instant; None: unknown."""

    speed_mps: float | None = None
    yaw_rate_radps: float | None = None
