"""Which faults the car names, and whether the tool's answer is about them."""

from collections.abc import Callable
from typing import TypeVar

import msgspec

from proto.vehicle import Degradation, VehicleHealth
from services.orchestrator.state import Held

T = TypeVar("T")
UNKNOWN_BRAKES = 0.8
"""As the arbiter's profile reckons with an envelope that was never observed."""
UNKNOWN_H = 0.125
"""The h at which a car takes as much off the target as one that was never heard of."""
TOLD_OTHERWISE = frozenset({"trouble_codes", "sensors_faulty"})
"""Indicators that stand for codes and sensors, which are named themselves."""
GRAVE = frozenset({"stop_now", "stop_soon"})


def named(car: Degradation | VehicleHealth) -> tuple[str, ...]:
    """Codes, lamps, trends and doubted sensors."""
    codes = {code if isinstance(code, str) else code.code for code in car.dtcs}
    sensors = sorted({f"sensor:{each.field}" for each in car.sensor_faults})
    return (*sorted({*codes, *car.warning_lamps, *(each.name for each in car.trends)}), *sensors)


def shown(car: Degradation | VehicleHealth) -> tuple[str, ...]:
    """Raised indicators, but for those that are named otherwise."""
    return tuple(sorted({each.name for each in car.indicators if each.value > 0.0} - TOLD_OTHERWISE))


def covered(held: Held) -> bool:
    """Whether the tool's answer knows of every fault that the car names now."""
    return held.health is not None and _faults(held.degradation) <= _faults(held.health)


def said_of(held: Held) -> VehicleHealth | None:
    """The tool's answer where it is about the faults of now: it covers them, or is grave and one of its faults stands."""
    health = held.health
    if health is None or covered(held):
        return health
    return health if health.safe_to_drive in GRAVE and _faults(held.degradation) & _faults(health) else None


def worse(car: Degradation | None, health: VehicleHealth) -> Degradation | None:
    """The degradation with every part that the tool's answer makes worse, and none that it makes better.

    A car never heard of counts as no sounder than `UNKNOWN_H`.
    """
    h = health.h or 0.0
    if car is None and h <= UNKNOWN_H and not _faults(health):
        return None
    before = car or Degradation(h=UNKNOWN_H)
    return msgspec.structs.replace(
        before,
        h=max(before.h or 0.0, h),
        brake_envelope=_weaker(before.brake_envelope, health.brake_envelope),
        dtcs=tuple(sorted({*before.dtcs, *(code.code for code in health.dtcs)})),
        warning_lamps=tuple(sorted({*before.warning_lamps, *health.warning_lamps})),
        indicators=_with(before.indicators, health.indicators, lambda each: each.name),
        trends=_with(before.trends, health.trends, lambda each: each.name),
        sensor_faults=_with(before.sensor_faults, health.sensor_faults, lambda each: each.field),
    )


def _weaker(before: float | None, told: float | None) -> float | None:
    """Of two shares of braking the lesser; one that is unknown counts as `UNKNOWN_BRAKES` and stays unknown."""
    if told is None or (before is None and told >= UNKNOWN_BRAKES):
        return before
    return told if before is None else min(before, told)


def _with(before: tuple[T, ...], told: tuple[T, ...], name: Callable[[T], str]) -> tuple[T, ...]:
    known = {name(each) for each in before}
    return (*before, *(each for each in told if name(each) not in known))


def _faults(car: Degradation | VehicleHealth | None) -> frozenset[str]:
    return frozenset() if car is None else frozenset((*named(car), *shown(car)))
