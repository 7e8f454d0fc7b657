"""Gravity, the braking that is needed, and time to collision by the paper's formula and with accelerations.

A braking car stops at zero and stays there: it does not drive backwards, as the plain quadratic would have it.
"""

import math

GRAVITY_MPS2 = 9.81
"""The one owner of g: grip times this is what brakes."""
LEAST_ROOM_M = 0.5
"""A way to brake in is taken to be no shorter."""
HORIZON_S = 3600.0
"""What is further off than an hour is never: no measured speed carries that far."""
STILL = 1e-6
"""Speeds (m/s) and accelerations (m/s^2) below this are rest: far below what any sensor resolves."""


def needed_mps2(speed_mps: float, room_m: float, to_mps: float = 0.0) -> float:
    """The deceleration (m/s²) that comes down to a speed within a way, at least `LEAST_ROOM_M`."""
    return (speed_mps**2 - to_mps**2) / (2.0 * max(LEAST_ROOM_M, room_m))


def needed_behind_mps2(room_m: float, ego_mps: float, lead_mps: float, lead_brakes_mps2: float) -> float:
    """The deceleration (m/s²) that keeps the room (m) to a car ahead that goes on braking as it does, until it stands.

    A lead below 0 m/s comes towards the ego, and goes on.
    """
    room, closing = max(LEAST_ROOM_M, room_m), max(0.0, ego_mps - lead_mps)
    needed = needed_mps2(closing, room, min(0.0, lead_mps))
    if lead_brakes_mps2 <= 0.0:
        return needed
    if closing > 0.0 and 2.0 * room / closing <= lead_mps / lead_brakes_mps2:  # both still move when the closing ends
        return needed + lead_brakes_mps2
    return max(needed, needed_mps2(ego_mps, room + lead_mps**2 / (2.0 * lead_brakes_mps2)))


def paper_ttc_s(gap_m: float, closing_mps: float, epsilon_mps: float) -> float:
    """The paper's TTC = d / max(epsilon, closing speed)."""
    return gap_m / max(epsilon_mps, closing_mps)


def relative_ttc_s(gap_m: float, closing_mps: float, closing_mps2: float = 0.0) -> float | None:
    """TTC from relative motion alone, for road users whose own speeds are unknown; None: they never meet."""
    return _within(_first_root(gap_m, -_still(closing_mps), -_still(closing_mps2), 0.0, math.inf))


def ttc_s(gap_m: float, ego_mps: float, lead_mps: float, ego_mps2: float = 0.0, lead_mps2: float = 0.0) -> float | None:
    """When the gap (m) is used up if both keep their accelerations until they stand; None: never.

    A lead below 0 m/s comes towards the ego, and keeps its speed.
    """
    if gap_m <= 0.0:
        return 0.0
    ego_mps, lead_mps, ego_mps2, lead_mps2 = map(_still, (ego_mps, lead_mps, ego_mps2, lead_mps2))
    lead_halt, ego_halt = _halt_s(lead_mps, lead_mps2), _halt_s(ego_mps, ego_mps2)
    start, gap = 0.0, gap_m
    for end in sorted((lead_halt, ego_halt, math.inf)):
        lead_speed, lead_accel = _motion(lead_mps, lead_mps2, lead_halt, start)
        ego_speed, ego_accel = _motion(ego_mps, ego_mps2, ego_halt, start)
        speed, accel = lead_speed + min(0.0, lead_mps) - ego_speed, lead_accel - ego_accel
        root = _first_root(gap, speed, accel, 0.0, end - start)
        if root is not None:
            return _within(start + root)
        if math.isinf(end):
            return None
        span = end - start
        gap += speed * span + 0.5 * accel * span * span
        start = end
    return None


def _still(value: float) -> float:
    return 0.0 if abs(value) < STILL else value


def _within(time_s: float | None) -> float | None:
    return time_s if time_s is not None and time_s <= HORIZON_S else None


def _halt_s(speed_mps: float, accel_mps2: float) -> float:
    if accel_mps2 >= 0.0:
        return math.inf if accel_mps2 > 0.0 or speed_mps > 0.0 else 0.0
    return max(0.0, speed_mps) / -accel_mps2


def _motion(speed_mps: float, accel_mps2: float, halt_s: float, now_s: float) -> tuple[float, float]:
    return (0.0, 0.0) if now_s >= halt_s else (max(0.0, speed_mps) + accel_mps2 * now_s, accel_mps2)


def _first_root(gap: float, speed: float, accel: float, low: float, high: float) -> float | None:
    """Smallest t in [low, high] at which gap + speed t + accel t^2 / 2 <= 0."""
    if gap <= 0.0:
        return low
    half = 0.5 * accel
    discriminant = speed * speed - 4.0 * half * gap
    if discriminant < 0.0 or (speed >= 0.0 and half >= 0.0):
        return None
    # Of the two forms of the root the one that does not cancel: accelerations near zero are the common case.
    if speed > 0.0:
        root = (speed + math.sqrt(discriminant)) / -accel
    else:
        approach = math.sqrt(discriminant) - speed
        if approach <= 0.0:
            return None
        root = 2.0 * gap / approach
    return root if low <= root <= high else None
