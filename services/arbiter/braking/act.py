"""Bounded braking: deceleration, jerk and a budget of seconds have limits, and a driver who accelerates or steers away wins.

An intervention goes on while the danger does. What ends it: the danger is over (`lasting.py`), the driver overrides, or the
budget of its envelope is spent. A foot on the brake ends nothing: the receiver brakes by the harder of foot and command.
"""

from typing import NamedTuple, TypeGuard

import msgspec

from domain.kinematics import needed_behind_mps2
from domain.rss import GRAVITY_MPS2
from proto.decision import BrakeCommand, Envelope
from services.arbiter.assessment.assess import Numbers, View, along_mps
from services.arbiter.assessment.reading import Pedals
from services.arbiter.braking import budget
from services.arbiter.braking.budget import PAUSE_NS
from services.arbiter.profiles.profile import Profile
from services.arbiter.state import Intervention

PEDAL_ERROR = 0.05
"""A pedal may be measured so far beyond its way, which is from 0 to 1."""
MOST_STEERING_RAD = 1.6
"""No road wheel turns farther than a right angle."""


class Permission(msgspec.Struct, frozen=True, kw_only=True):
    """What a verified grant allows; `refused`: why no grant counts."""

    grant_id: str = ""
    max_deceleration_mps2: float = 0.0
    max_duration_s: float = 0.0
    refused: str = "no grant"
    envelope: Envelope = "soft"


class Need(NamedTuple):
    """What a danger asks for."""

    mps2: float
    """The deceleration that ends the closing within the gap (m/s2)."""
    hard: bool = False
    """Whether the conditions of emergency braking hold (`emergency.py`)."""
    grip_mps2: float = 0.0
    """What the tyres surely give (m/s2)."""
    stands: bool = False
    """Whether the car stands."""


def overridden(pedals: Pedals, at_start: Pedals | None, profile: Profile) -> str:
    """How the driver overrides, or why that cannot be seen; empty: the driver leaves it to the car, or brakes as well."""
    if not (_is_pedal(pedals.brake) and _is_pedal(pedals.accelerator) and _is_wheel(pedals.steering_rad)):
        return "the driver's pedals and wheel are not seen"
    if pedals.accelerator >= profile.pedal_accelerator:
        return "the driver accelerates"
    if at_start is None:
        return ""
    if pedals.accelerator - (at_start.accelerator or 0.0) > profile.pedal_rise:
        return "the driver accelerates"
    if abs(pedals.steering_rad - (at_start.steering_rad or 0.0)) > profile.wheel_turn_rad:
        return "the driver steers"
    return ""


def _is_pedal(value: float | None) -> TypeGuard[float]:
    return value is not None and -PEDAL_ERROR <= value <= 1.0 + PEDAL_ERROR


def _is_wheel(value: float | None) -> TypeGuard[float]:
    return value is not None and abs(value) <= MOST_STEERING_RAD


def takes_over(pedals: Pedals, at_start: Pedals | None, profile: Profile) -> str:
    """How the driver takes over a car that is held at standstill; empty: not yet. A foot on the brake holds it as well."""
    if pedals.brake is not None and pedals.brake > profile.pedal_brake:
        return "the driver brakes"
    return overridden(pedals, at_start, profile)


def needed_mps2(numbers: Numbers, ego_mps: float, profile: Profile) -> float:
    """The deceleration that ends the closing within the gap, the standstill buffer spared."""
    lead_mps, _ = braking_on(numbers, ego_mps, profile)
    return needed_behind_mps2(numbers.gap_m - profile.d0_m, max(0.0, ego_mps), lead_mps, 0.0)


def braking_on(numbers: Numbers, ego_mps: float, profile: Profile) -> tuple[float, float]:
    """Speed of a lead, and the deceleration with which it is taken to brake on: 0 where it stands, whatever was measured."""
    lead_mps = along_mps(numbers.track, ego_mps - max(0.0, numbers.closing_mps))
    lead_mps2 = max(0.0, -numbers.track.ax_mps2)
    return lead_mps, lead_mps2 if lead_mps >= profile.stands_mps else 0.0


def danger_mps2(numbers: Numbers, ego_mps: float, profile: Profile) -> float:
    """The deceleration that avoids the impact: `needed_mps2`, and more behind a lead that goes on braking as it does."""
    return needed_behind_mps2(numbers.gap_m - profile.d0_m, max(0.0, ego_mps), *braking_on(numbers, ego_mps, profile))


def grip_mps2(view: View, profile: Profile) -> float:
    """What the tyres surely give: the lower bound of friction."""
    mu = profile.mu_unknown_low if view.mu_low is None else view.mu_low
    return max(profile.mu_floor, mu) * GRAVITY_MPS2


