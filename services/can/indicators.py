"""The table of health indicators psi_k: what each reads, how it grows, what it weighs, and what braking it costs.

Weights and losses are ours (the paper names indicators but gives no numbers). A weight of 0.5 alone makes h = 0.39, one
of 1.0 h = 0.63.
Losses are shares of the braking deceleration of a sound car:

* anti-lock: 0.25. A locked wheel slides; sliding friction is 70 to 80 % of the peak on wet asphalt (Wong, Theory of
  Ground Vehicles, 4th ed., ch. 1).
* hot discs: up to 0.4. Linings fade above about 350 degC; UN R13-H (annex 3, type I) lets a hot brake keep as little
  as 60 % of its cold effect.
* booster: 0.6. UN R13-H asks for 2.44 m/s2 of 6.43 m/s2 with a failed booster.
* fluid low, one circuit at risk: 0.6, the same regulation's residual braking with one circuit lost.
* soft tyre: up to 0.15, longer stopping and uneven contact.
* worn lining: 0.1.
"""

from collections.abc import Callable, Mapping
from typing import Literal, NamedTuple

Values = Mapping[str, float | None]
Gravity = Literal["with_care", "stop_soon", "stop_now"]


def ramp(value: float, none: float, full: float) -> float:
    """0 up to `none`, 1 from `full`, straight between; `full` may lie below `none`."""
    return min(1.0, max(0.0, (value - none) / (full - none)))


class Seen(NamedTuple):
    """What a set of fields shows of an indicator: at least `value`, and all of it where `complete`."""

    value: float
    complete: bool


class Psi(NamedTuple):
    """One indicator. `reads` gives what the values of its fields show; it may ignore fields that the car does not
    have.
    """

    name: str
    fields: tuple[str, ...]
    reads: Callable[[Values], Seen]
    weight: float
    loss: float = 0.0
    loss_unknown: float = 0.0
    """Braking counted as lost while an indicator of this car cannot be read."""
    gravity: Gravity = "with_care"
    """What psi = 1 means for the drive."""
    step: str = "careful"


def worst(fields: tuple[str, ...], none: float, full: float) -> Callable[[Values], Seen]:
    """The worst of those fields that the car has, on one ramp."""

    def read(values: Values) -> Seen:
        present = [values[name] for name in fields if name in values]
        known = [ramp(value, none, full) for value in present if value is not None]
        return Seen(max(known, default=0.0), 0 < len(known) == len(present))

    return read


def flag(*fields: str) -> Callable[[Values], Seen]:
    """1 where any of these flags is set."""
    return worst(fields, 0.0, 1.0)


BRAKES = tuple(f"brake_temperature_{wheel}_c" for wheel in ("fl", "fr", "rl", "rr"))
TYRES = tuple(f"tyre_pressure_{wheel}_bar" for wheel in ("fl", "fr", "rl", "rr"))


def _tyre_low(nominal_bar: tuple[float, ...]) -> Callable[[Values], Seen]:
    """0 to 10 % under the nominal pressure, 1 from 50 %; UN R141 warns at 20 %."""
    read_shares = worst(TYRES, 0.9, 0.5)

    def read(values: Values) -> Seen:
        rows = [
            (name, values[name], nominal) for name, nominal in zip(TYRES, nominal_bar, strict=True) if name in values
        ]
        return read_shares({name: None if value is None else value / nominal for name, value, nominal in rows})

    return read


def _oil_low(values: Values) -> Seen:
    """Pressure counts only while the engine runs; whether it runs unknown, it counts too."""
    running, pressure = values.get("engine_running"), values.get("oil_pressure_bar")
    if running is not None and running < 0.5:
        return Seen(0.0, True)
    return Seen(0.0 if pressure is None else ramp(pressure, 0.8, 0.3), pressure is not None)


def table(tyre_nominal_bar: tuple[float, ...]) -> tuple[Psi, ...]:
    """The indicators of a car with these nominal tyre pressures (bar; FL, FR, RL, RR)."""
    return (
        Psi("abs_fault", ("abs_fault", "lamp_abs"), flag("abs_fault", "lamp_abs"), 0.8, 0.25, 0.1, step="no_abs"),
        Psi("stability_fault", ("esc_fault",), flag("esc_fault"), 0.5, step="no_stability"),
        Psi("stability_off", ("esc_off",), flag("esc_off"), 0.2, step="no_stability"),
        Psi("brake_fluid_low", ("brake_fluid_low",), flag("brake_fluid_low"), 1.2, 0.6, 0.05, "stop_soon", "stop_soon"),
        Psi(
            "brake_booster_fault",
            ("brake_booster_fault",),
            flag("brake_booster_fault"),
            1.2,
            0.6,
            0.05,
            "stop_soon",
            "stop_soon",
        ),
        Psi("brake_lining_worn", ("brake_lining_worn",), flag("brake_lining_worn"), 0.3, 0.1, 0.02),
        Psi("brakes_hot", BRAKES, worst(BRAKES, 350.0, 650.0), 0.8, 0.4, 0.05),
        Psi("tyre_pressure_low", TYRES, _tyre_low(tyre_nominal_bar), 0.6, 0.15, 0.05, step="tyre"),
        Psi(
            "steering_assist_fault",
            ("steering_assist_fault",),
            flag("steering_assist_fault"),
            0.8,
            gravity="stop_soon",
            step="steering",
        ),
        Psi(
            "coolant_hot",
            ("coolant_temperature_c",),
            worst(("coolant_temperature_c",), 110.0, 125.0),
            0.7,
            gravity="stop_now",
            step="cool_down",
        ),
        Psi("oil_pressure_low", ("oil_pressure_bar",), _oil_low, 0.8, gravity="stop_now", step="check_oil"),
        Psi(
            "battery_low",
            ("battery_voltage_v",),
            worst(("battery_voltage_v",), 12.0, 10.5),
            0.3,
            gravity="stop_soon",
            step="stop_soon",
        ),
        Psi("fuel_low", ("fuel_share",), worst(("fuel_share",), 0.12, 0.03), 0.1, step="refuel"),
        Psi("engine_lamp", ("lamp_engine",), flag("lamp_engine"), 0.15, step="service"),
        Psi("engine_lamp_flashing", ("lamp_engine_flashing",), flag("lamp_engine_flashing"), 0.4, step="misfire"),
        Psi("brake_lamp", ("lamp_brake",), flag("lamp_brake"), 0.6, 0.2, 0.02, "stop_soon", "stop_soon"),
    )


# psi of the trouble codes: independent shares of the severity of each, combined so that one more never lowers it.
CODE_PSI: Mapping[str, float] = {"note": 0.02, "service": 0.08, "careful": 0.3, "stop_soon": 0.7, "stop_now": 1.0}
CODES_WEIGHT = 0.5
BUS_SILENT_WEIGHT = 0.4
LAMPS: Mapping[str, str] = {
    "lamp_engine": "engine",
    "lamp_engine_flashing": "engine_flashing",
    "lamp_abs": "abs",
    "lamp_stability": "stability",
    "lamp_brake": "brake",
    "lamp_tyre": "tyre",
    "lamp_coolant": "coolant",
    "lamp_oil": "oil",
    "lamp_battery": "battery",
    "lamp_fuel": "fuel",
    "lamp_steering": "steering",
}
