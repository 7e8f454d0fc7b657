"""Bounded braking: deceleration, jerk and duration have limits, and the driver's pedals and wheel win at once."""

import msgspec

from proto.decision import BrakeCommand
from services.arbiter.assessment.assess import Numbers
from services.arbiter.assessment.reading import Pedals
from services.arbiter.profiles.profile import Profile
from services.arbiter.state import Intervention

PAUSE_NS = 500_000_000
"""An intervention that pauses for less is the same one: one limit of duration, one look at the pedals."""


class Permission(msgspec.Struct, frozen=True, kw_only=True):
    """What a verified grant allows; `refused` says why there is none."""

    grant_id: str = ""
    max_deceleration_mps2: float = 0.0
    max_duration_s: float = 0.0
    refused: str = "no grant"


def overridden(pedals: Pedals, at_start: Pedals | None, profile: Profile) -> str:
    """How the driver overrides, or why that cannot be seen; empty: the driver leaves it to the car."""
    if pedals.brake is None or pedals.accelerator is None or pedals.steering_rad is None:
        return "the driver's pedals and wheel are not seen"
    if pedals.brake > profile.pedal_brake:
        return "the driver brakes"
    if pedals.accelerator >= profile.pedal_accelerator:
        return "the driver accelerates"
    if at_start is None:
        return ""
    if pedals.accelerator - (at_start.accelerator or 0.0) > profile.pedal_rise:
        return "the driver accelerates"
    if abs(pedals.steering_rad - (at_start.steering_rad or 0.0)) > profile.wheel_turn_rad:
        return "the driver steers"
    return ""


def needed_mps2(numbers: Numbers, ego_mps: float, profile: Profile) -> float:
    """The deceleration that ends the closing within the gap, the standstill buffer spared."""
    room = max(0.5, numbers.gap_m - profile.d0_m)
    closing = min(max(0.0, numbers.closing_mps), max(0.0, ego_mps))
    return closing * closing / (2.0 * room)


def brake(
    running: Intervention, needed: float, permission: Permission, pedals: Pedals, now_ns: int, profile: Profile
) -> tuple[Intervention, BrakeCommand | None, str]:
    """The next bounded command, or None and why the intervention ends or does not begin."""
    if running.rest_until_ns is not None and now_ns < running.rest_until_ns:
        return running, None, "resting after an intervention"
    on = going(running, now_ns)
    started_ns = running.since_ns if on and running.since_ns is not None else now_ns
    if (why := overridden(pedals, running.pedals if on else None, profile)) != "":
        return stop(running, now_ns, profile) if on else Intervention(), None, why
    if (now_ns - started_ns) / 1e9 >= min(permission.max_duration_s, profile.act_duration_s):
        return stop(running, now_ns, profile), None, "the longest intervention allowed is over"
    value = _ramp(running, needed, permission, now_ns, profile) if on else _first(needed, permission, profile)
    begun = Intervention(since_ns=started_ns, last_ns=now_ns, brake_mps2=value, pedals=running.pedals if on else pedals)
    return (
        begun,
        BrakeCommand(deceleration_mps2=value, jerk_mps3=profile.act_jerk_mps3, grant_id=permission.grant_id),
        "",
    )


def going(running: Intervention, now_ns: int) -> bool:
    """Whether an intervention is under way."""
    return running.since_ns is not None and running.last_ns is not None and now_ns - running.last_ns < PAUSE_NS


def stop(running: Intervention, now_ns: int, profile: Profile) -> Intervention:
    """The intervention is over; no new one before the rest has passed."""
    if running.since_ns is None:
        return running
    return Intervention(rest_until_ns=now_ns + int(profile.act_rest_s * 1e9))


def set_back(running: Intervention, now_ns: int, profile: Profile) -> Intervention:
    """After the clock was set back nobody knows how long the car has braked: a rest begins, or goes on for no longer than one."""
    if running.rest_until_ns is None:
        return stop(running, now_ns, profile)
    return Intervention(rest_until_ns=min(running.rest_until_ns, now_ns + int(profile.act_rest_s * 1e9)))


def let_go(running: Intervention, now_ns: int) -> Intervention:
    """Nothing to brake for: an intervention that found its end needs no rest, an elapsed rest is forgotten."""
    if running.rest_until_ns is not None and now_ns < running.rest_until_ns:
        return running
    return running if going(running, now_ns) else Intervention()


def _limit(needed: float, permission: Permission, profile: Profile) -> float:
    most = min(permission.max_deceleration_mps2, profile.act_brake_max_mps2)
    return min(most, max(profile.act_brake_min_mps2, needed))


def _first(needed: float, permission: Permission, profile: Profile) -> float:
    return min(_limit(needed, permission, profile), profile.act_jerk_mps3 * 0.1)


def _ramp(running: Intervention, needed: float, permission: Permission, now_ns: int, profile: Profile) -> float:
    step = profile.act_jerk_mps3 * max(0.0, (now_ns - (running.last_ns or now_ns)) / 1e9)
    wanted = _limit(needed, permission, profile)
    return min(running.brake_mps2 + step, max(running.brake_mps2 - step, wanted))
