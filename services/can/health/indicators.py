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
* soft tyre: up to 0.1 for each wheel, longer stopping and uneven contact. psi by pressure (UN R141 warns at 20 % lost)
  or, faster or where the sensor fails, by how much faster the wheel turns (ratios.py).
* worn lining: 0.1.
* weak brakes: just what is missing, measured: deceleration per brake pressure against the profile's.
* spongy pedal: 0.5. Travel without pressure is air or a lost circuit, which UN R13-H lets keep 2.44 of 6.43 m/s2.

Lamps: UN R48 (6.2.7) lights the dipped beam below 1000 lx. Wipers: ours, a rain sensor at 0.1 asks for the first stage.
Battery: below 12.0 V a 12 V lead battery is half empty (SAE J537 rests at 12.6 V) and the generator does not charge.
"""

from collections.abc import Callable, Mapping
from typing import Literal, NamedTuple

from services.can.health.ratios import SOFT_FROM, SOFT_TO

Values = Mapping[str, float | None]
Gravity = Literal["with_care", "stop_soon", "stop_now"]


def ramp(value: float, none: float, full: float) -> float:
    """0 up to `none`, 1 from `full`, straight between; `full` may lie below `none`."""
    return min(1.0, max(0.0, (value - none) / (full - none)))


class Seen(NamedTuple):
    """What a set of fields shows of an indicator: at least `value`, and all of it where `complete`."""

    value: float
    complete: bool
    detail: str = ""
    """Which of several parts it is."""


class Psi(NamedTuple):
    """One indicator. `reads`: what its fields show; it may ignore fields that the car does not have."""

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
    paired: bool = False
    """Whether its fields tell something only together: a car that lacks one has no such indicator."""

    def on(self, values: Values) -> bool:
        """Whether this car has the fields for it."""
        return (all if self.paired else any)(name in values for name in self.fields)

    def from_bus(self, values: Values) -> bool:
        """Whether the bus tells of it, and not only what driving has shown."""
        return any(name in values for name in self.fields if name not in MEASURED)


def worst(fields: tuple[str, ...], none: float, full: float) -> Callable[[Values], Seen]:
    """The worst of those fields that the car has, on one ramp."""

    def read(values: Values) -> Seen:
        present = {name: values[name] for name in fields if name in values}
        known = {name: ramp(value, none, full) for name, value in present.items() if value is not None}
        name = max(known, key=lambda each: known[each], default="")
        detail = name if name and len(fields) > 1 and known[name] > 0.0 else ""
        return Seen(known.get(name, 0.0), 0 < len(known) == len(present), detail)

    return read


Reads = tuple[tuple[str, ...], Callable[[Values], Seen]]
"""The fields of an indicator, and how they are read."""


def on_ramp(field: str, none: float, full: float) -> Reads:
    """One field on one ramp."""
    return (field,), worst((field,), none, full)


def flag(*fields: str) -> Reads:
    """1 where any of these flags is set."""
    return fields, worst(fields, 0.0, 1.0)


WHEELS = ("fl", "fr", "rl", "rr")
BRAKES = tuple(f"brake_temperature_{wheel}_c" for wheel in WHEELS)
TYRES = tuple(f"tyre_pressure_{wheel}_bar" for wheel in WHEELS)
SOFTNESS = tuple(f"softness_{wheel}" for wheel in WHEELS)
MEASURED = frozenset({"brake_effect", "pedal_pressure", *SOFTNESS})
"""What driving has shown (ratios.py): it stays known on a dead bus."""


def _tyre_low(pressure: str, softness: str, nominal_bar: float) -> Callable[[Values], Seen]:
    """0 to 10 % under the nominal pressure, 1 from 50 %; and by the wheel's speed, where that was measured."""

    def read(values: Values) -> Seen:
        bar, ahead = values.get(pressure), values.get(softness)
        by_sensor = 0.0 if bar is None else ramp(bar / nominal_bar, 0.9, 0.5)
        by_wheel = 0.0 if ahead is None else ramp(ahead, SOFT_FROM, SOFT_TO)
        complete = all(values[each] is not None for each in (pressure, softness) if each in values)
        return Seen(max(by_sensor, by_wheel), complete)

    return read


def _brakes_weak(values: Values) -> Seen:
    """What is missing, where more than a quarter is: grade and load explain less."""
    share = values.get("brake_effect")
    missing = 0.0 if share is None else 1.0 - max(0.0, share)
    return Seen(missing if missing > 0.25 else 0.0, share is not None)


def _lamps_off(values: Values) -> Seen:
    """Dark, and no dipped beam."""
    light, lamps = values.get("outside_light_lux"), values.get("headlamps")
    if lamps is not None and lamps >= 2.0:
        return Seen(0.0, True)
    if light is None or lamps is None:
        return Seen(0.0, light is not None and light > 1000.0)
    return Seen(ramp(light, 1000.0, 100.0), True)


