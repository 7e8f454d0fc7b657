"""The deceleration that the brakes give for the one asked for.

* booster: without it the foot alone must give 2.44 m/s2 (UN R13-H, annex 3, 2.3: failure of the assistance); a driver
  who stops a sound car at the limit of a dry road (8.3 m/s2) then gets 2.5.
* circuits: two, diagonal; an empty one leaves its two wheels to roll.
* fade: linings hold to about 350 degC and lose up to half by 650 degC (Limpert, Brake Design and Safety, ch. 4; UN
  R13-H type I allows 40 % loss after repeated stops).
* a locked wheel slides on 70 to 80 % of the peak friction, less on a wet road and the less the faster (Wong, Theory of
  Ground Vehicles, ch. 1).
"""

import math
from dataclasses import dataclass

from domain.kinematics import GRAVITY_MPS2
from services.simulator.car import tyres
from services.simulator.car.condition import NONE, Condition, Four
from services.simulator.car.state import FRONT_BRAKE_SHARE, CarState

FADE_FROM_C, FADE_TO_C, FADE_LOSS = 350.0, 650.0, 0.45
ENGINE_DRAG_MPS2 = 0.5
"""What lifting the foot gives, whatever the brakes do."""
LIMIT_SHARE = 0.98
"""From this share of the grip on, the wheels are at their limit."""
FULL_MPS2 = 0.85 * GRAVITY_MPS2
"""What a sound car gives for a full braking on a dry road."""
LEAST_EFFECT = 0.01
SLIDE_DRY, SLIDE_WET_LOSS, SLIDE_LOSS_PER_MPS = 0.8, 0.12, 0.004


@dataclass(frozen=True, slots=True)
class Ability:
    """What the car brings to a braking: as it stands here, a sound car."""

    effect: float = 1.0
    """Deceleration that the brakes give for one asked of a sound car."""
    circuits: float = 1.0
    anti_lock: bool = True
    lacking: Four = NONE
    """Share of the nominal pressure that each tyre lacks."""
    sight: float = 1.0
    """Share of the visibility in rain that the windscreen leaves."""
    headlamps: bool = True


@dataclass(frozen=True, slots=True)
class Braked:
    """The result of braking: deceleration (m/s2, positive), and what the wheels do."""

    mps2: float
    at_limit: bool = False
    locked: bool = False


def ability(condition: Condition, state: CarState) -> Ability:
    """The ability of a car in that condition, with its discs and tyres as they are."""
    return Ability(
        effect=condition.assisted * condition.circuits * condition.lining * _unfaded(state.brake_temperature_c),
        circuits=condition.circuits,
        anti_lock=condition.anti_lock,
        lacking=tyres.lack(state.tyre_pressure_bar),
        sight=1.0 if condition.wipers else 0.3,
        headlamps=condition.headlamps,
    )


def decelerate(asked_mps2: float, car: Ability, mu: float, film_mm: float, speed_mps: float, locked: bool) -> Braked:
    """The deceleration for `asked_mps2` on a road with peak friction `mu` (that of the car's tyres)."""
    drag = min(asked_mps2, ENGINE_DRAG_MPS2)
    wanted = drag + (asked_mps2 - drag) * car.effect
    peak = mu * GRAVITY_MPS2 * car.circuits
    sliding = peak * slide_share(film_mm, speed_mps)
    if not car.anti_lock and speed_mps > 1.0 and wanted > (sliding if locked else LIMIT_SHARE * peak):
        return Braked(sliding, at_limit=True, locked=True)
    return Braked(min(wanted, peak), at_limit=wanted >= LIMIT_SHARE * peak)


def asked_for(wanted_mps2: float, car: Ability) -> float:
    """The deceleration to ask of the brakes so that they give `wanted_mps2`: the brake unit regulates by what it measures, up to a
    full braking of a sound car.
    """
    drag = min(wanted_mps2, ENGINE_DRAG_MPS2)
    return min(max(FULL_MPS2, wanted_mps2), drag + (wanted_mps2 - drag) / max(car.effect, LEAST_EFFECT))


def slide_share(film_mm: float, speed_mps: float) -> float:
    """Friction of a locked wheel relative to the peak."""
    wet = 1.0 - math.exp(-film_mm / 0.1)
    return SLIDE_DRY - wet * (SLIDE_WET_LOSS + SLIDE_LOSS_PER_MPS * speed_mps)


def fade(disc_c: float) -> float:
    """Friction of a lining on a disc of that temperature relative to a cold one."""
    return 1.0 - FADE_LOSS * min(1.0, max(0.0, (disc_c - FADE_FROM_C) / (FADE_TO_C - FADE_FROM_C)))


def _unfaded(discs_c: Four) -> float:
    front_left, front_right, rear_left, rear_right = (fade(each) for each in discs_c)
    front, rear = (front_left + front_right) / 2.0, (rear_left + rear_right) / 2.0
    return FRONT_BRAKE_SHARE * front + (1.0 - FRONT_BRAKE_SHARE) * rear
