"""What a weather service on the internet is: where to ask, and how its answer becomes an observation. Pure."""

import contextlib
import json
import logging
import math
from codecs import BOM_UTF8
from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

import msgspec

from drivemcp.errors import MALFORMED
from services.weather.observations.observation import SURE, Interval, Observation

logger = logging.getLogger(__name__)
NS = 1_000_000_000
HOUR_S = 3600.0
CONFIDENCE = SURE
"""A forecast speaks for some square kilometres: it may warn, and never reassure."""
AIR_K = 2.0
"""How far the air at the road may be from a forecast's: valleys and cold pools reach this often."""
LOCAL_RAIN = 3.0
"""A shower rains so many times as hard as its grid cell does on average (ours)."""
SIGHT_SHARE = 0.5
"""Sight at the road against a cell's or an airfield's: half of it in a fog bank (ours)."""


class Place(NamedTuple):
    """Where weather is asked for, degrees. Rounded before it leaves, see `rounded`."""

    latitude_deg: float
    longitude_deg: float


class Provider(NamedTuple):
    """One service: its name, the address that answers for a place, and what an answer's bytes say at a time.

    `read(body, now_ns)` raises UnusableAnswer, with what is wrong.
    """

    name: str
    address: Callable[[Place], str]
    read: Callable[[bytes, int], Observation]


class UnusableAnswer(ValueError):
    """An answer that cannot be read, or that says nothing of the present."""


def rounded(place: Place) -> Place:
    """To a hundredth of a degree, about a kilometre: no more is needed, and no more is told of where the car is."""
    return Place(round(place.latitude_deg, 2), round(place.longitude_deg, 2))


AIR_C = (-90.0, 60.0)
"""Below and above every temperature of air measured at the ground."""


def around(value: float | None, margin: float) -> Interval | None:
    """A temperature in °C give or take `margin`; None where no weather has it, as what programs write for a missing one."""
    low, high = AIR_C
    return None if value is None or not low <= value <= high else Interval(value - margin, value + margin)


def shower(mm_h: float | None) -> Interval | None:
    """What may fall here where a cell's average is `mm_h`."""
    return None if mm_h is None or mm_h < 0.0 else Interval(0.0, mm_h * LOCAL_RAIN)


def sight(visibility_m: float | None) -> Interval | None:
    """Sight at the road where a service tells `visibility_m`."""
    if visibility_m is None or visibility_m < 0.0:
        return None
    return Interval(max(1.0, visibility_m * SIGHT_SHARE), max(1.0, visibility_m))


def gusts(gust_mps: float | None) -> Interval | None:
    """Gusts at the road: down to what shelter leaves, up to a third more in the open (ours)."""
    return None if gust_mps is None or gust_mps < 0.0 else Interval(0.5 * gust_mps, 1.33 * gust_mps)


def share(percent: float | None) -> Interval | None:
    """A relative humidity in percent, give or take a tenth, in [0, 1]; None outside 0 to 100 %."""
    if percent is None or not 0.0 <= percent <= 100.0:
        return None
    return Interval(max(0.0, percent / 100 - 0.1), min(1.0, percent / 100 + 0.1))


def json_of(body: bytes) -> Any:
    """The JSON value of an answer, also with the bare NaN that some programs write. Raises UnusableAnswer."""
    text = body.removeprefix(BOM_UTF8).strip()
    try:
        return msgspec.json.decode(text)
    except MALFORMED as error:
        with contextlib.suppress(ValueError, RecursionError):
            return json.loads(text)
        kind = (
            "it is empty"
            if not text
            else "it is a page, not JSON"
            if text.startswith(b"<")
            else f"it is no JSON: {error}"
        )
        raise UnusableAnswer(kind) from None


def refused_units(told: Mapping[str, Any], expected: Mapping[str, str]) -> frozenset[str]:
    """The quantities that come in another unit than the one they were asked for: unknown, and the others count.

    Raises UnusableAnswer where no unit is right.
    """
    wrong = [name for name, unit in expected.items() if name in told and told[name] != unit]
    said = ", ".join(f"{name} comes in {told[name]!r}, not in {expected[name]!r}" for name in wrong)
    if wrong and not any(told.get(name) == unit for name, unit in expected.items()):
        raise UnusableAnswer(said)
    if wrong:
        logger.warning("left unknown: %s", said)
    return frozenset(wrong)


def number(value: object) -> float | None:
    """A finite number; anything else is unknown."""
    known = isinstance(value, int | float) and not isinstance(value, bool) and math.isfinite(value)
    return float(value) if known else None  # type: ignore[arg-type]
