"""Faults of the car, as numbers that its physics reads. Tuples are FL, FR, RL, RR."""

from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import Literal

WHEELS = ("fl", "fr", "rl", "rr")
Four = tuple[float, float, float, float]
NONE: Four = (0.0, 0.0, 0.0, 0.0)
SensorKind = Literal["stuck", "noisy", "offset", "missing"]
UNASSISTED = 0.3
"""What the foot alone gives of the brake pressure; ours, so that UN R13-H's 2.44 m/s2 are met (see braking.py)."""
SENSOR_KINDS: tuple[SensorKind, ...] = ("stuck", "noisy", "offset", "missing")


def four(values: Iterable[float]) -> Four:
    """One value for each wheel."""
    front_left, front_right, rear_left, rear_right = values
    return (front_left, front_right, rear_left, rear_right)


@dataclass(frozen=True, slots=True)
class SensorFault:
    """One sensor that tells something else than what is."""

    sensor: str
    kind: SensorKind
    severity: float = 1.0


@dataclass(frozen=True, slots=True)
class Condition:
    """The mechanical and electrical state of the car; as it stands here, everything works."""

    booster: float = 1.0
    """Share of the brake booster's assistance."""
    circuits: float = 1.0
    """Share of the wheels whose brakes still get pressure; 0.5: one diagonal circuit is empty."""
    lining: float = 1.0
    """Friction of the linings relative to sound ones."""
    discs_at_least_c: float = -273.0
    """Brakes that drag keep their discs at this."""
    anti_lock: bool = True
    leak_bar_per_min: Four = NONE
    leak_to_bar: float = 0.8
    headlamps: bool = True
    wipers: bool = True
    charging: bool = True
    sensors: tuple[SensorFault, ...] = ()
    silent: frozenset[str] = frozenset()
    """Messages that are no longer sent."""

    @property
    def assisted(self) -> float:
        """Brake pressure for a foot's force, relative to that with the whole booster."""
        return UNASSISTED + (1.0 - UNASSISTED) * self.booster

    def leaking(self, wheel: int, bar_per_min: float, to_bar: float) -> "Condition":
        """This, and that tyre loses air down to `to_bar`."""
        leaks = four(bar_per_min if each == wheel else now for each, now in enumerate(self.leak_bar_per_min))
        return replace(self, leak_bar_per_min=leaks, leak_to_bar=to_bar)


SOUND = Condition()
