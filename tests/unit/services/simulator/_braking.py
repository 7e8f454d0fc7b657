"""Stopping distances by the simulator's own braking, step by step."""

from services.simulator.car import tyres
from services.simulator.car.braking import Ability, Braked, decelerate
from services.simulator.environment.weather import friction

STEP_S = 0.01


def stopping_m(car: Ability, *, from_mps: float = 25.0, film_mm: float = 0.0, asked_mps2: float = 12.0) -> float:
    """The way to standstill under `asked_mps2`."""
    speed, way, braked = from_mps, 0.0, Braked(0.0)
    while speed > 0.05:
        mu = friction(film_mm) * tyres.grip_share(car.lacking, film_mm, speed)
        braked = decelerate(asked_mps2, car, mu, film_mm, speed, braked.locked)
        way += speed * STEP_S
        speed -= braked.mps2 * STEP_S
    return way
