"""How far the driver sees. Every source can only shorten it.

* rain: 2000 / i^0.68 * 40 / V (feet, inches an hour, miles an hour): Ivey, Lehtipuu and Button, Rainfall and
  visibility: the view from behind the wheel, Texas Transportation Institute 135-3 (1975).
* snow: visibility times rate (as water) is constant within a factor of 3 to 10: Rasmussen and others, The estimation
  of snowfall rate using visibility, J. Appl. Meteorol. 38 (1999). `SNOW_KM_MM_H` is near the lower end of their data.
* spray: grows with water and with the square of speed; the law of both is common knowledge of spray suppression, the
  size is ours. It is the view past a vehicle ahead, so it holds from `SPRAY_FROM_MPS` and in standing water alone.
"""

from collections.abc import Iterator, Sequence

from domain.units import M_PER_FOOT, MM_PER_INCH, MPS_PER
from services.weather.observations.observation import Observation

FOG_LAMP_SIGHT_M = 100.0
"""Rear fog lamps are for sight below 50 m (StVO section 17(3)) and are often on in somewhat more."""
SNOW_KM_MM_H = 0.8
SPRAY_FROM_MPS, SPRAY_FROM_MM = 16.7, 0.1
SPRAY_M, SPRAY_FILM_MM, SPRAY_SPEED_MPS = 400.0, 0.5, 22.2
"""Sight past spray at this film and this speed (ours)."""
LEAST_M = 5.0


def rain_sight_m(rain_mm_h: float, speed_mps: float) -> float:
    """Sight through rain and a wet windscreen."""
    inches_h = max(rain_mm_h, 0.05) / MM_PER_INCH
    mph = max(speed_mps, 4.0) / MPS_PER["mph"]
    return float(2000.0 / inches_h**0.68 * 40.0 / mph * M_PER_FOOT)


def snow_sight_m(snow_mm_h: float) -> float:
    """Sight through falling snow; the rate is as water."""
    return max(LEAST_M, 1000.0 * SNOW_KM_MM_H / max(snow_mm_h, 0.05))


def spray_sight_m(film_mm: float, speed_mps: float) -> float | None:
    """Sight past the spray of traffic; `None` without spray."""
    if film_mm < SPRAY_FROM_MM or speed_mps < SPRAY_FROM_MPS:
        return None
    return max(30.0, float(SPRAY_M * (SPRAY_FILM_MM / film_mm) ** 0.5 * (SPRAY_SPEED_MPS / speed_mps) ** 2))


def sight_m(observations: Sequence[Observation], speed_mps: float, wet_mm: float) -> float | None:
    """The shortest sight that any source speaks for; None where none does. `wet_mm`: film that is vouched for."""
    found = [metres for each in observations for metres in _sights(each, speed_mps)]
    spray = spray_sight_m(wet_mm, speed_mps)
    return min(found if spray is None else [*found, spray], default=None)


def _sights(seen: Observation, speed_mps: float) -> Iterator[float]:
    if seen.visibility_m is not None:
        yield seen.visibility_m.low
    if seen.rain_mm_h is not None and seen.rain_mm_h.high > 0.5:
        yield rain_sight_m(seen.rain_mm_h.high, speed_mps)
    if seen.snow_mm_h is not None and seen.snow_mm_h.high > 0.0:
        yield snow_sight_m(seen.snow_mm_h.high)
