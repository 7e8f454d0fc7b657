"""Speeds as posted, in SI, and as the driver wants them told."""

from proto.rules import LegalLimit
from proto.scene import Unit

MPS_PER: dict[str, float] = {"km/h": 1.0 / 3.6, "mph": 0.44704}
M_PER_FOOT = 0.3048


def to_mps(value: float, unit: Unit) -> float:
    """A posted number in m/s."""
    return value * MPS_PER[unit]


def shown(mps: float, unit: Unit) -> int:
    """A speed as told to the driver; rounded down: what is told is never more than what is meant."""
    return int(min(1e4, max(-1e4, mps / MPS_PER[unit])) + 1e-6)


def told_target(mps: float, unit: Unit) -> int:
    """A target in steps that can be driven: multiples of 5, rounded down; below 20 as it is."""
    value = shown(mps, unit)
    return value - value % 5 if value >= 20 else value


def told_distance(metres: float, unit: Unit) -> str:
    """A distance for a driver of that unit: metres, or feet beside miles an hour."""
    return f"{metres:.0f} m" if unit == "km/h" else f"{metres / M_PER_FOOT:.0f} ft"


def limit_text(limit: LegalLimit, unit: Unit) -> str:
    """The limit as posted, and in the driver's unit where that is another: `30 mph (48 km/h)`."""
    posted = f"{limit.value:g} {limit.unit}"
    return posted if limit.unit == unit else f"{posted} ({shown(limit.mps, unit)} {unit})"
