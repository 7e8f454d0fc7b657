"""How far the driver sees."""

from services.weather.senses import Senses

FOG_LAMP_SIGHT_M = 100.0
"""Rear fog lamps are for sight below 50 m (StVO section 17(3)) and are often on in somewhat more."""
UNKNOWN_SPEED_MPS = 30.0


def rain_sight_m(rain_mm_h: float, speed_mps: float) -> float:
    """Sight through rain and a wet windscreen: 2000 / i^0.68 * 40 / V (feet, inches an hour, miles an hour).

    Ivey, Lehtipuu and Button, Rainfall and visibility: the view from behind the wheel, Texas Transportation Institute
    135-3 (1975).
    """
    inches_h = max(rain_mm_h, 0.05) / 25.4
    mph = max(speed_mps, 4.0) / 0.44704
    return float(2000.0 / inches_h**0.68 * 40.0 / mph * 0.3048)


def sight_m(senses: Senses) -> float | None:
    """The shortest sight that any source speaks for; None where none does."""
    speed = senses.speed_mps if senses.speed_mps is not None else UNKNOWN_SPEED_MPS
    found = [] if senses.visibility_m is None else [senses.visibility_m]
    if senses.rain_mm_h is not None and senses.rain_mm_h > 0.5 and not found:
        found.append(rain_sight_m(senses.rain_mm_h, speed))
    if senses.fog_lamp_rear and senses.visibility_m is None:
        found.append(FOG_LAMP_SIGHT_M)
    return min(found) if found else None
