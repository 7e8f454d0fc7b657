"""How the car's own control units watch their sensors: what contradicts itself for long enough sets a code, lights a
lamp and switches off what depends on it, until the car is started again.

They see what the sensors tell, never the state itself; small offsets and noise within the bounds escape them, as they
escape real ones. Times and bounds are ours.
"""

import math
import statistics
from collections.abc import Mapping
from dataclasses import dataclass, field, replace

from services.simulator.car.sensors import SENSORS, read
from services.simulator.car.state import STEERING_RATIO, WHEELBASE_M, CarState
from services.simulator.car.tyres import NOMINAL_BAR

MISSING_S, WRONG_S = 0.3, 2.0
WHEEL_MPS, WHEEL_SHARE = 1.0, 0.06
"""A wheel this far from the middle of the four is wrong: no bend and no slip short of locking does that."""
SPEED_MPS, SPEED_SHARE = 1.5, 0.08
YAW_RADPS = 0.1
ACCELERATION_MPS2 = 1.5
PRESSURE_BAR = 15.0
LAMP_SHARE = 0.8
"""Tyre pressure of which the lamp comes on (UN R141)."""


@dataclass(frozen=True, slots=True)
class Response:
    """The consequences of a sensor that is not believed."""

    code: str
    lamps: frozenset[str]
    anti_lock: bool = True
    stability: bool = True


_BRAKES, _STABILITY, _TYRE = frozenset({"abs", "stability"}), frozenset({"stability"}), frozenset({"tyre"})
RESPONSES: Mapping[str, Response] = {
    "wheel_fl": Response("C0035", _BRAKES, False, False),
    "wheel_fr": Response("C0040", _BRAKES, False, False),
    "wheel_rl": Response("C0045", _BRAKES, False, False),
    "wheel_rr": Response("C0050", _BRAKES, False, False),
    "speed": Response("P0501", _STABILITY, stability=False),
    "acceleration": Response("C0062", _STABILITY, stability=False),
    "yaw_rate": Response("C0063", _STABILITY, stability=False),
    "brake_pressure": Response("C0044", _STABILITY, stability=False),
    "tyre_pressure_fl": Response("C0750", _TYRE),
    "tyre_pressure_fr": Response("C0755", _TYRE),
    "tyre_pressure_rl": Response("C0760", _TYRE),
    "tyre_pressure_rr": Response("C0765", _TYRE),
    "outside_temperature": Response("P0070", frozenset()),
}


@dataclass(slots=True)
class CarMonitor:
    """The watch over all sensors."""

    _wrong_s: dict[str, float] = field(default_factory=dict)
    _found: dict[str, None] = field(default_factory=dict)
    _speed: float | None = None
    _change: float = 0.0

    @property
    def anti_lock(self) -> bool:
        """Whether the anti-lock brakes still trust their sensors."""
        return all(RESPONSES[name].anti_lock for name in self._found)

    def watch(self, told: CarState, dt_s: float) -> CarState:
        """`told` with the codes, lamps and faults that come of it."""
        told_now = {name: read(sensor, told) for name, sensor in SENSORS.items()}
        self._follow_speed(told_now, dt_s)
        for name, wrong in self._judge(told, told_now).items():
            self._count(name, wrong, math.isnan(told_now[name]), dt_s)
        return self._respond(told)

    def _follow_speed(self, now: Mapping[str, float], dt_s: float) -> None:
        """The change of the middle wheel's speed, smoothed over half a second."""
        wheels = [now[name] for name in now if name.startswith("wheel") and not math.isnan(now[name])]
        if not wheels or dt_s <= 0.0:
            return
        speed = statistics.median(wheels)
        if self._speed is not None:
            share = min(1.0, dt_s / 0.5)
            self._change += ((speed - self._speed) / dt_s - self._change) * share
        self._speed = speed

    def _judge(self, told: CarState, now: Mapping[str, float]) -> dict[str, bool]:
        """Which sensors contradict the others at this instant; slipping wheels prove nothing."""
        wheels = {name: now[name] for name in now if name.startswith("wheel")}
        known = [value for value in wheels.values() if not math.isnan(value)]
        if told.abs_active or not told.speed_known or len(known) < 3:
            return {name: math.isnan(now[name]) for name in now if name not in wheels or not told.abs_active}
        middle = statistics.median(known)
        wrong = {name: abs(value - middle) > WHEEL_MPS + WHEEL_SHARE * middle for name, value in wheels.items()}
        wrong["speed"] = abs(now["speed"] - middle) > SPEED_MPS + SPEED_SHARE * middle
        steered = middle * math.tan(told.steering_wheel_rad / STEERING_RATIO) / WHEELBASE_M
        wrong["yaw_rate"] = abs(now["yaw_rate"] - steered) > YAW_RADPS
        wrong["acceleration"] = abs(now["acceleration"] - self._change) > ACCELERATION_MPS2
        wrong["brake_pressure"] = told.braked <= 0.01 and now["brake_pressure"] > PRESSURE_BAR
        low = (value < LAMP_SHARE * nominal for value, nominal in zip(told.tyre_pressure_bar, NOMINAL_BAR, strict=True))
        wrong |= dict(zip((name for name in now if name.startswith("tyre")), low, strict=True))
        wrong["outside_temperature"] = not -40.0 <= now["outside_temperature"] <= 60.0
        return {name: each or math.isnan(now[name]) for name, each in wrong.items()}

    def _count(self, name: str, wrong: bool, missing: bool, dt_s: float) -> None:
        self._wrong_s[name] = self._wrong_s.get(name, 0.0) + dt_s if wrong else 0.0
        if self._wrong_s[name] > (MISSING_S if missing else WRONG_S):
            self._found[name] = None

    def _respond(self, told: CarState) -> CarState:
        found = [RESPONSES[name] for name in self._found]
        if not found:
            return told
        codes = [response.code for response in found if response.code not in told.stored_codes]
        anti_lock, stability = (all(getattr(each, name) for each in found) for name in ("anti_lock", "stability"))
        return replace(
            told,
            stored_codes=(*told.stored_codes, *dict.fromkeys(codes)),
            lamps=told.lamps.union(*(response.lamps for response in found)),
            abs_fault=told.abs_fault or not anti_lock,
            abs_active=told.abs_active and anti_lock,
            esc_fault=told.esc_fault or not stability,
            esc_active=told.esc_active and stability,
        )
