"""What only driving shows over time: how soft a tyre is by how fast its wheel turns, how much braking a bar of pressure
gives, how much pressure the pedal gives. Each sums up only while the car moves in a way that proves something.
"""

import statistics
from collections import deque
from collections.abc import Mapping
from typing import NamedTuple

from services.can.health.expected_values import (
    PRESSED,
    SLOPE_SAMPLES,
    WHEELS,
    Expected,
    Motion,
    Shape,
    Values,
    centre_speeds,
    middle,
    slope,
)

TYRES = tuple(f"tyre_pressure_{wheel}_bar" for wheel in ("fl", "fr", "rl", "rr"))
RADIUS_SHARE_LEAST, RADIUS_SHARE_MOST = 0.012, 0.045
"""By so much per share of lost pressure a wheel turns faster. Indirect pressure monitoring sees a fifth lost as 0.3 to
0.6 % (Persson, Gustafsson, Drevö, SAE 2002-01-1250). For what is measured in a few seconds, half as much again."""
TYRE_SLACK = 0.08
"""Share of pressure within which wheel and sensor agree, against the others: weather and warmth move all four."""
FILTER_S = 8.0
LEARN_S, ENOUGH_S = 8.0, 6.0
SOUND_SHARE = 0.9
SOFT_FROM, SOFT_TO = 0.006, 0.02
"""A wheel that runs faster than it used to by so much is soft."""


class Soft(NamedTuple):
    """One wheel's running mean of how much faster it turns than the middle, and of what its pressure sensor says."""

    ahead: float = 0.0
    share: float | None = None
    seen_s: float = 0.0
    base: float = 0.0
    base_s: float = 0.0
    base_share: float = 0.0
    learnt_s: float = 0.0


class TyreRatios:
    """Wheels against each other on straight, steady road."""

    def __init__(self, nominal_bar: tuple[float, ...]) -> None:
        self._nominal = dict(zip(TYRES, nominal_bar, strict=True))
        self._soft = dict.fromkeys(TYRES, Soft())

    def step(self, values: Values, moved: Motion, shape: Shape, dt_s: float) -> None:
        """One sample later; `values` lacks what is not believed."""
        speed = moved.speed_mps
        self._learn(values, dt_s)
        if speed is None or speed < 7.0 or abs(moved.acceleration_mps2 or 9.0) > 1.5 or values.get("abs_active"):
            return
        centre = centre_speeds(values, moved.yaw_rate_radps, shape)
        for name, wheel in zip(TYRES, WHEELS, strict=True):
            own, rest = centre[wheel], middle((centre[each] for each in WHEELS if each != wheel), 0.5)
            if own is not None and rest is not None:
                pressure = values.get(name)
                share = None if pressure is None else pressure / self._nominal[name]
                self._soft[name] = _later(self._soft[name], own / rest - 1.0, share, dt_s)

    def _learn(self, values: Values, dt_s: float) -> None:
        """What the sensors said at the beginning: the cold pressures that this car was given."""
        for name, soft in self._soft.items():
            value = values.get(name)
            share = 0.0 if value is None else value / self._nominal[name]
            if soft.learnt_s < LEARN_S and share >= SOUND_SHARE:
                part = dt_s / (soft.learnt_s + dt_s) if dt_s > 0.0 else 1.0
                base = soft.base_share + (share - soft.base_share) * part
                self._soft[name] = soft._replace(base_share=base, learnt_s=soft.learnt_s + dt_s)

    def expected(self) -> dict[str, tuple[float, Expected]]:
        """Field -> (the mean of its sensor, what the wheel's speed makes of it), of those that were driven in."""
        driven = {
            name: (soft.ahead - soft.base, soft.share, soft.share / soft.base_share)
            for name, soft in self._soft.items()
            if min(soft.base_s, soft.learnt_s) >= LEARN_S and soft.seen_s >= ENOUGH_S and soft.share is not None
        }
        found = {}
        for name, (ahead, share, _) in driven.items():
            others = [since for each, (_, _, since) in driven.items() if each != name]
            if len(others) >= 2:
                sound_bar = self._soft[name].base_share * statistics.median(others) * self._nominal[name]
                found[name] = (share * self._nominal[name], _by_wheel(ahead, sound_bar))
        return found

    def softness(self) -> dict[str, float]:
        """Share by which each wheel turns faster than it did when its tyre was sound."""
        return {name: soft.ahead - soft.base for name, soft in self._soft.items() if soft.base_s >= LEARN_S}


