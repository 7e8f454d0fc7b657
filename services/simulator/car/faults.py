"""Fault scenarios as a table: each breaks something in the car, sets its trouble codes and lights its lamps, so that
frames, diagnostics and driving agree. Sensor faults stand in the same table: they break what is told, not the car.

Some set no code, as in real cars: hot discs are not measured by usual units, and worn linings have a flag of their own
(UN R13-H, 5.2.11.2). Stability control that the driver switched off is not a fault. For lamps and wipers the standard
has no code; makers have their own.
"""

import tomllib
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from services.simulator.car.condition import SENSOR_KINDS, SOUND, WHEELS, Condition, SensorFault
from services.simulator.car.sensors import SENSORS
from services.simulator.car.state import CarState

OVERHEAT_GOAL_C, OVERHEAT_C_PER_S = 132.0, 4.0
HOT_DISC_C, HOT_DISC_MORE_C, HOT_DISC_C_PER_S = 350.0, 300.0, 40.0
FAST_LEAK_BAR_PER_MIN, SLOW_LEAK_BAR_PER_MIN = 6.0, 0.3
SOFT_BAR, FLAT_BAR = 1.3, 0.8


@dataclass(frozen=True, slots=True)
class Active:
    """A fault at work: how grave (0 to 1] and for how many seconds."""

    severity: float
    for_s: float


Breaks = Callable[[Condition, Active], Condition]
Shows = Callable[[CarState, Active], CarState]


def _sound(condition: Condition, active: Active) -> Condition:
    return condition


def _as_is(state: CarState, active: Active) -> CarState:
    return state


@dataclass(frozen=True, slots=True)
class Fault:
    """One scenario. `breaks` changes the car; `shows` what its units say beside what follows from that."""

    preset: str
    routine: int
    """Identifier by which the test unit is asked for it (ISO 14229 RoutineControl)."""
    description: str
    codes: tuple[str, ...] = ()
    lamps: frozenset[str] = frozenset()
    breaks: Breaks = _sound
    shows: Shows = _as_is
    pending_s: float = 0.0
    """So long a unit looks before it believes: its codes are pending and no lamp is lit."""


def _hot(state: CarState, active: Active) -> CarState:
    goal = 90.0 + (OVERHEAT_GOAL_C - 90.0) * active.severity
    risen = max(state.coolant_temperature_c, min(goal, state.coolant_temperature_c + OVERHEAT_C_PER_S * active.for_s))
    return replace(state, coolant_temperature_c=risen, oil_temperature_c=state.oil_temperature_c + (risen - 90.0) * 0.5)


def _no_abs(state: CarState, active: Active) -> CarState:
    return replace(state, abs_fault=True, esc_fault=True, abs_active=False, esc_active=False)


def _dead_sensor(condition: Condition, active: Active) -> Condition:
    dead = SensorFault("wheel_fl", "missing", active.severity)
    return replace(condition, anti_lock=False, sensors=(*condition.sensors, dead))


def _hot_discs(condition: Condition, active: Active) -> Condition:
    goal_c = HOT_DISC_C + HOT_DISC_MORE_C * active.severity
    return replace(condition, discs_at_least_c=min(goal_c, 20.0 + HOT_DISC_C_PER_S * active.for_s))


def _leak(wheel: int, bar_per_min: float, to_bar: float) -> Breaks:
    def breaks(condition: Condition, active: Active) -> Condition:
        return condition.leaking(wheel, bar_per_min * active.severity, to_bar)

    return breaks


def _silence(*messages: str, anti_lock: bool = True) -> Breaks:
    def breaks(condition: Condition, active: Active) -> Condition:
        return replace(condition, silent=condition.silent.union(messages), anti_lock=condition.anti_lock and anti_lock)

    return breaks


def _by_severity(name: str, left: float) -> Breaks:
    """That share of the condition falls to `left` at severity 1."""

    def breaks(condition: Condition, active: Active) -> Condition:
        share: Any = 1.0 - (1.0 - left) * active.severity
        return replace(condition, **{name: share})

    return breaks


def _off(name: str) -> Breaks:
    works: Any = False
    return lambda condition, active: replace(condition, **{name: works})


def _flag(**shown: bool) -> Shows:
    return lambda state, active: replace(state, **shown)  # type: ignore[arg-type]


def _low_fuel(state: CarState, active: Active) -> CarState:
    return replace(state, fuel_share=min(state.fuel_share, 0.04))


def _no_oil_pressure(state: CarState, active: Active) -> CarState:
    return replace(state, oil_pressure_bar=state.oil_pressure_bar * 0.25 * (1.0 - active.severity))


