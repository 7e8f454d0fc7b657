"""Which faults the car names, and whether what the tool said of it is about them."""

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
"""Indicators that codes and sensors, named themselves, stand behind."""
GRAVE = frozenset({"stop_now", "stop_soon"})


def named(car: Degradation | VehicleHealth) -> tuple[str, ...]:
    """Codes, lamps, trends and doubted sensors."""
    codes = {code if isinstance(code, str) else code.code for code in car.dtcs}
    sensors = sorted({f"sensor:{each.field}" for each in car.sensor_faults})
    return (*sorted({*codes, *car.warning_lamps, *(each.name for each in car.trends)}), *sensors)


def shown(car: Degradation | VehicleHealth) -> tuple[str, ...]:
    """Raised indicators, but for those that are named otherwise."""
    return tuple(sorted({each.name for each in car.indicators if each.value > 0.0 and each.name not in TOLD_OTHERWISE}))


def covered(held: Held) -> bool:
    """Whether the tool's answer knows of every fault that the car names now; no answer knows of none."""
    if held.health is None:
        return False
    return held.degradation is None or _faults(held.degradation) <= _faults(held.health)


def said_of(held: Held) -> VehicleHealth | None:
    """The tool's answer where it is about the faults of now: it knows them all, or is grave and one of its faults stands."""
    health, car = held.health, held.degradation
    if health is None or covered(held):
        return health
    stands = car is not None and bool(_faults(car) & _faults(health))
    return health if stands and health.safe_to_drive in GRAVE else None


def worse(car: Degradation | None, health: VehicleHealth) -> Degradation | None:
    """The degradation with every part that the tool's answer makes worse, and none that it makes better.

    Of a car never heard of less than `UNKNOWN_H` tells nothing: such a car counts as no sounder.
    """
    h = health.h or 0.0
    if car is None and h <= UNKNOWN_H and not _faults(health):
        return None
    before = car if car is not None else Degradation(h=UNKNOWN_H)
    codes = {code.code for code in health.dtcs}
    return msgspec.structs.replace(
        before,
        h=max(before.h or 0.0, h),
        brake_envelope=_weaker(before.brake_envelope, health.brake_envelope),
        dtcs=tuple(sorted({*before.dtcs, *codes})),
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


def _faults(car: Degradation | VehicleHealth) -> frozenset[str]:
    return frozenset((*named(car), *shown(car)))
