"""Water on the road, as each source has it."""

from collections.abc import Iterator, Mapping, Sequence

from services.weather.observations.claim import Claim
from services.weather.observations.observation import Interval, Observation, RoadState, trust
from services.weather.road import friction

WET_FROM_MM = 0.02
"""A film that surely reaches this is wet, one that surely stays below is dry."""
NO_RAIN_MM_H = 0.1
RAIN_WARNS = 0.5
"""Share of the film of steady rain at its upper bound that rain warns of: it may have just begun (ours)."""
DAMP_MM = 0.03
"""What fog and dew leave on a road (ours)."""
FOG_M = 500.0

# What a surface's look speaks for: water film in mm. Frozen ones hold none that flows.
_LOOKS: Mapping[RoadState, Interval] = {
    "dry": Interval(0.0, 0.01),
    "damp": Interval(0.01, 0.08),
    "wet": Interval(0.05, 0.6),
    "flooded": Interval(0.6, 5.0),
    "slush": Interval(0.1, 1.0),
}


def film_claims(observations: Sequence[Observation], now_ns: int, *, drying: bool, left_mm: float = 0.0) -> list[Claim]:
    """What is claimed of the film (mm). `drying`: it rained lately, or it is not known that it did not; `left_mm`: what
    physics leaves of the water that lay lately, whatever a road sensor says.
    """
    found = [claim for each in observations for claim in _claims(each, trust(each, now_ns), drying=drying)]
    if left_mm >= WET_FROM_MM:
        found.append(Claim("earlier rain", friction.UNKNOWN_FILM_MM, left_mm, 0.0))
    return found


def _claims(seen: Observation, sure: float, *, drying: bool) -> Iterator[Claim]:
    if seen.film_mm is not None:
        yield Claim(seen.source, seen.film_mm.high, seen.film_mm.high, sure)
    if seen.rain_mm_h is not None:
        rained = _rain_mm(seen.rain_mm_h.high)
        yield Claim(seen.source, max(rained, friction.RUT_MM if drying else 0.0), _warns(rained), sure)
    look = _look(seen)
    if look is not None:
        yield Claim(seen.source, look.high, 0.5 * (look.low + look.high) if look.low > 0.0 else 0.0, sure)
    if _damp(seen):
        yield Claim(seen.source, friction.UNKNOWN_FILM_MM, DAMP_MM, sure)


def _rain_mm(rain_mm_h: float) -> float:
    """The most that rain makes of film; real rain makes a road damp at least."""
    return 0.0 if rain_mm_h <= NO_RAIN_MM_H else max(WET_FROM_MM, friction.rain_film_mm(rain_mm_h))


def _warns(rained_mm: float) -> float:
    """What of it is counted on against a drier road sensor: nothing where rain can hardly wet the road."""
    return RAIN_WARNS * rained_mm if RAIN_WARNS * rained_mm >= WET_FROM_MM else 0.0


def _damp(seen: Observation) -> bool:
    """Fog, or dew: water condenses on a road that is no warmer than the dew point."""
    foggy = seen.visibility_m is not None and seen.visibility_m.low < FOG_M
    dewy = seen.road_c is not None and seen.dew_point_c is not None and seen.road_c.low <= seen.dew_point_c.high
    return foggy or dewy


def surely_at_least_mm(seen: Observation) -> float:
    """The least film that a source vouches for."""
    film = seen.film_mm.low if seen.film_mm is not None else 0.0
    rain = WET_FROM_MM if seen.rain_mm_h is not None and seen.rain_mm_h.low > 0.3 else 0.0
    look = _look(seen)
    return max(film, rain, look.low if look is not None else 0.0)


def _look(seen: Observation) -> Interval | None:
    return _LOOKS.get(seen.road) if seen.road is not None else None


def says_dry(seen: Observation) -> bool:
    """Whether a source that looks at the road itself finds no water there."""
    film = seen.film_mm
    return (film is not None and film.high < WET_FROM_MM) or seen.road == "dry"
