"""What the CAN service publishes: the ego's motion and the vehicle's health. An absent field is unknown, never zero."""

from typing import Literal

import msgspec

SensorFaultKind = Literal["stuck", "noisy", "offset", "missing", "implausible"]


class Ego(msgspec.Struct, frozen=True, kw_only=True):
    """Curated signals of the ego vehicle, SI units."""

    speed_mps: float | None = None
    acceleration_mps2: float | None = None
    yaw_rate_radps: float | None = None
    steering_angle_rad: float | None = None
    """At the road wheels, positive to the left."""
    brake_pressure_bar: float | None = None
    brake_pedal: float | None = None
    accelerator_pedal: float | None = None
    wiper_stage: int | None = None
    outside_temperature_c: float | None = None
    abs_active: bool | None = None
    esc_active: bool | None = None
    indicator: str | None = None
    lamps_on: bool | None = None
    fog_lamp_rear: bool | None = None
    invalid: tuple[str, ...] = ()
    """Names of curated signals that were seen but are implausible, out of range or silent."""
    wheel_slip: float | None = None
    """How much slower the wheels turn than the car moves, as a share of its speed: positive in braking."""


class Indicator(msgspec.Struct, frozen=True, kw_only=True):
    """One health indicator psi_k in [0, 1] with its weight and its source."""

    name: str
    value: float
    weight: float
    source: str
    detail: str = ""


class SensorFault(msgspec.Struct, frozen=True, kw_only=True):
    """A curated field whose sensor is not believed, though the car may be sound."""

    field: str
    kind: SensorFaultKind
    """What the signal does; `implausible`: the others contradict it in no plainer way."""
    detail: str = ""


class Trend(msgspec.Struct, frozen=True, kw_only=True):
    """A quantity on its way to the threshold at which the car itself would warn."""

    name: str
    """What moves: `slow_leak_fl`, `brakes_heating_rl`, `battery_sinking`, `coolant_rising`."""
    value: float
    threshold: float
    unit: str
    rate_per_min: float
    minutes_left: float
    """Until the threshold, at the middle of the slope's interval."""
    minutes_low: float
    minutes_high: float | None = None
    """None: at the flat end of the interval the threshold is not reached."""


class Degradation(msgspec.Struct, frozen=True, kw_only=True):
    """h in [0, 1] (0 healthy, 1 worst) and what the brakes can still do."""

    h: float | None = None
    indicators: tuple[Indicator, ...] = ()
    brake_envelope: float | None = None
    """Share of normal braking deceleration still to be had, in [0, 1]; None: unknown."""
    dtcs: tuple[str, ...] = ()
    warning_lamps: tuple[str, ...] = ()
    unknown: tuple[str, ...] = ()
    sensor_faults: tuple[SensorFault, ...] = ()
    trends: tuple[Trend, ...] = ()


class DtcText(msgspec.Struct, frozen=True, kw_only=True):
    """A trouble code in words."""

    code: str
    system: str
    severity: str
    summary: str
    next_step: str
    language: str = "en"
    generic: bool = True


class VehicleHealth(msgspec.Struct, frozen=True, kw_only=True):
    """The answer of the tool `vehicle_health`."""

    h: float | None
    brake_envelope: float | None
    indicators: tuple[Indicator, ...]
    dtcs: tuple[DtcText, ...]
    warning_lamps: tuple[str, ...]
    safe_to_drive: str
    """`yes`, `with_care`, `stop_soon`, `stop_now` or `unknown`."""
    advice: str
    speed_factor: float
    headway_factor: float
    confidence: float
    sensor_faults: tuple[SensorFault, ...] = ()
    trends: tuple[Trend, ...] = ()
