"""Whether a condition of the law holds here: yes, no, or it may (a fact is unknown). What may hold is applied."""

import math
from typing import Literal, get_args

from proto.rules import Situation
from services.rules.packs.format import Plate, VehicleClass, When
from services.rules.signs.sign_codes import hours_of, within_hours

Holds = Literal["yes", "maybe", "no"]
VEHICLE_CLASSES: frozenset[str] = frozenset(get_args(VehicleClass))
HOURS_OF_DAY = 24.0


def holds(when: When, situation: Situation) -> Holds:
    """Judge every condition; one that fails decides, one that is unknown leaves `maybe`."""
    found = (
        _road(when, situation),
        _member(when.vehicle_classes, known_class(situation)),
        _flag(when.wet, situation.wet),
        _flag(when.snow, situation.snow),
        _visibility(when.visibility_below_m, situation.visibility_m),
        _within(when.hours, situation.time_of_day_h),
        "maybe" if when.lanes else "yes",
        _zone(when.zone, situation.zone),
        _part(when.subdivision, situation.jurisdiction),
    )
    return "no" if "no" in found else "maybe" if "maybe" in found else "yes"


def unknown_facts(when: When, situation: Situation) -> tuple[str, ...]:
    """Names (of `words`) of the facts that are unknown and on which the condition depends."""
    asked = (
        ("road", when.road_types and situation.road_type is None),
        ("vehicle", when.vehicle_classes and known_class(situation) is None),
        ("wetness", when.wet is not None and situation.wet is None),
        ("snow", when.snow is not None and situation.snow is None),
        ("time", when.hours is not None and known_hour(situation.time_of_day_h) is None),
        ("lane", when.lanes),
        ("zone_here", when.zone is not None and situation.zone is None),
        ("visibility", when.visibility_below_m is not None and usable(situation.visibility_m) is None),
    )
    return tuple(name for name, missing in asked if missing)


def known_class(situation: Situation) -> str | None:
    """The vehicle's class where it is one of ours."""
    return situation.vehicle_class if situation.vehicle_class in VEHICLE_CLASSES else None


def usable(number: float | None) -> float | None:
    """A finite number that is not negative; anything else is unknown."""
    return number if number is not None and math.isfinite(number) and number >= 0 else None


def known_hour(time_of_day_h: float | None) -> float | None:
    """Hours since midnight, below 24; no clock shows anything else, so that it is unknown."""
    hour = usable(time_of_day_h)
    return hour if hour is not None and hour < HOURS_OF_DAY else None


def plate_holds(plate: Plate | None, text: str, situation: Situation) -> Holds:
    """Whether the sign above a plate is in force; a plate of which nobody knows what it says may hold."""
    if plate is None:
        return "maybe"
    if plate.type == "wet":
        return _flag(True, situation.wet)
    if plate.type == "vehicle" and plate.classes:
        return _member(plate.classes, known_class(situation))
    if plate.type == "hours":
        return _time(text, situation.time_of_day_h)
    return "maybe" if plate.type in ("ahead", "vehicle") else "yes"


def _road(when: When, situation: Situation) -> Holds:
    if when.announced and situation.road_type is None:
        return "no"
    return _member(when.road_types, situation.road_type)


def _member(allowed: tuple[str, ...], value: str | None) -> Holds:
    if not allowed:
        return "yes"
    if value is None:
        return "maybe"
    return "yes" if value in allowed else "no"


def _flag(needed: bool | None, value: bool | None) -> Holds:
    if needed is None:
        return "yes"
    if value is None:
        return "maybe"
    return "yes" if value == needed else "no"


def _visibility(below_m: float | None, visibility_m: float | None) -> Holds:
    if below_m is None:
        return "yes"
    known_m = usable(visibility_m)
    if known_m is None:
        return "maybe"
    return "yes" if known_m < below_m else "no"


def _zone(needed: bool | None, zone: float | None) -> Holds:
    """A zone that was read is one; that none was read proves nothing."""
    return _flag(needed, True if zone is not None else None)


def _part(subdivision: str | None, jurisdiction: str | None) -> Holds:
    if subdivision is None:
        return "yes"
    return "yes" if jurisdiction == subdivision else "no"


def _time(text: str, time_of_day_h: float | None) -> Holds:
    found = {_within(hours, time_of_day_h) for hours in hours_of(text)} or {"maybe"}
    return "yes" if "yes" in found else "maybe" if "maybe" in found else "no"


def _within(hours: tuple[float, float] | None, time_of_day_h: float | None) -> Holds:
    if hours is None:
        return "yes"
    known_h = known_hour(time_of_day_h)
    if known_h is None:
        return "maybe"
    return "yes" if within_hours(hours, known_h) else "no"
