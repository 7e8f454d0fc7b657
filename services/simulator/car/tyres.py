"""Tyres: pressure with temperature, the radius they roll on, the grip that a soft one loses, and how it pulls.

* speed of aquaplaning with the root of the pressure: Horne and Dreher, Phenomena of pneumatic tire hydroplaning, NASA
  TN D-2056 (1963); its value at nominal pressure with the water's depth: Huebner, Reed and Henry, Criteria for
  predicting hydroplaning potential, J. Transp. Eng. 112 (1986).
* lift, and with it the lost contact, with the square of speed: Horne and Joyner, SAE 650145 (1965).
* rolling radius: a quarter of the pressure less makes it some 0.5 % smaller, the effect that indirect tyre pressure
  monitors use (Persson, Gustafsson and Drevö, Indirect tire pressure monitoring, SAE 2002-01-1250).
"""

import math

from domain.units import MM_PER_INCH, MPS_PER
from services.simulator.car.condition import Four, four

NOMINAL_BAR: Four = (2.4, 2.4, 2.6, 2.6)
"""Cold."""
ATMOSPHERE_BAR = 1.013
KELVIN = 273.15
DRY_LOSS = 0.06
"""Braking grip that a tyre without air would lose on a dry road; ours."""
FULL_LIFT_MM = 0.5
"""Depth from which the tread no longer drains the road's water quickly; below it only part of the lift shows. Ours."""
RADIUS_LOSS = 0.02
PULL_RAD = 0.004
"""Road wheel angle that holds against one side without air; ours."""


def warm_bar(cold_bar: float, filled_c: float, now_c: float) -> float:
    """Gauge pressure of a tyre filled at `filled_c`: the same air at another temperature (Gay-Lussac)."""
    return (cold_bar + ATMOSPHERE_BAR) * (now_c + KELVIN) / (filled_c + KELVIN) - ATMOSPHERE_BAR


def lack(pressure_bar: Four) -> Four:
    """How far each tyre is below its nominal pressure, 0 to 1."""
    return four(max(0.0, 1.0 - now / of) for now, of in zip(pressure_bar, NOMINAL_BAR, strict=True))


def aquaplaning_mps(film_mm: float, lacking: float = 0.0) -> float:
    """Speed at which a tyre floats on that film; `lacking`: share of the nominal pressure that is gone."""
    film_in = max(film_mm, 0.01) / MM_PER_INCH
    speed: float = 26.04 * film_in**-0.259 * MPS_PER["mph"] * math.sqrt(max(0.05, 1.0 - lacking))
    return speed


def grip_share(lacking: Four, film_mm: float, speed_mps: float) -> float:
    """Grip of these tyres relative to sound ones on the same road, in (0, 1]."""
    return sum(_share(each, film_mm, speed_mps) for each in lacking) / 4.0


def _share(lacking: float, film_mm: float, speed_mps: float) -> float:
    dry = 1.0 - DRY_LOSS * lacking
    return dry * _contact(lacking, film_mm, speed_mps) / _contact(0.0, film_mm, speed_mps)


def _contact(lacking: float, film_mm: float, speed_mps: float) -> float:
    if film_mm <= 0.0:
        return 1.0
    lift = (speed_mps / aquaplaning_mps(film_mm, lacking)) ** 2 * (1.0 - math.exp(-film_mm / FULL_LIFT_MM))
    return max(0.1, 1.0 - lift)


def radius_share(lacking: float) -> float:
    """Rolling radius relative to a tyre at nominal pressure."""
    return 1.0 - RADIUS_LOSS * lacking


def pull_rad(lacking: Four) -> float:
    """Angle at the road wheels by which soft tyres turn the car by themselves, positive to the left."""
    front_left, front_right, rear_left, rear_right = lacking
    return PULL_RAD * ((front_left + rear_left) - (front_right + rear_right)) / 2.0
