"""Fault scenarios as a table: each breaks something in the car, sets its trouble codes and lights its lamps, so that
frames, diagnostics and driving agree. Sensor faults stand in the same table: they break what is told, not the car.

Some set no code, as in real cars: hot discs are not measured by usual units, worn linings have a flag of their own
(UN R13-H, 5.2.11.2), stability control that the driver switched off is no fault, and for lamps and wipers the standard
has no code, makers have their own.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from typing import Any

from services.simulator.car.condition import SENSOR_KINDS, SOUND, WHEELS, Condition, SensorFault
from services.simulator.car.sensors import SENSORS
from services.simulator.car.state import CarState

OVERHEAT_GOAL_C, OVERHEAT_C_PER_S = 132.0, 4.0
HOT_DISC_C, HOT_DISC_MORE_C, HOT_DISC_C_PER_S = 350.0, 300.0, 40.0
FAST_LEAK_BAR_PER_MIN, SLOW_LEAK_BAR_PER_MIN = 6.0, 0.3
SOFT_BAR, FLAT_BAR = 1.3, 0.8
LEAK_TEST_S = 20.0
"""Ours: a real car's second leak test comes with the next drive (two-trip logic of OBD-II)."""


@dataclass(frozen=True, slots=True)
class Active:
    """A fault at work: how grave (0 to 1] and for how many seconds."""

    severity: float
    for_s: float


@dataclass(frozen=True, slots=True)
class Fault:
    """One scenario. `breaks` changes the car; `shows` what its units say beside what follows from that."""

    preset: str
    routine: int
    """Identifier by which the test unit is asked for it (ISO 14229 RoutineControl)."""
    description: str
    codes: tuple[str, ...] = ()
    lamps: frozenset[str] = frozenset()
    breaks: Callable[[Condition, Active], Condition] = lambda condition, active: condition
    shows: Callable[[CarState, Active], CarState] = lambda state, active: state
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


def _leak(wheel: int, bar_per_min: float, to_bar: float) -> Callable[[Condition, Active], Condition]:
    def breaks(condition: Condition, active: Active) -> Condition:
        return condition.leaking(wheel, bar_per_min * active.severity, to_bar)

    return breaks


def _silence(*messages: str, anti_lock: bool = True) -> Callable[[Condition, Active], Condition]:
    def breaks(condition: Condition, active: Active) -> Condition:
        return replace(condition, silent=condition.silent.union(messages), anti_lock=condition.anti_lock and anti_lock)

    return breaks


def _by_severity(name: str, left: float) -> Callable[[Condition, Active], Condition]:
    """That share of the condition falls to `left` at severity 1."""

    def breaks(condition: Condition, active: Active) -> Condition:
        share: Any = 1.0 - (1.0 - left) * active.severity
        return replace(condition, **{name: share})

    return breaks


def _off(name: str) -> Callable[[Condition, Active], Condition]:
    works: Any = False
    return lambda condition, active: replace(condition, **{name: works})


def _flag(**shown: bool) -> Callable[[CarState, Active], CarState]:
    return lambda state, active: replace(state, **shown)  # type: ignore[arg-type]


def _lamps(*names: str) -> frozenset[str]:
    return frozenset(names)


