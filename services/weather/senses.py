"""What is known of the weather at one instant, from weather sensing and from what the car feels; and what was known
before.
"""

import math
from collections.abc import Callable, Mapping

import msgspec

NS = 1_000_000_000


class Senses(msgspec.Struct, frozen=True, kw_only=True):
    """Every field may be unknown."""

    rain_mm_h: float | None = None
    snow_mm_h: float | None = None
    visibility_m: float | None = None
    air_c: float | None = None
    road_c: float | None = None
    film_mm: float | None = None
    wiper_stage: int | None = None
    outside_c: float | None = None
    speed_mps: float | None = None
    fog_lamp_rear: bool | None = None
    tyre_low: float | None = None
    """In [0, 1], the indicator of the car's health."""
    abs_mu: float | None = None
    """Deceleration over g while the anti-lock system was at work: the grip there was."""


# Outside these a sensor is broken, and its value is unknown.
LIMITS: Mapping[str, tuple[float, float]] = {
    "rain_mm_h": (0.0, 400.0),
    "snow_mm_h": (0.0, 100.0),
    "visibility_m": (1.0, 100_000.0),
    "air_c": (-60.0, 60.0),
    "road_c": (-60.0, 80.0),
    "film_mm": (0.0, 50.0),
    "wiper_stage": (0, 3),
    "outside_c": (-60.0, 60.0),
    "speed_mps": (0.0, 120.0),
    "tyre_low": (0.0, 1.0),
    "abs_mu": (0.02, 1.5),
}

# A bad value that falls silent is held this long; a good one is forgotten at once.
HOLD_S: Mapping[str, float] = {
    "rain_mm_h": 900.0,
    "snow_mm_h": 1800.0,
    "visibility_m": 300.0,
    "air_c": 1800.0,
    "road_c": 1800.0,
    "film_mm": 900.0,
    "wiper_stage": 300.0,
    "outside_c": 1800.0,
    "tyre_low": 1e9,
    "fog_lamp_rear": 300.0,
    "abs_mu": 60.0,
    "speed_mps": 10.0,
}
_BAD: Mapping[str, Callable[[float], bool]] = {
    "rain_mm_h": lambda value: value > 0.1,
    "snow_mm_h": lambda value: value > 0.0,
    "visibility_m": lambda value: value < 2000.0,
    "air_c": lambda value: value < 5.0,
    "road_c": lambda value: value < 3.0,
    "film_mm": lambda value: value > 0.0,
    "wiper_stage": lambda value: value >= 1,
    "outside_c": lambda value: value < 5.0,
    "tyre_low": lambda value: value > 0.0,
    "fog_lamp_rear": lambda value: value > 0,
    "abs_mu": lambda value: True,
    "speed_mps": lambda value: value > 30.0,
}


class Memory(msgspec.Struct, frozen=True, kw_only=True):
    """The last bad value of each field, with its stamp; when the road was last wet, and when sources last disagreed."""

    bad: dict[str, tuple[float, int]] = {}
    wet_ns: int | None = None
    contradiction_ns: int | None = None


def clean(senses: Senses) -> Senses:
    """Values that no sensor in order gives become unknown."""
    changes: dict[str, None] = {}
    for name, (low, high) in LIMITS.items():
        value = getattr(senses, name)
        if value is not None and not (math.isfinite(value) and low <= value <= high):
            changes[name] = None
    return msgspec.structs.replace(senses, **changes) if changes else senses


def hold(senses: Senses, memory: Memory, now_ns: int) -> tuple[Senses, Memory, frozenset[str]]:
    """Fill what fell silent with the bad value it last had: (senses, what to remember, names of the fields held)."""
    bad = dict(memory.bad)
    held: dict[str, float] = {}
    for name, is_bad in _BAD.items():
        value = getattr(senses, name)
        if value is None and name in bad:
            before, stamp_ns = bad[name]
            if 0 <= now_ns - stamp_ns <= HOLD_S[name] * NS:
                held[name] = before
        elif value is not None and is_bad(value):
            bad[name] = (value, now_ns)
        elif value is not None:
            bad.pop(name, None)
    filled = msgspec.structs.replace(senses, **held) if held else senses
    wet_ns = now_ns if _wet_now(filled) else memory.wet_ns
    return filled, msgspec.structs.replace(memory, bad=bad, wet_ns=wet_ns), frozenset(held)


def _wet_now(senses: Senses) -> bool:
    return (
        (senses.rain_mm_h or 0.0) > 0.1
        or (senses.snow_mm_h or 0.0) > 0.0
        or (senses.film_mm or 0.0) > 0.02
        or (senses.wiper_stage or 0) >= 2
    )
