"""Which faults the car names, and whether what the tool said of it is about them."""

from proto.vehicle import Degradation, VehicleHealth
from services.orchestrator.state import Held

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


def _faults(car: Degradation | VehicleHealth) -> frozenset[str]:
    return frozenset((*named(car), *shown(car)))
