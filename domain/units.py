"""Speeds as posted, in SI, and as the driver wants them told."""

import re

from proto.rules import LegalLimit
from proto.scene import Unit

MPS_PER: dict[str, float] = {"km/h": 1.0 / 3.6, "mph": 0.44704}
MPS_PER_KNOT = 0.514444
M_PER_FOOT, KM_PER_MILE, MM_PER_INCH = 0.3048, 1.609344, 25.4


def to_mps(value: float, unit: Unit) -> float:
    """A posted number in m/s."""
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
    """`50 km/h`: whole numbers without decimals."""
    return f"{value:g} {unit}"


def spoken_converted(value: float, unit: Unit, target: Unit) -> str:
    """In the driver's unit, rounded down: the number is never more than what is allowed."""
    return f"{int(convert(value, unit, target) + 1e-9)} {target}"


def shown(mps: float, unit: Unit) -> int:
    """A speed as told to the driver; rounded down: what is told is never more than what is meant."""
    return int(min(1e4, max(-1e4, from_mps(mps, unit))) + 1e-6)


def told_target(mps: float, unit: Unit) -> int:
    """A target in steps that can be driven: multiples of 5, rounded down; below 20 as it is."""
    value = shown(mps, unit)
    return value - value % 5 if value >= 20 else value


def told_distance(metres: float, unit: Unit) -> str:
    """A distance for a driver of that unit: metres, or feet beside miles an hour."""
    return f"{metres:.0f} m" if unit == "km/h" else f"{metres / M_PER_FOOT:.0f} ft"


def limit_text(limit: LegalLimit, unit: Unit) -> str:
    """The limit as posted, and in the driver's unit where that is another: `30 mph (48 km/h)`, `50 (31 mph)`."""
    posted = posted_text(limit.value, limit.unit, unit)
    return posted if limit.unit == unit else f"{posted} ({shown(limit.mps, unit)} {unit})"


def posted_text(value: float, posted: Unit, unit: Unit) -> str:
    """The number on a sign with its unit; without it for a driver with miles where the sign counts in km/h."""
    return f"{value:g}" if (posted, unit) == ("km/h", "mph") else f"{value:g} {posted}"


_METRIC = re.compile(r"(?<![\w.,])(\d+(?:[.,]\d+)?)[ \u00a0]?(km/h|km|m|met(?:re|er)s?|Metern?)(?![\w/])")


def in_unit(text: str, unit: Unit) -> str:
    """The text for a driver with that unit: in words from elsewhere km/h, kilometres and metres become miles and feet.

    Rounded down, so that no speed is told that is more than what is meant.
    """
    if unit == "km/h":
        return text
    return _METRIC.sub(_imperial, text)


def _imperial(found: re.Match[str]) -> str:
    value, kind = float(found[1].replace(",", ".")), found[2]
    if kind == "km/h":
        return f"{shown(to_mps(value, 'km/h'), 'mph')} mph"
    return f"{value / KM_PER_MILE:.1f} mi" if kind == "km" else told_distance(value, "mph")