def budget_s(permission: Permission, profile: Profile) -> float:
    """Seconds of braking within a window of as many seconds and a rest."""
    longest = profile.emergency_duration_s if _to_standstill(permission, profile) else profile.act_duration_s
    return min(permission.max_duration_s, longest)


def brake(
    running: Intervention, need: Need, permission: Permission, pedals: Pedals, run_ns: int, profile: Profile
) -> tuple[Intervention, BrakeCommand | None, str]:
    """The next bounded command, or None and why the intervention ends or does not begin. `run_ns`: the running clock."""
    if running.rest_until_ns is not None and run_ns < running.rest_until_ns:
        return running, None, "resting after an intervention"
    on = going(running, run_ns)
    holds = on and need.stands and _to_standstill(permission, profile)
    at_start = running.pedals if on else None
    ends = takes_over if holds and running.holds else overridden
    if (why := ends(pedals, at_start, profile)) != "":
        return stop(running, run_ns, profile) if on else _idle(running), None, why
    longest_s = budget_s(permission, profile)
    if not holds and budget.spent_s(running.braked, run_ns, longest_s + profile.act_rest_s) >= longest_s:
        return stop(running, run_ns, profile) if on else _idle(running), None, "the longest braking allowed is over"
    limit = _limit(need, permission, profile)
    if on and permission.envelope == "emergency" and not need.stands:  # it becomes no weaker before the danger is over
        limit = max(limit, running.brake_mps2)
    value = _ramp(running, limit, run_ns, profile) if on else min(limit, profile.act_jerk_mps3 * 0.1)
    value = min(value, permission.max_deceleration_mps2)  # a grant that took another's place may allow less
    begun = Intervention(
        since_ns=running.since_ns if on else run_ns,
        last_ns=run_ns,
        brake_mps2=value,
        pedals=running.pedals if on else pedals,
        holds=holds,
        braked=running.braked if holds else budget.spend(running.braked, run_ns),
    )
    return begun, _command(value, permission, profile), ""


def going(running: Intervention, run_ns: int) -> bool:
    """Whether an intervention is under way."""
    return running.since_ns is not None and running.last_ns is not None and run_ns - running.last_ns < PAUSE_NS


def stop(running: Intervention, run_ns: int, profile: Profile) -> Intervention:
    """The driver or the budget has ended the intervention; no new one before the rest has passed.

    After it the budget is whole again: no window of budget and rest holds more braking than the budget.
    """
    if running.since_ns is None:
        return running
    return Intervention(rest_until_ns=run_ns + int(profile.act_rest_s * 1e9))


def let_go(running: Intervention, run_ns: int) -> Intervention:
    """Nothing to brake for: an intervention that found its end needs no rest, an elapsed rest is forgotten."""
    if running.rest_until_ns is not None and run_ns < running.rest_until_ns:
        return running
    return running if going(running, run_ns) else _idle(running)


def aged(running: Intervention, run_ns: int, profile: Profile) -> Intervention:
    """Without what no budget counts any more."""
    window_s = max(profile.act_duration_s, profile.emergency_duration_s) + profile.act_rest_s
    return msgspec.structs.replace(running, braked=budget.kept(running.braked, run_ns, window_s))


def _idle(running: Intervention) -> Intervention:
    return Intervention(braked=running.braked)


def _to_standstill(permission: Permission, profile: Profile) -> bool:
    return permission.envelope == "emergency" and profile.emergency_brake_max_mps2 > 0.0


def _limit(need: Need, permission: Permission, profile: Profile) -> float:
    """The deceleration to ask for: what is needed, within the bounds of profile, grant and grip."""
    most = min(permission.max_deceleration_mps2, profile.act_brake_max_mps2)
    if need.stands:
        return min(most, profile.act_brake_min_mps2)
    if need.hard and _to_standstill(permission, profile):
        hardest = max(profile.act_brake_max_mps2, min(profile.emergency_brake_max_mps2, need.grip_mps2))
        return min(permission.max_deceleration_mps2, hardest)
    return min(most, max(profile.act_brake_min_mps2, need.mps2))


def _ramp(running: Intervention, wanted: float, run_ns: int, profile: Profile) -> float:
    since_ns = 0 if running.last_ns is None else run_ns - running.last_ns
    if since_ns > budget.VALID_NS:  # the receiver has let go
        return min(wanted, profile.act_jerk_mps3 * 0.1)
    step = profile.act_jerk_mps3 * since_ns / 1e9
    return min(running.brake_mps2 + step, max(running.brake_mps2 - step, wanted))


def _command(value: float, permission: Permission, profile: Profile) -> BrakeCommand:
    return BrakeCommand(
        deceleration_mps2=value,
        jerk_mps3=profile.act_jerk_mps3,
        grant_id=permission.grant_id,
        envelope="emergency" if _to_standstill(permission, profile) else "soft",
    )