_VEHICLE = (
    Fault("overheat", 0xF001, "The engine overheats", ("P0217",), _lamps("coolant", "engine"), shows=_hot),
    Fault(
        "abs_fault",
        0xF002,
        "The wheel speed sensor front left fails: no anti-lock, no stability control; locked wheels slide",
        ("C0035",),
        _lamps("abs", "stability"),
        _dead_sensor,
        _no_abs,
    ),
    Fault(
        "low_fuel",
        0xF003,
        "The tank is nearly empty",
        ("P0462",),
        _lamps("fuel"),
        shows=lambda state, active: replace(state, fuel_share=min(state.fuel_share, 0.04)),
    ),
    Fault(
        "low_tyre",
        0xF004,
        "The rear right tyre loses air down to 1.3 bar",
        ("C0765",),
        _lamps("tyre"),
        _leak(3, FAST_LEAK_BAR_PER_MIN, SOFT_BAR),
    ),
    Fault(
        "booster_lost",
        0xF005,
        "The brake booster gives no assistance: the foot alone brakes",
        ("C0021",),
        _lamps("brake"),
        _by_severity("booster", 0.0),
        _flag(brake_booster_fault=True),
    ),
    Fault(
        "circuit_lost",
        0xF006,
        "One of the two brake circuits is empty: half of the wheels brake, the pedal sinks",
        ("C0267",),
        _lamps("brake"),
        _by_severity("circuits", 0.5),
        _flag(brake_fluid_low=True),
    ),
    Fault("brakes_hot", 0xF007, "The brakes drag: discs rise to 650 degC and fade", breaks=_hot_discs),
    Fault(
        "lining_worn",
        0xF008,
        "The brake linings are worn",
        breaks=_by_severity("lining", 0.8),
        shows=_flag(brake_lining_worn=True),
    ),
    Fault(
        "abs_unit",
        0xF009,
        "The brake control unit fails: no anti-lock, no stability control; locked wheels slide",
        ("C0550",),
        _lamps("abs", "stability"),
        _off("anti_lock"),
        _no_abs,
    ),
    Fault(
        "stability_off",
        0xF00A,
        "Stability control is switched off",
        lamps=_lamps("stability"),
        shows=_flag(esc_off=True, esc_active=False),
    ),
    Fault("low_battery", 0xF00B, "The battery is no longer charged", ("P0562",), _lamps("battery"), _off("charging")),
    Fault("headlamps_out", 0xF00C, "The headlamps stay dark", breaks=_off("headlamps")),
    Fault("wipers_broken", 0xF00D, "The wipers stand still", breaks=_off("wipers")),
    Fault(
        "oil_pressure",
        0xF00E,
        "The oil pressure is gone",
        ("P0524",),
        _lamps("oil"),
        shows=lambda state, active: replace(
            state, oil_pressure_bar=state.oil_pressure_bar * 0.25 * (1.0 - active.severity)
        ),
    ),
    Fault(
        "steering_assist",
        0xF00F,
        "The steering assistance fails",
        ("C0545",),
        _lamps("steering"),
        shows=_flag(steering_assist_fault=True),
    ),
    *(
        Fault(
            f"slow_leak_{wheel}",
            0xF010 + number,
            f"The tyre {wheel} loses 0.3 bar a minute; severity 0.17 is 0.05",
            breaks=_leak(number, SLOW_LEAK_BAR_PER_MIN, FLAT_BAR),
        )
        for number, wheel in enumerate(WHEELS)
    ),
    Fault(
        "brake_unit_silent",
        0xF014,
        "The brake control unit falls silent: no wheel speeds, no motion, no anti-lock",
        ("U0121",),
        _lamps("abs", "stability", "brake"),
        _silence(
            "WheelSpeeds",
            "Motion",
            "StabilityControl",
            "Brakes",
            "BrakePedal",
            "BrakeTemperatures",
            anti_lock=False,
        ),
    ),
    Fault(
        "tyre_unit_silent",
        0xF015,
        "The tyre pressure monitor falls silent",
        ("U0127",),
        _lamps("tyre"),
        _silence("TyrePressures"),
    ),
    Fault(
        "body_unit_silent",
        0xF016,
        "The body control unit falls silent: no lamps, wipers, outside temperature",
        ("U0140",),
        breaks=_silence("Body", "Surroundings", "WarningLamps"),
    ),
    Fault(
        "fuel_cap_loose",
        0xF017,
        "The filler cap is loose: fuel vapour escapes; pending for 20 s, then stored",
        ("P0457",),
        _lamps("engine"),
        pending_s=LEAK_TEST_S,
    ),
)


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
