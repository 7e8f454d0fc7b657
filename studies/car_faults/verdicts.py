"""What the CAN service says of a drive, in the words of the labels."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

from proto.vehicle import Degradation
from studies.car_faults.cases import FIELDS, Case

Class = Literal["sound", "sensor", "vehicle"]

_WHEELS = ("fl", "fr", "rl", "rr")
SAYS: Mapping[str, frozenset[str]] = {
    "overheat": frozenset({"coolant_hot", "coolant_rising"}),
    "low_fuel": frozenset({"fuel_low"}),
    "low_tyre": frozenset({"tyre_pressure_low_rr", "slow_leak_rr", "fast_leak_rr"}),
    "booster_lost": frozenset({"brake_booster_fault"}),
    "circuit_lost": frozenset({"brake_fluid_low"}),
    "brakes_hot": frozenset({"brakes_hot", *(f"brakes_heating_{wheel}" for wheel in _WHEELS)}),
    "lining_worn": frozenset({"brake_lining_worn"}),
    "abs_unit": frozenset({"abs_fault"}),
    "stability_off": frozenset({"stability_off"}),
    "low_battery": frozenset({"battery_low", "battery_sinking"}),
    "headlamps_out": frozenset({"lamps_off_in_the_dark"}),
    "wipers_broken": frozenset({"wipers_off_in_rain"}),
    "oil_pressure": frozenset({"oil_pressure_low"}),
    "steering_assist": frozenset({"steering_assist_fault"}),
    **{
        f"slow_leak_{wheel}": frozenset({f"tyre_pressure_low_{wheel}", f"slow_leak_{wheel}", f"fast_leak_{wheel}"})
        for wheel in _WHEELS
    },
}
"""Preset -> indicators and trends that name it."""
FOLLOWS: Mapping[str, frozenset[str]] = {
    "overheat": frozenset({"engine_lamp"}),
    "booster_lost": frozenset({"brake_lamp", "brakes_weak"}),
    "circuit_lost": frozenset({"brake_lamp", "brakes_weak", "pedal_spongy"}),
    "brakes_hot": frozenset({"brakes_weak"}),
    "lining_worn": frozenset({"brakes_weak"}),
    "abs_unit": frozenset({"stability_fault"}),
    "stability_off": frozenset({"stability_fault"}),
}
"""What else the same fault brings about."""
NOT_A_FAULT = frozenset({"trouble_codes", "bus_silent"})
LEAST = 0.02
"""An indicator below this is not raised."""


@dataclass(frozen=True, slots=True)
class Verdict:
    """What is said to be wrong: nothing, sensors by field and kind, or indicators and trends of the car."""

    sensors: tuple[tuple[str, str], ...] = ()
    car: frozenset[str] = frozenset()

    @property
    def says(self) -> Class:
        """A sensor that is not believed comes first: what it brings about in the car follows from it."""
        return "sensor" if self.sensors else "vehicle" if self.car else "sound"

    @property
    def words(self) -> str:
        """For the list of what went wrong."""
        return " ".join(f"{field}:{kind}" for field, kind in self.sensors) or " ".join(sorted(self.car)) or "sound"


def verdict(degradation: Degradation) -> Verdict:
    """The verdict of one message."""
    raised = {each.name for each in degradation.indicators if each.value > LEAST} - NOT_A_FAULT
    return Verdict(
        sensors=tuple((each.field, each.kind) for each in degradation.sensor_faults),
        car=frozenset(raised | {each.name for each in degradation.trends}),
    )


def truth(case: Case) -> Class:
    """What is wrong in a case."""
    return "sound" if case.onset is None else "sensor" if case.sensor else "vehicle"


def right(case: Case, said: Verdict) -> bool:
    """Whether the verdict names the fault, and nothing else."""
    if truth(case) != said.says:
        return False
    if case.sensor:
        return {field for field, _ in said.sensors} == {FIELDS[case.sensor]}
    named, follows = SAYS.get(case.label, frozenset()), FOLLOWS.get(case.label, frozenset())
    return case.onset is None or (bool(said.car & named) and said.car <= named | follows)


def right_kind(case: Case, said: Verdict) -> bool:
    """Whether it also names what the sensor does: stuck, noisy, offset, missing."""
    return right(case, said) and {kind for _, kind in said.sensors} == {case.kind}
