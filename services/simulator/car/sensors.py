"""The car's own sensors: the noise of sound ones, and the errors of faulty ones.

A value that is missing is not a number; the frames say "not available" for it.
"""

import math
import random
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

from services.simulator.car.condition import WHEELS, SensorFault
from services.simulator.car.state import CarState


@dataclass(frozen=True, slots=True)
class Sensor:
    """Where one sensor's value stands in the state, and how well it measures; units are the state's."""

    attribute: str
    index: int | None
    sigma: float
    """Noise of a sound one, sample by sample."""
    bias: float
    """Spread of a sound one's constant error from car to car."""
    noisy: float
    """Noise that a fault of severity 1 adds."""
    offset: float
    """Offset of a fault of severity 1."""
    lowest: float = -math.inf
    still: bool = False
    """Counts turns of a wheel: exact at standstill, its bias a share of the speed."""


def _wheel(index: int) -> Sensor:
    return Sensor("wheel_speeds_mps", index, 0.03, 0.002, 1.5, 3.0, 0.0, still=True)


def _tyre(index: int) -> Sensor:
    return Sensor("tyre_pressure_bar", index, 0.008, 0.02, 0.25, -0.6, 0.0)


SENSORS: Mapping[str, Sensor] = {
    **{f"wheel_{wheel}": _wheel(index) for index, wheel in enumerate(WHEELS)},
    "speed": Sensor("speed_mps", None, 0.03, 0.002, 1.5, 4.0, 0.0, still=True),
    "acceleration": Sensor("acceleration_mps2", None, 0.08, 0.05, 1.5, 2.0),
    "yaw_rate": Sensor("yaw_rate_radps", None, 0.003, 0.002, 0.08, 0.12),
    "brake_pressure": Sensor("brake_pressure_bar", None, 0.2, 0.5, 12.0, 25.0, -20.0),
    **{f"tyre_pressure_{wheel}": _tyre(index) for index, wheel in enumerate(WHEELS)},
    "outside_temperature": Sensor("outside_temperature_c", None, 0.1, 0.3, 5.0, 15.0),
}


class CarSensors:
    """The sensors of one car; their errors come from its seed."""

    def __init__(self, seed: int) -> None:
        self._chance = random.Random(f"car sensors {seed}")
        self._bias = {name: self._chance.gauss(0.0, sensor.bias) for name, sensor in SENSORS.items()}
        self._frozen: dict[str, float] = {}

    def measure(self, state: CarState, faults: tuple[SensorFault, ...]) -> CarState:
        """The state as it is told; nothing of the car's motion changes."""
        told = {name: self._sound(name, sensor, state) for name, sensor in SENSORS.items()}
        self._frozen = {
            fault.sensor: self._frozen.get(fault.sensor, told[fault.sensor])
            for fault in faults
            if fault.kind == "stuck"
        }
        for fault in faults:
            told[fault.sensor] = self._faulty(fault, told[fault.sensor])
        return _with(state, told)

    def _sound(self, name: str, sensor: Sensor, state: CarState) -> float:
        true = read(sensor, state)
        if not sensor.still:
            return max(sensor.lowest, true + self._bias[name] + self._chance.gauss(0.0, sensor.sigma))
        turns = min(1.0, true) * self._chance.gauss(0.0, sensor.sigma)
        return max(0.0, true * (1.0 + self._bias[name]) + turns)

    def _faulty(self, fault: SensorFault, told: float) -> float:
        sensor = SENSORS[fault.sensor]
        if fault.kind == "missing":
            return math.nan
        if fault.kind == "stuck":
            return self._frozen[fault.sensor]
        if fault.kind == "offset":
            return max(sensor.lowest, told + sensor.offset * fault.severity)
        return max(sensor.lowest, told + self._chance.gauss(0.0, sensor.noisy * fault.severity))


def read(sensor: Sensor, state: CarState) -> float:
    """The value of a sensor's place in the state."""
    value: Any = getattr(state, sensor.attribute)
    return float(value if sensor.index is None else value[sensor.index])


def without_gaps(told: CarState, state: CarState) -> CarState:
    """`told` with what is missing taken from `state`: for answers that have no way of saying "not available"."""
    values = {name: read(sensor, told) for name, sensor in SENSORS.items()}
    if not any(map(math.isnan, values.values())):
        return told
    return _with(
        told, {name: read(SENSORS[name], state) if math.isnan(value) else value for name, value in values.items()}
    )


def _with(state: CarState, told: Mapping[str, float]) -> CarState:
    changed: dict[str, Any] = {}
    for name, sensor in SENSORS.items():
        if sensor.index is None:
            changed[sensor.attribute] = told[name]
        else:
            changed[sensor.attribute] = (*changed.get(sensor.attribute, ()), told[name])
    return replace(state, **changed)
