"""The friction interval that all observations together leave.

Its lower end is the least of what water, cold, snow, the look of the surface and measured friction allow; its upper
end falls only by what a sure source vouches for and none denies.
"""

from collections.abc import Mapping, Sequence
from typing import NamedTuple

from services.weather.observations.claim import assumed, share
from services.weather.observations.observation import Interval, Observation, RoadState, trust
from services.weather.road import friction, frost
from services.weather.road.car import Car
from services.weather.road.water_film import WET_FROM_MM, film_claims, says_dry, surely_at_least_mm

MEASURED_SHARE = 0.9
"""Measured friction is counted on to this share: the next metres differ (ours)."""
WARM_FOR_SNOW_C = 3.0
"""On a road surely warmer than this, falling snow melts to a film."""

# Friction on a surface that is seen to be frozen.
_LOOKS: Mapping[RoadState, Interval] = {
    "slush": Interval(0.15, 0.50),
    "snow": Interval(0.12, friction.SNOW_HIGH),
    "packed_snow": Interval(0.12, 0.40),
    "frost": friction.FROST,
    "ice": friction.ICE,
}
_BARE: tuple[RoadState, ...] = ("dry", "damp", "wet")


class Grip(NamedTuple):
    """The fused interval, the sources that spoke, and what they said."""

    mu: Interval
    planned_low: float
    """Its lower end at the speed that is planned for."""
    sources: tuple[str, ...]
    notes: tuple[str, ...]
    wet: bool | None
    contradiction: bool


class _Ground(NamedTuple):
    """What is to be counted on under the wheels."""

    film_mm: float
    cold: frost.Cold
    coldest_c: float | None
    frost: bool


def fuse(
    observations: Sequence[Observation], car: Car, planned_mps: float, now_ns: int, *, drying: bool, left_mm: float
) -> Grip:
    """Grip at the car's speed, and its lower end at the planned one. Nothing known: careful, and wide."""
    ground = _ground(observations, now_ns, drying=drying, left_mm=left_mm)
    falling = _snow_falls(observations, ground)
    at_any_speed = min(
        _cold_low(ground),
        friction.snow_low(frost.warmest_c(observations, now_ns)) if falling else 1.0,
        *(look.low for each in observations if (look := _look(each)) is not None),
        *(MEASURED_SHARE * each.mu.low for each in observations if each.mu is not None),
    )
    low, planned_low = (min(_wet_low(ground, car, mps), at_any_speed) for mps in (car.speed, planned_mps))
    high = max(low, _high(observations, now_ns))
    contradiction = _contradict(observations, Interval(low, high))
    return Grip(
        Interval(low, high),
        planned_low,
        tuple(dict.fromkeys(each.source for each in observations if _speaks(each))),
        tuple(_notes(observations, ground, falling=falling)),
        _is_wet(observations, ground),
        contradiction,
    )


def _ground(observations: Sequence[Observation], now_ns: int, *, drying: bool, left_mm: float) -> _Ground:
    film_mm = assumed(film_claims(observations, now_ns, drying=drying, left_mm=left_mm), friction.UNKNOWN_FILM_MM)
    return _Ground(
        film_mm=film_mm,
        cold=frost.cold(observations, now_ns),
        coldest_c=frost.coldest_c(observations, now_ns),
        frost=frost.frost_possible(observations, now_ns, drying=drying),
    )


def _look(seen: Observation) -> Interval | None:
    """The friction of a surface that is seen to be frozen; None for others."""
    return _LOOKS.get(seen.road) if seen.road is not None else None


def _wet_low(ground: _Ground, car: Car, speed_mps: float) -> float:
    tread_mm = friction.LEGAL_TREAD_MM if car.tread_mm is None else car.tread_mm
    return friction.wet_low(ground.film_mm, speed_mps, car.tyre_low or 0.0, tread_mm)


def _cold_low(ground: _Ground) -> float:
    """What cold allows at best: ice where water may freeze; frost on a dry road unless the air is too dry for it."""
    watery = ground.film_mm >= WET_FROM_MM
    if ground.cold == "warm":
        return 1.0
    if ground.cold == "unknown":
        return friction.UNKNOWN_LOW if watery else friction.UNKNOWN_DRY_LOW
    if watery:
        return friction.ICE.low
    return friction.FROST.low if ground.frost else 1.0


def _snow_falls(observations: Sequence[Observation], ground: _Ground) -> bool:
    """Whether snow may lie: some source sees it fall, and no road is known to melt it."""
    falls = any(each.snow_mm_h is not None and each.snow_mm_h.high > 0.0 for each in observations)
    melts = ground.cold == "warm" and ground.coldest_c is not None and ground.coldest_c > WARM_FOR_SNOW_C
    return falls and not melts


def _high(observations: Sequence[Observation], now_ns: int) -> float:
    """The most that may be: each source lowers it as far as it is sure, unless another looks at the road and denies
    it. Cold alone does not: salted roads stay wet.
    """
    bare = any(each.road in _BARE for each in observations)
    dry = any(says_dry(each) for each in observations)
    caps = [friction.DRY.high]
    for each in observations:
        look, sure = _look(each), share(trust(each, now_ns))
        found = [] if bare or look is None else [look.high]
        found += [] if dry else [friction.wet_high(surely_at_least_mm(each))]
        caps += [friction.DRY.high - sure * (friction.DRY.high - cap) for cap in found]
    return min(caps)


def _contradict(observations: Sequence[Observation], mu: Interval) -> bool:
    """Whether one source is sure of a dry road and another of a wet one, or friction was measured outside of all."""
    dry = any(says_dry(each) for each in observations)
    wet = any(surely_at_least_mm(each) >= WET_FROM_MM for each in observations)
    measured = any(each.mu is not None and not each.mu.overlaps(mu) for each in observations)
    return (dry and wet) or measured


def _speaks(seen: Observation) -> bool:
    told = (seen.film_mm, seen.rain_mm_h, seen.snow_mm_h, seen.air_c, seen.road_c, seen.road, seen.mu)
    return any(each is not None for each in told)


def _notes(observations: Sequence[Observation], ground: _Ground, *, falling: bool) -> list[str]:
    found = [f"water film up to {ground.film_mm:.2f} mm" if ground.film_mm >= WET_FROM_MM else "dry road"]
    if ground.cold != "warm":
        found.append("road may be freezing" if ground.cold == "possible" else "road temperature unknown")
    if falling:
        found.append("snow")
    found += [f"{each.road} seen by {each.source}".replace("_", " ") for each in observations if _look(each)]
    found += [
        f"friction of {each.mu.low:.2f} to {each.mu.high:.2f} measured by {each.source}"
        for each in observations
        if each.mu is not None
    ]
    return found


def _is_wet(observations: Sequence[Observation], ground: _Ground) -> bool | None:
    """Wet where a source vouches for water; dry where a sure one finds none and none warns; else unknown."""
    if any(surely_at_least_mm(each) >= WET_FROM_MM for each in observations):
        return True
    return False if ground.film_mm < WET_FROM_MM else None
