"""What each sensor should say, told by the others: wheel against wheel in a bend, speed against acceleration, yaw rate
against wheels and steering, brake pressure against pedal and deceleration. Pure; a sensor never speaks for itself.
"""

import math
import statistics
from collections.abc import Iterable, Mapping, Sequence
from typing import NamedTuple

Values = Mapping[str, float | None]

WHEELS = ("wheel_fl_mps", "wheel_fr_mps", "wheel_rl_mps", "wheel_rr_mps")
_OUTWARD = dict(zip(WHEELS, (-1.0, 1.0, -1.0, 1.0), strict=True))
"""A wheel on the right runs the longer arc in a bend to the left (positive yaw rate)."""
SLIP_SHARE = 0.05
"""Driven and braked wheels differ from the ground by so much at ordinary demand (Wong, Theory of Ground Vehicles)."""
MOST_UNDERSTEER_S2_PM2 = 0.0025
"""Stability factor K in v delta / (L (1 + K v^2)) (single-track model, Rajamani 2012, ch. 3): 0 is neutral, ordinary
cars have up to this."""
RADIUS_SPREAD = 0.01
"""Tyres of one axle differ by so much in rolling radius, a soft one among them."""
STEERING_PLAY_RAD = 0.0015
MOVING_MPS = 2.0
TOUCHED, PRESSED = 0.005, 0.02
"""Travel of the brake pedal below which no foot is on it, and from which it tells how much is asked for."""
SLOPE_SAMPLES = 16
"""Of the speed, over which the deceleration is told."""


AT_WORK = ("abs_active", "esc_active", "traction_active")
"""While one of these systems is at work wheels slide or spin, and no wheel speaks for another."""


class Shape(NamedTuple):
    """The car as far as the checks need it; a brake constant is `None` where the profile does not tell it."""

    track_m: float = 1.55
    wheelbase_m: float = 2.7
    brake_bar_per_mps2: float | None = None
    brake_bar_full_pedal: float | None = None


class Expected(NamedTuple):
    """The interval in which a value is sound, and how far outside it proves a fault."""

    low: float
    high: float
    tolerance: float

    def residual(self, value: float) -> float:
        """How far `value` lies outside, with its sign; 0 within."""
        return value - min(max(value, self.low), self.high)


class Motion(NamedTuple):
    """How the car moves, by the middle of all witnesses; None where too few speak."""

    speed_mps: float | None
    yaw_rate_radps: float | None
    acceleration_mps2: float | None
    """From the change of speed; None while it is not yet known."""
    swing_mps2: float = 0.0
    """By how much it has changed meanwhile: the change of speed tells of a jerk late."""


def middle(values: Iterable[float | None], tolerance: float) -> float | None:
    """The median of the known; of two only where they agree, of one none: it cannot be told which is wrong."""
    known = [value for value in values if value is not None]
    if len(known) < 2 or (len(known) == 2 and abs(known[0] - known[1]) > tolerance):
        return None
    return statistics.median(known)


def yaw_witnesses(values: Values, speed_mps: float | None, shape: Shape) -> tuple[float | None, ...]:
    """rad/s by: gyro, rear axle, front axle, steering of a neutral car."""

    def axle(left: str, right: str) -> float | None:
        slow, fast = values.get(left), values.get(right)
        return None if slow is None or fast is None else (fast - slow) / shape.track_m

    angle = values.get("steering_angle_rad")
    steered = None
    if angle is not None and speed_mps is not None:
        steered = speed_mps * math.tan(angle) / shape.wheelbase_m
    return values.get("yaw_rate_radps"), axle(*WHEELS[2:]), axle(*WHEELS[:2]), steered


def yaw_interval(values: Values, speed_mps: float, shape: Shape) -> Expected | None:
    """Where wheels and steering agree: the steering tells it well on a straight, the wheels at low speed. Where they do
    not agree one of them is wrong, and anything from one to the other may be.
    """
    _, rear, front, steered = yaw_witnesses(values, speed_mps, shape)
    by_wheels = 0.015 + RADIUS_SPREAD * speed_mps / shape.track_m
    known = [(value, by_wheels) for value in (rear, front) if value is not None]
    if steered is not None:
        sluggish = steered / (1.0 + MOST_UNDERSTEER_S2_PM2 * speed_mps**2)
        play = 0.01 + STEERING_PLAY_RAD * speed_mps / shape.wheelbase_m
        known.append(((steered + sluggish) / 2.0, abs(steered - sluggish) / 2.0 + play))
    if len(known) < 2:
        return None
    lows, highs = [value - wide for value, wide in known], [value + wide for value, wide in known]
    agreed = max(lows) <= min(highs)
    return Expected(max(lows), min(highs), 0.012) if agreed else Expected(min(lows), max(highs), 0.012)


