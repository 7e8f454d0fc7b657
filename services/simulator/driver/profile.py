"""Drivers differ: one is drawn per seed from a population, the same one for every method that is compared.

What is drawn, and from where (a, b of a beta; mean, spread of a normal):

- Reaction to a message, to a lead or to something unexpected: log-normal, median 1.25 s (Green 2000, Transp. Hum. Factors
  2(3): unexpected but common signals, such as a lead's brake lights), spread 0.26, which is what parts Lerner's mean of
  1.5 s from the 85th percentile of 1.9 s (1993, Proc. Hum. Factors Ergon. Soc. 37(2)). Cut to 0.7 to 2.5 s, the latter the
  US design value.
- Habitual speed in ratio to the believed limit: normal, 1.0 and 0.11. Of cars on British motorways in 2022 45 % were
  above the limit and 8 % by 10 mph or more, on 30 mph roads 50 % and 5 % (Department for Transport, Vehicle speed
  compliance statistics). That is a mean of 0.99 with a spread of 0.11, and 1.0 with 0.20; the smaller spread is taken.
- Signs noticed: mean 0.70. A speed limit sign just passed is recalled by 63 to 73 % of drivers (Schirokoff and Luoma
  2005), the limit on a road known by 74 % (Cameron 1980, TRRL SR 608). How much drivers differ is ours.
- Lines missed: mean 0.05, ours. One in five drivers admits to running one or more of the last ten red lights (Porter and
  Berry 2001, Accid. Anal. Prev. 33), which is about 0.02 a light; at stop signs it is more.
- Headway: normal, 1.4 and 0.3 s, ours; in dense traffic drivers keep 1 to 2 s at all speeds (Ayres et al. 2001, IEEE
  Intell. Transp. Syst. Conf.).
- Slowing on a wet road: 0.91 to 0.98. Free-flow speed falls by 2 to 9 % from light to heavy rain (Hranac et al. 2006,
  FHWA-HOP-07-073).
- Looking away: every 15 to 40 s, for 1 to 3 s in the mean, ours; off-road glances beyond 1.7 s are what parts crashes
  and near-crashes from normal driving (Liang, Lee and Horrey 2014, Proc. Hum. Factors Ergon. Soc. 58(1)).
- Compliance with a message: mean 0.88, ours. Published trials of speed assistance tell how often it is overridden and by
  which drivers, not how often a spoken word is followed. It is drawn once for each limit and each other topic, for all of a drive.

Independent of each other, which is ours too: drivers who drive fast override more (Lai and Carsten 2012).
"""

import math
from dataclasses import dataclass

import numpy as np

from services.simulator.scenario.law import Post
from services.simulator.scenario.plan import Scenario

MEDIAN_REACTION_S, REACTION_SPREAD = 1.25, 0.26
"""Median, and standard deviation of the logarithm."""


@dataclass(frozen=True, slots=True, kw_only=True)
class DriverProfile:
    """One driver."""

    reaction_s: float = 1.2
    compliance: float = 0.9
    """Probability that the driver does what a message says."""
    speed_bias: float = 1.06
    """What the driver drives in ratio to the limit that the driver believes in."""
    notices: float = 0.75
    """Probability of noticing a sign of a kind that the driver knows."""
    misses_stop: float = 0.08
    distracted_every_s: float = 25.0
    distracted_for_s: float = 2.0
    headway_s: float = 1.3
    wet_slowdown: float = 0.97
    """The share of the dry speed that the driver keeps to on a wet road without advice; the driver slows down too little."""
    unready_mps2: float = -2.5
    """The hardest that the driver brakes for a vehicle ahead before having reacted."""
    brakes_mps2: float = math.inf
    """How hard the driver brakes at most."""
    glance_s: float = 0.0
    """How long the driver's eyes are still off the road when something unexpected comes, unless the driver is warned."""
    seed: int = 0


def draw_driver(seed: int) -> DriverProfile:
    """The driver of a seed."""
    chance = np.random.default_rng([seed, 21])
    return DriverProfile(
        reaction_s=float(np.clip(np.exp(chance.normal(np.log(MEDIAN_REACTION_S), REACTION_SPREAD)), 0.7, 2.5)),
        compliance=float(chance.beta(18, 2.5)),
        speed_bias=float(np.clip(chance.normal(1.0, 0.11), 0.8, 1.3)),
        notices=float(chance.beta(14, 6)),
        misses_stop=float(chance.beta(2, 38)),
        distracted_every_s=float(chance.uniform(15.0, 40.0)),
        distracted_for_s=float(chance.uniform(1.0, 3.0)),
        headway_s=float(np.clip(chance.normal(1.4, 0.3), 0.8, 2.2)),
        wet_slowdown=float(chance.uniform(0.91, 0.98)),
        seed=seed,
    )


class Attention:
    """When the driver looks elsewhere: episodes drawn ahead of the drive, so that they do not depend on it."""

    def __init__(self, profile: DriverProfile, horizon_s: float = 3600.0) -> None:
        chance = np.random.default_rng([profile.seed, 22])
        self._episodes: list[tuple[float, float]] = []
        at = 0.0 if math.isfinite(profile.distracted_every_s) else horizon_s
        while at < horizon_s:
            at += 3.0 + float(chance.exponential(profile.distracted_every_s))
            lasts = float(np.clip(chance.exponential(profile.distracted_for_s), 0.4, 6.0))
            self._episodes.append((at, at + lasts))
            at += lasts

    def back_on_the_road_s(self, time_s: float) -> float:
        """The first instant from `time_s` on at which the driver looks ahead."""
        for start, end in self._episodes:
            if start <= time_s < end:
                return end
            if start > time_s:
                break
        return time_s

    def distracted(self, time_s: float) -> bool:
        """Whether the driver looks elsewhere now."""
        return self.back_on_the_road_s(time_s) > time_s


class Dice:
    """Yes-or-no draws that depend on the seed and on what is asked, not on when."""

    def __init__(self, seed: int) -> None:
        self._seed = seed

    def says(self, probability: float, *what: int) -> bool:
        """Whether the event happens."""
        return bool(np.random.default_rng([self._seed, 23, *what]).random() < probability)


_WORDS = {f"plate:when_wet:{language}": language for language in ("de", "en", "fr", "nl", "pl")}
_FOREIGN_TO_BRITAIN = frozenset({"town_entry", "town_exit", "all_end", "limit_end"})
_FOREIGN_TO_OTHERS = frozenset({"national"})


def understands(scenario: Scenario, post: Post) -> bool:
    """Whether the driver knows what the post demands; a plate that the driver cannot read makes the whole post unclear."""
    return all(_known(scenario, post, code) for code in post.codes)


def _known(scenario: Scenario, post: Post, code: str) -> bool:
    if code in _WORDS:
        return scenario.driver_language == _WORDS[code]
    word = code.partition(":")[0]
    if scenario.driver_country == "GBR":
        return word not in _FOREIGN_TO_BRITAIN
    # Numbers in miles per hour mean nothing to the driver, who would drive on as before.
    miles = post.country == "GBR" and word in ("limit", "zone", "led")
    return not miles and word not in _FOREIGN_TO_OTHERS