_BREAKS: Mapping[str, Breaks] = {
    "abs_fault": _dead_sensor,
    **{f"slow_leak_{wheel}": _leak(n, SLOW_LEAK_BAR_PER_MIN, FLAT_BAR) for n, wheel in enumerate(WHEELS)},
    "low_tyre": _leak(3, FAST_LEAK_BAR_PER_MIN, SOFT_BAR),
    "booster_lost": _by_severity("booster", 0.0),
    "circuit_lost": _by_severity("circuits", 0.5),
    "brakes_hot": _hot_discs,
    "lining_worn": _by_severity("lining", 0.8),
    "abs_unit": _off("anti_lock"),
    "low_battery": _off("charging"),
    "headlamps_out": _off("headlamps"),
    "wipers_broken": _off("wipers"),
    "brake_unit_silent": _silence(
        "WheelSpeeds", "Motion", "StabilityControl", "Brakes", "BrakePedal", "BrakeTemperatures", anti_lock=False
    ),
    "tyre_unit_silent": _silence("TyrePressures"),
    "body_unit_silent": _silence("Body", "Surroundings", "WarningLamps"),
}
_SHOWS: Mapping[str, Shows] = {
    "overheat": _hot,
    "abs_fault": _no_abs,
    "low_fuel": _low_fuel,
    "booster_lost": _flag(brake_booster_fault=True),
    "circuit_lost": _flag(brake_fluid_low=True),
    "lining_worn": _flag(brake_lining_worn=True),
    "abs_unit": _no_abs,
    "stability_off": _flag(esc_off=True, esc_active=False),
    "oil_pressure": _no_oil_pressure,
    "steering_assist": _flag(steering_assist_fault=True),
}


def _table_faults() -> Iterator[Fault]:
    """The faults of the table, each with what it breaks and shows."""
    rows = tomllib.loads(Path(__file__).with_name("faults.toml").read_text(encoding="utf-8"))
    for preset, row in rows.items():
        yield Fault(
            preset,
            row["routine"],
            row["description"],
            tuple(row.get("codes", ())),
            frozenset(row.get("lamps", ())),
            _BREAKS.get(preset, _sound),
            _SHOWS.get(preset, _as_is),
            row.get("pending_s", 0.0),
        )


_VEHICLE = tuple(_table_faults())


def _sensor_fault(number: int, sensor: str, kind_number: int) -> Fault:
    kind = SENSOR_KINDS[kind_number]

    def breaks(condition: Condition, active: Active) -> Condition:
        return replace(condition, sensors=(*condition.sensors, SensorFault(sensor, kind, active.severity)))

    routine = 0xF100 + 16 * number + kind_number
    return Fault(f"{sensor}_{kind}", routine, f"The sensor {sensor} is {kind}", breaks=breaks)


_SENSOR = tuple(
    _sensor_fault(number, sensor, kind) for number, sensor in enumerate(SENSORS) for kind in range(len(SENSOR_KINDS))
)
FAULTS: Mapping[str, Fault] = {fault.preset: fault for fault in (*_VEHICLE, *_SENSOR)}
CLEAR_ROUTINE = 0xF000
BY_ROUTINE: Mapping[int, Fault] = {fault.routine: fault for fault in FAULTS.values()}


def check(preset: str) -> None:
    """Raises ValueError for a preset that there is not."""
    if preset != "none" and preset not in FAULTS:
        vehicle = ", ".join(sorted(fault.preset for fault in _VEHICLE))
        raise ValueError(
            f"no fault scenario {preset!r}; there are {vehicle}, <sensor>_<kind> with the sensors "
            f"{', '.join(SENSORS)} and the kinds {', '.join(SENSOR_KINDS)}, and none"
        )


def _told(state: CarState, fault: Fault, *, pending: bool) -> CarState:
    """With the codes of a fault, once each, and its lamps."""
    if pending:
        return replace(state, pending_codes=tuple(dict.fromkeys(state.pending_codes + fault.codes)))
    codes = tuple(dict.fromkeys(state.stored_codes + fault.codes))
    return replace(state, stored_codes=codes, lamps=state.lamps | fault.lamps)


@dataclass(slots=True)
class Faults:
    """The faults that are active. One begins when it first meets an instant."""

    _wanted: dict[str, tuple[float, int | None]] = field(default_factory=dict)

    @property
    def active(self) -> tuple[str, ...]:
        """Their presets."""
        return tuple(self._wanted)

    def activate(self, preset: str, severity: float = 1.0) -> None:
        """Add one; `none` ends them all. Raises ValueError for an unknown one."""
        check(preset)
        if preset == "none":
            self._wanted = {}
        else:
            self._wanted.setdefault(preset, (severity, None))

    def condition(self, now_ns: int) -> Condition:
        """The car under them."""
        condition = SOUND
        for preset, active in self._at(now_ns):
            condition = FAULTS[preset].breaks(condition, active)
        return condition

    def show(self, state: CarState, now_ns: int) -> CarState:
        """What its units know of them: flags, codes, lamps."""
        for preset, active in self._at(now_ns):
            fault = FAULTS[preset]
            state = _told(fault.shows(state, active), fault, pending=active.for_s < fault.pending_s)
        return state

    def _at(self, now_ns: int) -> list[tuple[str, Active]]:
        found = []
        for preset, (severity, since) in list(self._wanted.items()):
            began = now_ns if since is None else since
            self._wanted[preset] = (severity, began)
            found.append((preset, Active(severity, max(0.0, (now_ns - began) / 1e9))))
        return found