def centre_speeds(values: Values, yaw_rate_radps: float | None, shape: Shape) -> dict[str, float | None]:
    """The speed of the car's middle by each wheel and by the speed signal."""
    lever = (yaw_rate_radps or 0.0) * shape.track_m / 2.0
    angle = math.cos(values.get("steering_angle_rad") or 0.0)
    cosines = dict(zip(WHEELS, (angle, angle, 1.0, 1.0), strict=True))
    found: dict[str, float | None] = {"speed_mps": values.get("speed_mps")}
    for name in WHEELS:
        value = values.get(name)
        found[name] = None if value is None else value * cosines[name] - _OUTWARD[name] * lever
    return found


def motion(values: Values, speeds: Sequence[tuple[float, float]], shape: Shape) -> Motion:
    """The car's motion; `speeds` is (s, m/s) of the last moments for the slope."""
    rough = middle(centre_speeds(values, None, shape).values(), 1.0)
    yaw = middle(yaw_witnesses(values, rough, shape), 0.05)
    return Motion(middle(centre_speeds(values, yaw, shape).values(), 1.0), yaw, slope(speeds), _swing(speeds))


def _swing(speeds: Sequence[tuple[float, float]]) -> float:
    half = len(speeds) // 2
    before, now = slope(speeds[:half]), slope(speeds[half:])
    return abs(now - before) if before is not None and now is not None else 0.0


def slope(points: Sequence[tuple[float, float]]) -> float | None:
    """Least squares, per second; None below eight points or over less than 0.3 s."""
    if len(points) < 8 or points[-1][0] - points[0][0] < 0.3:
        return None
    mean_t = sum([t for t, _ in points]) / len(points)
    mean_v = sum([v for _, v in points]) / len(points)
    return sum([(t - mean_t) * (v - mean_v) for t, v in points]) / sum([(t - mean_t) ** 2 for t, _ in points])


def expected(values: Values, moved: Motion, shape: Shape) -> dict[str, Expected]:
    """The fields that others vouch for now. Sliding, spinning and anti-lock braking vouch for nothing."""
    if any(values.get(name) for name in AT_WORK):
        return {}
    return _speeds(values, moved, shape) | _motions(values, moved, shape) | _pressure(values, moved, shape)


def _speeds(values: Values, moved: Motion, shape: Shape) -> dict[str, Expected]:
    demand = abs(moved.acceleration_mps2 or 0.0)
    if moved.speed_mps is None or demand > 5.0:
        return {}
    tolerance = 0.4 + (0.015 + SLIP_SHARE * demand / 5.0) * moved.speed_mps
    centre = centre_speeds(values, moved.yaw_rate_radps, shape)
    found = {}
    for name, value in centre.items():
        rest = middle((other for each, other in centre.items() if each != name), tolerance)
        own = values.get(name)
        if rest is not None and value is not None and own is not None:
            shifted = max(0.0, rest + own - value)
            found[name] = Expected(shifted, shifted, tolerance)
    return found


def _motions(values: Values, moved: Motion, shape: Shape) -> dict[str, Expected]:
    found = {}
    if moved.acceleration_mps2 is not None:
        tolerance = ACCELERATION_TOLERANCE + moved.swing_mps2
        found["acceleration_mps2"] = Expected(moved.acceleration_mps2, moved.acceleration_mps2, tolerance)
    if moved.speed_mps is not None:
        turning = yaw_interval(values, moved.speed_mps, shape)
        if turning is not None:
            found["yaw_rate_radps"] = turning
    return found


ACCELERATION_TOLERANCE = 0.65
"""m/s2. An accelerometer feels the slope of the road: 6.5 % of grade are 0.64 m/s2. On a steeper road it is doubted, which
costs only its field."""


def _pressure(values: Values, moved: Motion, shape: Shape) -> dict[str, Expected]:
    """Between what the foot asks for and what the car does: weak brakes and spongy pedals lie between them, a sensor
    that lies does not. A car that slows down without a foot may brake by itself, with no more pressure than shows in
    what it does; one that stands may be held by its brakes.
    """
    pedal, full, per = values.get("brake_pedal"), shape.brake_bar_full_pedal, shape.brake_bar_per_mps2
    stands = moved.speed_mps is not None and moved.speed_mps < MOVING_MPS
    if pedal is None or stands:
        return {}
    slows = -(moved.acceleration_mps2 or 0.0)
    most = max(slows, -(values.get("acceleration_mps2") or 0.0))  # felt at once, where the speed's slope takes moments
    if pedal < TOUCHED:
        pressure = values.get("brake_pressure_bar")
        own = min(max(0.0, pressure or 0.0), max(0.0, most) * (per or 0.0))
        return {} if pressure is None else {"brake_pressure_bar": Expected(own, own, 4.0 + 0.1 * own)}
    if full is None or per is None or moved.acceleration_mps2 is None or moved.speed_mps is None:
        return {}
    asked = pedal * full if pedal >= PRESSED else 0.0
    low, high = min(asked, max(0.0, slows) * per), max(asked, most * per)
    return {"brake_pressure_bar": Expected(low, high, 4.0 + 0.1 * high)}