def _wipers_off(values: Values) -> Seen:
    """Rain on the sensor, and the wipers stand."""
    rain, stage = values.get("rain_sensor"), values.get("wiper_stage")
    if stage is not None and stage >= 1.0:
        return Seen(0.0, True)
    if rain is None or stage is None:
        return Seen(0.0, rain is not None and rain <= 0.1)
    return Seen(ramp(rain, 0.1, 0.4), True)


def _oil_low(values: Values) -> Seen:
    """Pressure counts only while the engine runs; whether it runs unknown, it counts too."""
    running, pressure = values.get("engine_running"), values.get("oil_pressure_bar")
    if running is not None and running < 0.5:
        return Seen(0.0, True)
    return Seen(0.0 if pressure is None else ramp(pressure, 0.8, 0.3), pressure is not None)


def table(tyre_nominal_bar: tuple[float, ...]) -> tuple[Psi, ...]:
    """The indicators of a car with these nominal tyre pressures (bar; FL, FR, RL, RR)."""
    return (
        Psi("abs_fault", *flag("abs_fault", "lamp_abs"), 0.8, 0.25, 0.1, step="no_abs"),
        Psi("stability_fault", *flag("esc_fault"), 0.5, step="no_stability"),
        Psi("stability_off", *flag("esc_off"), 0.2, step="no_stability"),
        Psi("brake_fluid_low", *flag("brake_fluid_low"), 1.2, 0.6, 0.05, "stop_soon", "stop_soon"),
        Psi("brake_booster_fault", *flag("brake_booster_fault"), 1.2, 0.6, 0.05, "stop_soon", "stop_soon"),
        Psi("brake_lining_worn", *flag("brake_lining_worn"), 0.3, 0.1, 0.02),
        Psi("brakes_hot", BRAKES, worst(BRAKES, 350.0, 650.0), 0.8, 0.4, 0.05),
        Psi("brakes_weak", ("brake_effect",), _brakes_weak, 1.2, 1.0, gravity="stop_soon", step="stop_soon"),
        Psi("pedal_spongy", *on_ramp("pedal_pressure", 0.75, 0.35), 1.0, 0.5, gravity="stop_soon", step="stop_soon"),
        *(
            Psi(f"tyre_pressure_low_{wheel}", (tyre, soft), _tyre_low(tyre, soft, nominal), 0.6, 0.1, 0.02, step="tyre")
            for wheel, tyre, soft, nominal in zip(WHEELS, TYRES, SOFTNESS, tyre_nominal_bar, strict=True)
        ),
        Psi("steering_assist_fault", *flag("steering_assist_fault"), 0.8, gravity="stop_soon", step="steering"),
        Psi("coolant_hot", *on_ramp("coolant_temperature_c", 110.0, 125.0), 0.7, gravity="stop_now", step="cool_down"),
        Psi("oil_pressure_low", ("oil_pressure_bar",), _oil_low, 0.8, gravity="stop_now", step="check_oil"),
        Psi("battery_low", *on_ramp("battery_voltage_v", 12.0, 10.5), 0.3, gravity="stop_soon", step="stop_soon"),
        Psi("fuel_low", *on_ramp("fuel_share", 0.12, 0.03), 0.1, step="refuel"),
        Psi("engine_lamp", *flag("lamp_engine"), 0.15, step="service"),
        Psi("engine_lamp_flashing", *flag("lamp_engine_flashing"), 0.4, step="misfire"),
        Psi("lamps_off_in_the_dark", ("outside_light_lux", "headlamps"), _lamps_off, 0.4, step="lamps_on", paired=True),
        Psi("wipers_off_in_rain", ("rain_sensor", "wiper_stage"), _wipers_off, 0.25, step="wipers", paired=True),
        Psi("brake_lamp", *flag("lamp_brake"), 0.6, 0.2, 0.02, "stop_soon", "stop_soon"),
    )


# psi of the trouble codes: independent shares of the severity of each, combined so that one more never lowers it.
CODE_PSI: Mapping[str, float] = {"note": 0.02, "service": 0.08, "careful": 0.3, "stop_soon": 0.7, "stop_now": 1.0}
CODES_WEIGHT = 0.5
BUS_SILENT_WEIGHT = 0.4
SENSORS_WEIGHT = 0.3
"""Of the sensors that the others contradict: each takes half of the trust that is left."""
LAMPS: Mapping[str, str] = {
    "lamp_engine": "engine", "lamp_engine_flashing": "engine_flashing", "lamp_abs": "abs",
    "lamp_stability": "stability", "lamp_brake": "brake", "lamp_tyre": "tyre", "lamp_coolant": "coolant",
    "lamp_oil": "oil", "lamp_battery": "battery", "lamp_fuel": "fuel", "lamp_steering": "steering",
}  # fmt: skip
