"""The whole car beside its motion: mechanics, faults, sensors and the units that watch them, step by step."""

from dataclasses import dataclass, replace

from services.simulator.car import braking
from services.simulator.car.braking import Ability
from services.simulator.car.faults import Faults
from services.simulator.car.monitor import CarMonitor
from services.simulator.car.sensors import CarSensors, without_gaps
from services.simulator.car.state import CarModel, CarState, Controls, parked


@dataclass(frozen=True, slots=True)
class CarMessages:
    """The car's messages after a step."""

    frames: CarState
    """For its cyclic frames; what is missing is not a number."""
    silent: frozenset[str]
    """Messages that are not sent."""
    units: CarState
    """For answers of its control units."""


class Car:
    """One car with its faults; `seed` draws the errors of its sensors."""

    def __init__(self, seed: int, faults: Faults, outside_c: float) -> None:
        self._model, self._faults = CarModel(parked(outside_c)), faults
        self._sensors, self._monitor, self._ailing = CarSensors(seed), CarMonitor(), False

    @property
    def state(self) -> CarState:
        """How it really is."""
        return self._model.state

    def ability(self, now_ns: int) -> Ability:
        """What it brings to a braking now; the anti-lock brakes work only while they trust their sensors."""
        able = braking.ability(self._faults.condition(now_ns), self.state)
        return replace(able, anti_lock=able.anti_lock and self._monitor.anti_lock)

    def step(self, dt_s: float, controls: Controls, now_ns: int) -> CarMessages:
        """The car `dt_s` later."""
        if self._ailing and not self._faults.active:
            self._monitor = CarMonitor()  # mended, and started again
        self._ailing = bool(self._faults.active)
        condition = self._faults.condition(now_ns)
        shown = self._faults.show(self._model.step(dt_s, controls, condition), now_ns)
        told = self._monitor.watch(self._sensors.measure(shown, condition.sensors), dt_s)
        return CarMessages(frames=told, silent=condition.silent, units=without_gaps(told, shown))
