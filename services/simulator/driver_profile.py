"""Drivers differ: one is drawn per seed from a population.

Reaction to a spoken message and to something unexpected: log-normal, median 1.2 s (Green 2000 gives 1.25 s for
unexpected but common signals). Compliance, habitual excess and missed signs are ours, provisional until calibrated.
"""

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True, slots=True, kw_only=True)
class DriverProfile:
    """One driver."""

    reaction_s: float = 1.2
    compliance: float = 0.9
    """Probability that he does what a message says."""
    speed_bias: float = 1.06
    """What he drives in ratio to the limit that he believes in."""
    notices: float = 0.75
    """Probability of noticing a sign of a kind that he knows."""
    misses_stop: float = 0.08
    distracted_every_s: float = 25.0
    distracted_for_s: float = 2.0
    headway_s: float = 1.3
    wet_slowdown: float = 0.97
    """What he makes of a wet road by himself: too little."""
    seed: int = 0


def draw_driver(seed: int) -> DriverProfile:
    """The driver of a seed."""
    chance = np.random.default_rng([seed, 21])
    return DriverProfile(
        reaction_s=float(np.clip(np.exp(chance.normal(np.log(1.2), 0.25)), 0.7, 2.4)),
        compliance=float(chance.beta(18, 2.5)),
        speed_bias=float(np.clip(chance.normal(1.07, 0.06), 0.94, 1.25)),
        notices=float(chance.beta(12, 4)),
        misses_stop=float(chance.beta(2, 20)),
        distracted_every_s=float(chance.uniform(15.0, 40.0)),
        distracted_for_s=float(chance.uniform(1.0, 3.0)),
        headway_s=float(np.clip(chance.normal(1.3, 0.3), 0.8, 2.0)),
        wet_slowdown=float(chance.uniform(0.92, 1.0)),
        seed=seed,
    )


class Attention:
    """When the driver looks elsewhere: episodes drawn ahead of the drive, so that they do not depend on it."""

    def __init__(self, profile: DriverProfile, horizon_s: float = 3600.0) -> None:
        chance = np.random.default_rng([profile.seed, 22])
        self._episodes: list[tuple[float, float]] = []
        at = 0.0
        while at < horizon_s:
            at += 3.0 + float(chance.exponential(profile.distracted_every_s))
            lasts = float(np.clip(chance.exponential(profile.distracted_for_s), 0.4, 6.0))
            self._episodes.append((at, at + lasts))
            at += lasts

    def back_on_the_road_s(self, time_s: float) -> float:
        """The first instant from `time_s` on at which he looks ahead."""
        for start, end in self._episodes:
            if start <= time_s < end:
                return end
            if start > time_s:
                break
        return time_s

    def distracted(self, time_s: float) -> bool:
        """Whether he looks elsewhere now."""
        return self.back_on_the_road_s(time_s) > time_s


class Dice:
    """Yes-or-no draws that depend on the seed and on what is asked, not on when."""

    def __init__(self, seed: int) -> None:
        self._seed = seed

    def says(self, probability: float, *what: int) -> bool:
        """Whether the event happens."""
        return bool(np.random.default_rng([self._seed, 23, *what]).random() < probability)
