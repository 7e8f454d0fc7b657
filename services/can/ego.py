"""Curated fields into the message `Ego`: what can be believed now, and by name what cannot."""

import statistics

from proto.vehicle import Ego
from services.can.health.trusted import Readings

_NUMBERS = (
    "speed_mps", "acceleration_mps2", "yaw_rate_radps", "steering_angle_rad",
    "brake_pressure_bar", "brake_pedal", "accelerator_pedal", "outside_temperature_c",
)  # fmt: skip
_WHEELS = ("wheel_fl_mps", "wheel_fr_mps", "wheel_rl_mps", "wheel_rr_mps")
_INDICATORS = (("hazard_lights", "hazard"), ("indicator_left", "left"), ("indicator_right", "right"))

WHEEL_TOLERANCE_MPS = 3.0
WHEEL_TOLERANCE_SHARE = 0.15
"""Speed and the middle of the wheels may differ by so much (slip in braking and bends) before neither is believed."""


SLIP_FROM_MPS = 3.0
"""Slower than this, the resolution of a wheel sensor is all that a slip would tell."""


class _View:
    """Reads fields at one instant and remembers the ones that were seen and cannot be used."""

    def __init__(self, board: Readings, now_ns: int) -> None:
        self._board, self._now_ns = board, now_ns
        self.invalid: list[str] = []

    def number(self, name: str) -> float | None:
        reading = self._board.read(name, self._now_ns)
        field = self._board.fields.get(name)
        if reading.value is None and field is not None and field.seen:
            self.invalid.append(name)
        return reading.value

    def flag(self, name: str) -> bool | None:
        value = self.number(name)
        return None if value is None else value > 0.5

    def count(self, name: str) -> int | None:
        value = self.number(name)
        return None if value is None else round(value)


def read_ego(board: Readings, now_ns: int) -> Ego:
    """The ego as the bus shows it at `now_ns`."""
    view = _View(board, now_ns)
    numbers = {name: view.number(name) for name in _NUMBERS}
    if _contradicted(numbers["speed_mps"], view, numbers):
        numbers["speed_mps"] = None
        view.invalid.append("speed_mps")
    headlamps = view.count("headlamps")
    return Ego(
        speed_mps=numbers["speed_mps"],
        acceleration_mps2=numbers["acceleration_mps2"],
        yaw_rate_radps=numbers["yaw_rate_radps"],
        steering_angle_rad=numbers["steering_angle_rad"],
        brake_pressure_bar=numbers["brake_pressure_bar"],
        brake_pedal=numbers["brake_pedal"],
        accelerator_pedal=numbers["accelerator_pedal"],
        outside_temperature_c=numbers["outside_temperature_c"],
        abs_active=view.flag("abs_active"),
        esc_active=view.flag("esc_active"),
        fog_lamp_rear=view.flag("fog_lamp_rear"),
        wiper_stage=view.count("wiper_stage"),
        indicator=_indicator(view),
        lamps_on=None if headlamps is None else headlamps >= 2,
        wheel_slip=_slip(view, numbers["speed_mps"]),
        invalid=tuple(sorted(set(view.invalid))),
    )


def _slip(view: _View, speed_mps: float | None) -> float | None:
    """Mean slip of all four wheels; None where one of them, or the speed, cannot be used, or the car hardly moves."""
    wheels = [view.number(name) for name in _WHEELS]
    known = [value for value in wheels if value is not None]
    if speed_mps is None or speed_mps < SLIP_FROM_MPS or len(known) < len(_WHEELS):
        return None
    return 1.0 - statistics.fmean(known) / speed_mps


def _contradicted(speed_mps: float | None, view: _View, numbers: dict[str, float | None]) -> bool:
    """Whether most wheels tell another speed. Locked or spinning wheels (pedals pressed hard) prove nothing."""
    wheels = [value for name in _WHEELS if (value := view.number(name)) is not None]
    if speed_mps is None or len(wheels) < 3:
        return False
    if (numbers["brake_pedal"] or 0.0) > 0.3 or (numbers["accelerator_pedal"] or 0.0) > 0.8:
        return False
    middle = statistics.median(wheels)
    return abs(middle - speed_mps) > max(WHEEL_TOLERANCE_MPS, WHEEL_TOLERANCE_SHARE * speed_mps)


def _indicator(view: _View) -> str | None:
    states = [(view.flag(field), word) for field, word in _INDICATORS]
    for on, word in states:
        if on:
            return word
    return None if any(on is None for on, _ in states) else "off"
