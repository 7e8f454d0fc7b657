"""Speeds as posted and in SI, exactly."""

from proto.rules import LegalLimit
from proto.scene import Unit

METRES_PER_MILE = 1609.344
MPS_PER: dict[str, float] = {"km/h": 1000 / 3600, "mph": METRES_PER_MILE / 3600}


def to_mps(value: float, unit: Unit) -> float:
    """A posted speed in m/s."""
    return value * MPS_PER[unit]


def from_mps(speed_mps: float, unit: Unit) -> float:
    """A speed in m/s as it would be posted, unrounded."""
    return speed_mps / MPS_PER[unit]


def convert(value: float, unit: Unit, target: Unit) -> float:
    """From one posted unit into the other, unrounded."""
    return value if unit == target else from_mps(to_mps(value, unit), target)


def legal_limit(value: float, unit: Unit, *, advisory: bool = False) -> LegalLimit:
    """A limit as posted beside SI."""
    return LegalLimit(value=value, unit=unit, mps=to_mps(value, unit), advisory=advisory)


def spoken(value: float, unit: Unit) -> str:
    """`50 km/h`: no decimals where there are none."""
    return f"{value:g} {unit}"


def spoken_converted(value: float, unit: Unit, target: Unit) -> str:
    """In the driver's unit, rounded down so that nobody is told more than is allowed."""
    return f"{int(convert(value, unit, target) + 1e-9)} {target}"
