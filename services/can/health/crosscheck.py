"""Distinguishes sensor faults from faults of the car: each sensor against what the others say it should show.

Every 50 ms of frame time one sample is judged. Evidence for a kind of fault grows with the time that shows it and
shrinks twice as fast without (a CUSUM with a drift). Over its threshold the sensor is convicted. It stays so until it
was plausible for `CLEAR_S` under a check that could have found the fault. Same frames, same verdicts.
"""

import math
import statistics
from collections import deque
from collections.abc import Iterable, Mapping, Sequence
from typing import NamedTuple

from proto.vehicle import SensorFault, SensorFaultKind
from services.can.health.expected_values import SLOPE_SAMPLES, WHEELS, Expected, Motion, Shape, expected, motion
from services.can.health.ratios import TYRES, BrakeEffect, TyreRatios
from services.can.signals import reasons
from services.can.signals.field import Reading

NS = 1_000_000_000
SAMPLE_NS = 50_000_000
CLEAR_S = 30.0
"""A convicted sensor is believed again after so long of plausible values under a check of it."""
MAX_STEP_S = 0.5
"""A pause longer than this counts as this much evidence."""
UNEVEN = 0.003
"""A wheel that runs ahead by this share makes its axle tell a bend that is not there."""


class Rule(NamedTuple):
    """How one sensor is judged. Units are the field's."""

    field: str
    noise: float
    """Standard deviation that a sound sensor stays below, by the median of second differences."""
    moves: float = 0.0
    """Where the others moved by this much while it stood still, it is stuck. 0: the others cannot tell."""
    rate: float = 0.0
    """For sensors that no other one vouches for: a sound one changes no faster, per second. 0: not checked."""
    jump: float = 0.0
    """How far it may run ahead of `rate`."""
    falls: bool = True
    """Whether running ahead downwards proves a fault too: a tyre can burst, but never gain air."""


SENSORS: tuple[Rule, ...] = (
    # Noise of a Hall wheel sensor is below 0.1 m/s; 0.3 is no wheel on a road.
    *(Rule(name, noise=0.3, moves=0.8) for name in WHEELS),
    Rule("speed_mps", noise=0.3, moves=0.8),
    # Rough roads shake a filtered accelerometer by 0.2 m/s2.
    Rule("acceleration_mps2", noise=0.35, moves=0.9),
    # MEMS gyros of stability control have below 0.01 rad/s.
    Rule("yaw_rate_radps", noise=0.018, moves=0.05),
    Rule("brake_pressure_bar", noise=2.0, moves=8.0),
    # Pumping adds 0.05 bar/s at most, and no car is pumped while it drives.
    *(Rule(name, noise=0.05, rate=0.05, jump=0.2, falls=False) for name in TYRES),
    # Behind the bumper the air's change reaches the sensor over minutes.
    Rule("outside_temperature_c", noise=0.8, rate=0.15, jump=3.0),
)
NEEDED_S: Mapping[SensorFaultKind, float] = {
    "missing": 1.0, "stuck": 1.0, "noisy": 1.0, "offset": 2.0, "implausible": 3.0,
}  # fmt: skip
"""Seconds of evidence for a conviction."""
_ORDER: tuple[SensorFaultKind, ...] = ("missing", "stuck", "noisy", "offset", "implausible")
NEVER_S = 6.0
"""A sensor of this car that was never heard by then is missing."""
NOISE_SAMPLES, NOISE_LEAST = 24, 10
MEAN_SAMPLES = 20