def _by_wheel(ahead: float, sound_bar: float) -> Expected:
    """The pressures that fit a wheel which runs ahead by this share, where a sound tyre would have `sound_bar`."""
    losses = (ahead / RADIUS_SHARE_MOST, ahead / RADIUS_SHARE_LEAST)
    low, high = 1.0 - max(*losses, 0.0) - TYRE_SLACK, 1.0 - min(*losses, 0.0 if ahead < SOFT_FROM else 1.0) + TYRE_SLACK
    return Expected(low * sound_bar, high * sound_bar, 0.01 * sound_bar)


def _later(soft: Soft, ahead: float, share: float | None, dt_s: float) -> Soft:
    dt_s = max(dt_s, 1e-3)
    weight = dt_s / (FILTER_S + dt_s) if soft.seen_s > FILTER_S else dt_s / (soft.seen_s + dt_s)
    now = soft.ahead + (ahead - soft.ahead) * weight
    heard = soft.share if share is None else share if soft.share is None else soft.share + (share - soft.share) * weight
    base, base_s = soft.base, soft.base_s
    if base_s < LEARN_S and (share or 0.0) >= SOUND_SHARE * soft.base_share:
        base, base_s = base + (ahead - base) * dt_s / (base_s + dt_s), base_s + dt_s
    return soft._replace(ahead=now, share=heard, seen_s=soft.seen_s + dt_s, base=base, base_s=base_s)


SETTLED_S = 1.2
"""The deceleration is known from the speed only so long after the foot came down, anti-lock let go, or the wheels were seen
to stand."""


class Sum(NamedTuple):
    """Fading sums of what was done and what was asked for."""

    done: float = 0.0
    asked: float = 0.0
    seen_s: float = 0.0

    def later(self, done: float, asked: float, dt_s: float) -> "Sum":
        """One sample later; what is 20 s of braking old has faded."""
        keep = 1.0 - dt_s / 20.0
        return Sum(self.done * keep + done * dt_s, self.asked * keep + asked * dt_s, self.seen_s + dt_s)

    @property
    def share(self) -> float | None:
        """Done per asked; None before 1.5 s of it."""
        return self.done / self.asked if self.seen_s >= 1.5 and self.asked > 0.0 else None


class BrakeEffect:
    """Deceleration per pressure and pressure per pedal, over the last 20 s of braking."""

    def __init__(self) -> None:
        self._effect, self._pedal = Sum(), Sum()
        self._pressed_s = 0.0
        self._time_s, self._lost_mps = 0.0, 0.0
        self._asked: deque[tuple[float, float]] = deque(maxlen=SLOPE_SAMPLES)

    def step(self, values: Values, moved: Motion, shape: Shape, dt_s: float) -> None:
        """One sample later. Braking at the limit of grip proves nothing of the brakes: anti-lock at work, or wheels that
        stand while the car slides and then turn again.
        """
        pedal, pressure = values.get("brake_pedal"), values.get("brake_pressure_bar")
        per, full, speed = shape.brake_bar_per_mps2, shape.brake_bar_full_pedal, moved.speed_mps
        asked = self._asked_mps2(pressure, per, dt_s)
        if pedal is None or pressure is None or full is None or per is None or pedal < 4.0 * PRESSED:
            self._pressed_s = 0.0
            return
        self._pressed_s += dt_s
        self._pedal = self._pedal.later(pressure, pedal * full, dt_s)
        change, at_limit = moved.acceleration_mps2, bool(values.get("abs_active"))
        if asked is None or speed is None or speed < 4.0 or change is None or at_limit:
            self._pressed_s = 0.0
        elif not -1.0 <= -change <= 1.5 * asked + 1.0:
            self._pressed_s = 0.0  # a brake gives what is asked for, or less: its wheels lock, or turn again
        elif asked >= 1.5 and self._pressed_s > SETTLED_S:
            self._effect = self._effect.later(-change, asked, dt_s)

    def _asked_mps2(self, pressure: float | None, per: float | None, dt_s: float) -> float | None:
        """The deceleration asked for, over the same moments and weighed alike as the speed's slope tells the one that was
        given: a foot that presses harder is no brake that gives less.
        """
        told = slope(self._asked)
        self._time_s += dt_s
        if pressure is None or per is None:
            self._asked.clear()
            return None
        self._lost_mps += pressure / per * dt_s
        self._asked.append((self._time_s, self._lost_mps))
        return told

    def shares(self) -> Mapping[str, float]:
        """`brake_effect` and `pedal_pressure`, of those that were measured; 1 is a sound car."""
        found = {"brake_effect": self._effect.share, "pedal_pressure": self._pedal.share}
        return {name: share for name, share in found.items() if share is not None}
