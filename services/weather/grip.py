"""Evidence of grip from each source, and their fusion: what disagrees widens the interval, what is missing widens it
too.
"""

from typing import NamedTuple

from services.weather import friction
from services.weather.interval import Interval
from services.weather.senses import Senses

UNKNOWN_SPEED_MPS = 30.0
DRYING_S = 1200.0
"""A road counts as possibly wet so long after it was last known to be wet, unless its film is measured."""
ABS_SHARE = 0.8
"""An anti-lock system uses 80 to 95 % of the peak (UN R13-H, annex 6, asks for 75 %)."""

WET_FROM_MM = 0.02
"""A film that surely reaches this is wet, one that surely stays below is dry."""
_UNKNOWN_FILM = Interval(0.0, friction.RUT_MM)

# Wiper stage -> rain it speaks for (mm/h). Off says nothing: wipers may be forgotten, and a dry road needs none.
_WIPER_RAIN = {1: Interval(0.0, 3.0), 2: Interval(0.5, 12.0), 3: Interval(3.0, 40.0)}


class Grip(NamedTuple):
    """The fused interval, the sources that spoke, and what they said."""

    mu: Interval
    sources: tuple[str, ...]
    notes: tuple[str, ...]
    wet: bool | None
    contradiction: bool


def fuse(senses: Senses, *, wet_recently: bool) -> Grip:
    """Grip at the ego's speed. Nothing known: `friction.UNKNOWN`."""
    speed = senses.speed_mps if senses.speed_mps is not None else UNKNOWN_SPEED_MPS
    tyre_low = senses.tyre_low or 0.0
    films = _films(senses, wet_recently=wet_recently)
    sources, notes = [name for name, _ in films], []
    if films:
        intervals = [friction.wet(film, speed, tyre_low) for _, film in films]
        contradiction = _contradict([film for _, film in films])
        # The first source measures most directly: it alone says how good the road may be, unless another denies it.
        mu = Interval(
            min(each.low for each in intervals), _hull(intervals).high if contradiction else intervals[0].high
        )
        top = max(film.high for _, film in films)
        notes.append(f"water film up to {top:.2f} mm" if top > 0.02 else "dry road")
    else:
        mu, contradiction = friction.UNKNOWN.hull(friction.wet(_UNKNOWN_FILM, speed, tyre_low)), False
        notes.append("wetness unknown")
    wet_possible = not films or any(film.high > 0.0 for _, film in films)
    mu = _cold(senses, mu, wet_possible=wet_possible, sources=sources, notes=notes)
    mu = _snow(senses, mu, sources, notes)
    mu, contradiction = _abs(senses, mu, contradiction, sources, notes)
    return Grip(mu, tuple(dict.fromkeys(sources)), tuple(notes), _is_wet(films), contradiction)


def _contradict(films: list[Interval]) -> bool:
    """Whether one source is sure of a dry road and another of a wet one. How deep the water is, sources may see
    differently.
    """
    return any(film.high < WET_FROM_MM for film in films) and any(film.low >= WET_FROM_MM for film in films)


def _hull(intervals: list[Interval]) -> Interval:
    mu = intervals[0]
    for other in intervals[1:]:
        mu = mu.hull(other)
    return mu


def _films(senses: Senses, *, wet_recently: bool) -> list[tuple[str, Interval]]:
    """Water film (mm) as each source has it."""
    found: list[tuple[str, Interval]] = []
    if senses.film_mm is not None:
        found.append(("film sensor", Interval(0.8 * senses.film_mm, 1.2 * senses.film_mm)))
    if senses.rain_mm_h is not None and (senses.rain_mm_h > 0.1 or senses.film_mm is None):
        found.append(("rain", _rain(Interval(senses.rain_mm_h, senses.rain_mm_h))))
    if senses.wiper_stage in _WIPER_RAIN:
        found.append(("wipers", _rain(_WIPER_RAIN[senses.wiper_stage])))
    if wet_recently and senses.film_mm is None and found and all(film.high < friction.RUT_MM for _, film in found):
        found.append(("earlier rain", Interval(0.0, friction.RUT_MM)))
    return found


def _rain(rain_mm_h: Interval) -> Interval:
    """The film that rain may make: none yet where it is light or has just begun, Gallaway's depth at most; at least
    damp in real rain.
    """
    return Interval(
        WET_FROM_MM if rain_mm_h.low > 0.3 else 0.0,
        max(WET_FROM_MM if rain_mm_h.high > 0.1 else 0.0, friction.rain_film_mm(rain_mm_h.high)),
    )


def _cold(senses: Senses, mu: Interval, *, wet_possible: bool, sources: list[str], notes: list[str]) -> Interval:
    road = road_temperature(senses)
    if road is None:
        notes.append("temperature unknown")
        return Interval(min(mu.low, friction.UNKNOWN.low if wet_possible else 0.6), mu.high)
    sources.append("temperature")
    if road.low <= 1.0:
        notes.append("road at or below freezing" if road.high <= 0.0 else "frost possible")
    return friction.frozen(mu, road, wet_possible=wet_possible)


def road_temperature(senses: Senses) -> Interval | None:
    """Where the road's temperature lies (degC). Unmeasured, a road is up to 4 K colder than the air (clear night,
    bridge) or 15 K warmer (sun).
    """
    airs = [air_c for air_c in (senses.air_c, senses.outside_c) if air_c is not None]
    guesses = [Interval(air_c - 4.0, air_c + 15.0 if air_c > 0.0 else air_c + 4.0) for air_c in airs]
    if senses.road_c is None:
        return _hull(guesses) if guesses else None
    measured = Interval(senses.road_c - 1.0, senses.road_c + 1.0)
    return _hull([measured, *(guess for guess in guesses if not guess.overlaps(measured))])


def _snow(senses: Senses, mu: Interval, sources: list[str], notes: list[str]) -> Interval:
    if senses.snow_mm_h is None or senses.snow_mm_h <= 0.0:
        return mu
    sources.append("snowfall")
    notes.append("snow")
    warm = (road := road_temperature(senses)) is not None and road.low > 3.0
    return Interval(min(mu.low, friction.SNOW.low), max(friction.SNOW.high, mu.high if warm else 0.0))


def _abs(
    senses: Senses, mu: Interval, contradiction: bool, sources: list[str], notes: list[str]
) -> tuple[Interval, bool]:
    """The anti-lock system at work measures grip, here and now: it lowers the lower bound, and never raises it."""
    if senses.abs_mu is None:
        return mu, contradiction
    sources.append("anti-lock")
    measured = Interval(0.9 * senses.abs_mu, senses.abs_mu / ABS_SHARE)
    notes.append(f"anti-lock worked at {senses.abs_mu:.2f} g")
    return Interval(min(mu.low, measured.low), mu.high), contradiction or not mu.overlaps(measured)


def _is_wet(films: list[tuple[str, Interval]]) -> bool | None:
    """Wet where a source is sure of water, or most of what is possible is wet; dry where none allows any."""
    if not films:
        return None
    if any(film.low >= WET_FROM_MM for _, film in films):
        return True
    return None if any(film.high >= WET_FROM_MM for _, film in films) else False