class _Watch:
    """One sensor over time."""

    def __init__(self, rule: Rule) -> None:
        self.rule = rule
        self.evidence: dict[SensorFaultKind, float] = dict.fromkeys(_ORDER, 0.0)
        self.verdict: SensorFaultKind | None = None
        self.plausible_s = 0.0
        self._recent: deque[float] = deque(maxlen=2)
        self._bends: deque[float] = deque(maxlen=NOISE_SAMPLES - 2)
        """Second differences of its samples, their sign aside, but for what the car did itself."""
        self._residuals: deque[float] = deque(maxlen=MEAN_SAMPLES)
        self._stamp_ns = 0
        self._last: float | None = None
        self._same_s = 0.0
        self._witnessed: tuple[float, float] | None = None
        self._anchor: float | None = None

    def step(
        self,
        reading: Reading,
        sound: Expected | None,
        dt_s: float,
        *,
        age_s: float,
        mean: float | None = None,
        jolt: float = 0.0,
    ) -> None:
        """One sample later; `mean` is what `sound` is held against where that is a mean of the field over seconds, `jolt`
        the second difference that another sensor tells of.
        """
        if reading.value is None:
            shown: frozenset[SensorFaultKind] = self._silent(reading, age_s)
            able = False
        else:
            fresh = reading.stamp_ns != self._stamp_ns
            self._stamp_ns = reading.stamp_ns
            if fresh:
                self._bend(reading.value, jolt)
            residual = self._take(reading.value, sound, dt_s, mean=mean)
            shown = self._shown(residual, sound)
            able = sound is not None or self.rule.rate > 0.0 or self.verdict in ("noisy", "missing")
        self._weigh(shown, dt_s, able=able)

    @property
    def doubted(self) -> bool:
        """Whether anything speaks against it now."""
        return self.verdict is not None or any(self.evidence.values())

    def _silent(self, reading: Reading, age_s: float) -> frozenset[SensorFaultKind]:
        if reading.reason == reasons.REPEATED:
            return frozenset({"stuck"})
        if reading.reason == reasons.JUMPED:
            return frozenset({"noisy"})
        gone = reading.reason in reasons.GONE and (reading.stamp_ns > 0 or age_s > NEVER_S)
        return frozenset({"missing"}) if gone else frozenset()

    def _bend(self, value: float, jolt: float) -> None:
        if len(self._recent) == 2:
            bend = _second_difference((*self._recent, value))
            self._bends.append(min(abs(bend), abs(bend - jolt)))
        self._recent.append(value)

    def _take(self, value: float, sound: Expected | None, dt_s: float, *, mean: float | None) -> float | None:
        """Remember the value; its residual where other sensors or the rule's `rate` tell one, else `None`."""
        if value != self._last:
            self._last, self._same_s, self._witnessed = value, 0.0, None
        self._same_s += dt_s
        if sound is not None:
            low, high = self._witnessed or (sound.low, sound.high)
            # An interval counts as moved only where none of its ends would have allowed the value to stand.
            self._witnessed = (min(low, sound.low), max(high, sound.high))
            residual = sound.residual(value if mean is None else mean)
        elif self.rule.rate > 0.0:
            residual = self._ahead(value, dt_s)
        else:
            return None
        self._residuals.append(residual)
        return residual

    def _ahead(self, value: float, dt_s: float) -> float:
        """How far the value runs ahead of a follower that keeps to the rate of nature; while convicted it waits."""
        if self._anchor is None:
            self._anchor = value
        ahead = value - self._anchor
        out = abs(ahead) > self.rule.jump and (ahead > 0.0 or self.rule.falls)
        reach = self.rule.rate * dt_s * (0.02 if out or self.verdict == "offset" else 1.0)
        self._anchor += min(max(ahead, -reach), reach) if ahead > 0.0 or self.rule.falls else ahead
        return ahead - math.copysign(self.rule.jump, ahead) if out else 0.0

    def _shown(self, residual: float | None, sound: Expected | None) -> frozenset[SensorFaultKind]:
        if self._noise() > self.rule.noise:
            return frozenset({"noisy"})
        if residual is None or len(self._residuals) < MEAN_SAMPLES // 2:
            return frozenset()
        tolerance = sound.tolerance if sound is not None else 0.0
        if self._stood_while_others_moved() and abs(residual) > tolerance / 2.0:
            return frozenset({"stuck"})
        if abs(statistics.fmean(self._residuals)) > tolerance:
            return frozenset({"offset"})
        return frozenset({"implausible"}) if abs(residual) > 2.0 * tolerance > 0.0 else frozenset()

    def _stood_while_others_moved(self) -> bool:
        if self.rule.moves == 0.0 or self._witnessed is None or self._same_s < 0.5:
            return False
        return self._witnessed[1] - self._witnessed[0] > self.rule.moves

    def _noise(self) -> float:
        """Standard deviation of white noise by the median of second differences: ramps and single steps do not count."""
        if len(self._bends) < NOISE_LEAST - 2:
            return 0.0
        bends = sorted(self._bends)
        return bends[len(bends) // 2] / 1.652

    def _weigh(self, shown: frozenset[SensorFaultKind], dt_s: float, *, able: bool) -> None:
        for kind in _ORDER if shown or self.doubted else ():
            change = dt_s if kind in shown else -2.0 * dt_s if shown or able else 0.0
            self.evidence[kind] = min(max(0.0, self.evidence[kind] + change), 2.0 * NEEDED_S[kind])
        grave = any(self.evidence[kind] > 0.5 * NEEDED_S[kind] for kind in _ORDER)
        self.plausible_s = 0.0 if grave else self.plausible_s + (dt_s if able else 0.0)
        found = [kind for kind in _ORDER if self.evidence[kind] >= NEEDED_S[kind]]
        if found and (self.verdict is None or self._plainer(found[0])):
            self.verdict = found[0]
        elif not found and self.plausible_s >= CLEAR_S:
            self.verdict = None

    def _plainer(self, kind: SensorFaultKind) -> bool:
        """Whether a kind that shows itself later says more than the one first told."""
        later = self.verdict is not None and _ORDER.index(kind) < _ORDER.index(self.verdict)
        return later and self.evidence[kind] >= 2.0 * NEEDED_S[kind]


class CrossChecks:
    """All sensors of one car. One thread steps; others read `faults`."""

    def __init__(self, shape: Shape, tyre_nominal_bar: tuple[float, ...], fields: Iterable[str]) -> None:
        present = set(fields)
        self.shape, self.tyres, self.brakes = shape, TyreRatios(tyre_nominal_bar), BrakeEffect()
        self._watches = tuple(_Watch(rule) for rule in SENSORS if rule.field in present)
        self._speeds: deque[tuple[float, float]] = deque(maxlen=SLOPE_SAMPLES)
        self._braked: deque[tuple[float | None, float | None]] = deque(maxlen=3)
        """(acceleration, pressure) of the last samples."""
        self._last_ns = 0
        self._age_s = 0.0
        self.moved = Motion(None, None, None)
        self.faults: tuple[SensorFault, ...] = ()
        self.convicted: Mapping[str, SensorFaultKind] = {}
        """The fields that are not to be used, and why."""

    def step(self, readings: Mapping[str, Reading], stamp_ns: int) -> None:
        """Judge one sample; a stamp that falls back begins anew without forgetting who was convicted."""
        dt_s = min(max(0.0, (stamp_ns - self._last_ns) / NS), MAX_STEP_S) if self._last_ns else 0.0
        if stamp_ns < self._last_ns:
            self._speeds.clear()
            self._braked.clear()
        self._last_ns = stamp_ns
        if all(reading.value is None for reading in readings.values()):
            return  # a dead bus says nothing of its sensors
        self._age_s += dt_s
        trusted = {name: None if name in self.convicted else reading.value for name, reading in readings.items()}
        self.moved = self._move(trusted, stamp_ns)
        self.tyres.step(
            {**trusted, **{n: readings[n].value for n in TYRES if n in readings}}, self.moved, self.shape, dt_s
        )
        self.brakes.step(trusted, self.moved, self.shape, dt_s)
        sound = expected(trusted, self.moved, self.shape)
        if max(self.tyres.softness().values(), default=0.0) > UNEVEN:
            sound.pop("yaw_rate_radps", None)  # a soft tyre bends the yaw rate that its axle tells
        doubted = {each.rule.field for each in self._watches if each.doubted}
        rolling = {
            tyre: row
            for (tyre, row), wheel in ((each, _WHEEL_OF[each[0]]) for each in self.tyres.expected().items())
            if wheel not in doubted
        }
        jolts = self._jolts(trusted)
        for watch in self._watches:
            self._judge(watch, readings, trusted, sound, rolling, jolts, dt_s)
        self._convict()

    def _convict(self) -> None:
        before = self.lying
        self.faults = tuple(
            SensorFault(field=each.rule.field, kind=each.verdict, detail=_DETAIL[each.verdict])
            for each in self._watches
            if each.verdict is not None
        )
        self.convicted = {each.field: each.kind for each in self.faults}
        if "brake_pressure_bar" in self.lying - before:
            self.brakes = BrakeEffect()  # what was measured by it is void

    @property
    def lying(self) -> frozenset[str]:
        """The fields whose word is void. One that is merely missing told no lie while it spoke."""
        return frozenset(name for name, kind in self.convicted.items() if kind != "missing")

    def measured(self) -> dict[str, float | None]:
        """What driving has shown of brakes and tyres, by the names that the health table reads."""
        lying = self.lying
        ahead = {tyre: soft for tyre, soft in self.tyres.softness().items() if _WHEEL_OF[tyre] not in lying}
        soft = {f"softness_{wheel}": ahead.get(tyre) for tyre, wheel in _PLACE_OF.items()}
        return {name: value for name, value in {**self.brakes.shares(), **soft}.items() if value is not None}

    def _jolts(self, trusted: Mapping[str, float | None]) -> Mapping[str, float]:
        """Brakes that are put on and let go in a tenth of a second bend pressure and acceleration alike: what each of the
        two should have bent by, told by the other.
        """
        self._braked.append((trusted.get("acceleration_mps2"), trusted.get("brake_pressure_bar")))
        per = self.shape.brake_bar_per_mps2
        if per is None:
            return {}
        by_acceleration, by_pressure = (_second_difference(row) for row in zip(*self._braked, strict=True))
        return {"acceleration_mps2": -by_pressure / per, "brake_pressure_bar": -by_acceleration * per}

    def _move(self, trusted: Mapping[str, float | None], stamp_ns: int) -> Motion:
        now = motion(trusted, tuple(self._speeds), self.shape)
        if now.speed_mps is not None:
            self._speeds.append((stamp_ns / NS, now.speed_mps))
        return now

    def _judge(
        self,
        watch: _Watch,
        readings: Mapping[str, Reading],
        trusted: Mapping[str, float | None],
        sound: Mapping[str, Expected],
        rolling: Mapping[str, tuple[float, Expected]],
        jolts: Mapping[str, float],
        dt_s: float,
    ) -> None:
        name = watch.rule.field
        if watch.verdict is not None:  # its own value is not among the trusted: ask what the others say of it
            sound = expected({**trusted, name: readings[name].value}, self.moved, self.shape)
        mean, by_wheel = rolling.get(name, (None, None))
        beside = sound.get(name, by_wheel)
        watch.step(readings[name], beside, dt_s, age_s=self._age_s, mean=mean, jolt=jolts.get(name, 0.0))


def _second_difference(values: Sequence[float | None]) -> float:
    """Of the last three; 0 where one is unknown."""
    known = [value for value in values if value is not None]
    return known[0] - 2.0 * known[1] + known[2] if len(known) == 3 else 0.0


_PLACE_OF = dict(zip(TYRES, ("fl", "fr", "rl", "rr"), strict=True))
_WHEEL_OF = dict(zip(TYRES, WHEELS, strict=True))
_DETAIL: Mapping[SensorFaultKind, str] = {
    "missing": "no usable value while the bus is alive",
    "stuck": "stands still while the others move",
    "noisy": "scatters more than a sound sensor",
    "offset": "differs from the others by more than they differ among themselves",
    "implausible": "contradicted by the others",
}
