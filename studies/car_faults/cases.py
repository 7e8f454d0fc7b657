"""The seeded set: which drive has which fault. 139 sound ones, 235 with a faulty sensor, 126 with a fault of the car.

Left out: tyre pressure and temperature sensors that stick, because what they measure does not move in two minutes.
"""

import itertools
import random
from dataclasses import dataclass
from typing import Literal

from services.simulator.car.condition import SENSOR_KINDS
from services.simulator.car.faults import FAULTS
from services.simulator.car.sensors import SENSORS
from studies.car_faults.courses import Course, draw_course
from studies.car_faults.drives import Onset

Seeds = Literal["test", "calibration"]
FIRST_SEED: dict[Seeds, int] = {"test": 10_000, "calibration": 20_000}
SOUND = 139
PER_SENSOR_FAULT, PER_VEHICLE_FAULT = 5, 7
LEAST_SEVERITY = 0.5

FIELDS = {
    **{name: f"{name}_mps" for name in ("wheel_fl", "wheel_fr", "wheel_rl", "wheel_rr", "speed")},
    "acceleration": "acceleration_mps2",
    "yaw_rate": "yaw_rate_radps",
    "brake_pressure": "brake_pressure_bar",
    **{f"tyre_pressure_{wheel}": f"tyre_pressure_{wheel}_bar" for wheel in ("fl", "fr", "rl", "rr")},
    "outside_temperature": "outside_temperature_c",
}
"""Sensor -> the curated field that it feeds."""
SLOW = frozenset(name for name in SENSORS if name.startswith(("tyre", "outside")))
SENSOR_FAULTS = tuple(
    (sensor, kind)
    for sensor, kind in itertools.product(SENSORS, SENSOR_KINDS)
    if not (sensor in SLOW and kind == "stuck")
)
_SENSOR_PRESETS = frozenset(f"{sensor}_{kind}" for sensor, kind in itertools.product(SENSORS, SENSOR_KINDS))
_NOT_SCORED = {"abs_fault", "fuel_cap_loose"}
VEHICLE_FAULTS = tuple(
    preset for preset in FAULTS if preset not in _SENSOR_PRESETS | _NOT_SCORED and not preset.endswith("_silent")
)
"""`abs_fault` is a dead wheel speed sensor: among the sensors. A silent unit is all of its sensors at once. A loose
filler cap changes nothing but its code.
"""


@dataclass(frozen=True, slots=True)
class Case:
    """One labelled drive. `sensor` and `kind` are empty where no sensor is at fault."""

    seed: int
    onset: Onset | None = None
    sensor: str = ""
    kind: str = ""

    @property
    def label(self) -> str:
        """What is wrong: nothing, a sensor with its kind, or a preset."""
        return self.onset.preset if self.onset is not None else "sound"

    @property
    def course(self) -> Course:
        """Its way: with the rain or the night in which the fault shows."""
        rain = True if self.label == "wipers_broken" else None
        return draw_course(self.seed, rain=rain, night=True if self.label == "headlamps_out" else None)


def cases(seeds: Seeds) -> tuple[Case, ...]:
    """The 500."""
    wanted: list[tuple[str, str, str]] = [("", "", "")] * SOUND
    wanted += [(f"{sensor}_{kind}", sensor, kind) for sensor, kind in SENSOR_FAULTS] * PER_SENSOR_FAULT
    wanted += [(preset, "", "") for preset in VEHICLE_FAULTS] * PER_VEHICLE_FAULT
    return tuple(_case(FIRST_SEED[seeds] + number, *each) for number, each in enumerate(wanted))


def _case(seed: int, preset: str, sensor: str, kind: str) -> Case:
    if not preset:
        return Case(seed)
    chance, seconds = random.Random(f"onset {seed}"), draw_course(seed).seconds
    onset = Onset(preset, chance.uniform(LEAST_SEVERITY, 1.0), chance.uniform(0.25, 0.5) * seconds)
    return Case(seed, onset, sensor, kind)
