"""Kinds of drivers: the one of the seed, one that does nothing, and the populations of `drivemcp evaluate population`.

All but the absent one are the driver of the seed, changed in this:

- `attentive`: never looks away.
- `obedient`: attentive, follows every word, and drives no faster than the limit believed in. Signs and lines are missed as by the driver
  of the seed: what is missed has to be told.
- `startled`: does nothing before having reacted, to something unexpected in 1.5 s in the median (Green 2000, Transp. Hum. Factors 2(3):
  surprise), and brakes too weakly. Deceleration before an unexpected object: most drivers above 4.5 m/s2, 90 % above 3.4 m/s2 (Fambro,
  Fitzpatrick and Koppa 1997, NCHRP report 400); taken for a normal with that median and that tenth percentile, cut to 2.5 to 8 m/s2.
- `slow`: as `startled`, and every hazard comes while the eyes are off the road for 2 s more, the longest glance that NHTSA's visual-manual
  driver distraction guidelines of 2013 allow: 3.5 s in the median. A warning brings the eyes back.
"""

import math
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from services.simulator.driver.driver import Advice, Driver, DriverView, Wish, pedals
from services.simulator.driver.profile import REACTION_SPREAD, DriverProfile, draw_driver

DriverKind = Literal["drawn", "absent", "attentive", "obedient", "startled", "slow"]
"""`drawn`: the driver of the seed, from the population; `absent`: a driver that keeps the pedals as they are; others as above."""
SURPRISED_S = 1.5
BRAKES_MPS2, BRAKES_SPREAD_MPS2 = 4.5, (4.5 - 3.4) / 1.2816
"""Median, and standard deviation: the tenth percentile of a normal lies 1.2816 of them below."""
GLANCE_S = 2.0


@dataclass(slots=True)
class AbsentDriver(Driver):
    """Keeps the pedals of a car at constant speed, or at a constant acceleration, hears nothing and looks at nothing."""

    asks_mps2: float = 0.0

    def hear(self, advice: Advice, time_s: float) -> None:
        """A message changes nothing."""

    def drive(self, view: DriverView, dt: float) -> Wish:
        """The wish of every step."""
        return pedals(self.asks_mps2)

    def distracted(self, time_s: float) -> bool:
        """Always."""
        return True


def new_driver(kind: DriverKind, seed: int, believed_mps: float | None, absent_mps2: float = 0.0) -> Driver:
    """The driver of a kind and a seed, with the limit believed in at the start; an absent one with a foot that asks for that."""
    if kind == "absent":
        return AbsentDriver(profile_of(kind, seed), believed_mps, asks_mps2=absent_mps2)
    return Driver(profile_of(kind, seed), believed_mps)


def profile_of(kind: DriverKind, seed: int) -> DriverProfile:
    """The profile of a kind and a seed."""
    drawn = draw_driver(seed)
    if kind in ("drawn", "absent"):
        return drawn
    attentive = replace(drawn, distracted_every_s=math.inf)
    if kind == "attentive":
        return attentive
    if kind == "obedient":
        return replace(attentive, compliance=1.0, speed_bias=min(1.0, drawn.speed_bias))
    chance = np.random.default_rng([seed, 24])
    reaction_s = float(np.clip(np.exp(chance.normal(np.log(SURPRISED_S), REACTION_SPREAD)), 0.9, 3.0))
    brakes_mps2 = float(np.clip(chance.normal(BRAKES_MPS2, BRAKES_SPREAD_MPS2), 2.5, 8.0))
    glance_s = GLANCE_S if kind == "slow" else 0.0
    return replace(attentive, reaction_s=reaction_s, unready_mps2=0.0, brakes_mps2=brakes_mps2, glance_s=glance_s)
