"""What the car itself brings to grip and stopping."""

import msgspec

UNKNOWN_SPEED_MPS = 30.0


class Car(msgspec.Struct, frozen=True, kw_only=True):
    """Every field may be unknown."""

    speed_mps: float | None = None
    tyre_low: float | None = None
    """In [0, 1], the indicator of the car's health; 1: half the nominal pressure."""
    tread_mm: float | None = None
    brake_envelope: float | None = None
    """Share of ordinary braking deceleration that is still to be had, in (0, 1]."""

    @property
    def speed(self) -> float:
        """m/s; fast where unknown."""
        return UNKNOWN_SPEED_MPS if self.speed_mps is None else self.speed_mps

    @property
    def brakes(self) -> float:
        """The envelope, kept away from zero."""
        return 1.0 if self.brake_envelope is None else min(1.0, max(0.05, self.brake_envelope))


# Outside these a sensor is broken, and its value is unknown.
_LIMITS = {
    "speed_mps": (0.0, 120.0),
    "tyre_low": (0.0, 1.0),
    "tread_mm": (0.0, 20.0),
    "brake_envelope": (0.0, 1.0),
}


def sane(car: Car) -> Car:
    """Values that no sensor in order gives become unknown."""
    broken = {
        name: None
        for name, (low, high) in _LIMITS.items()
        if (value := getattr(car, name)) is not None and not low <= value <= high
    }
    return msgspec.structs.replace(car, **broken) if broken else car
