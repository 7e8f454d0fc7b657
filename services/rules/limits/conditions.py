"""Whether a condition of the law holds here: yes, no, or it may (a fact is unknown). What may hold is applied."""

import math
import re
from collections.abc import Callable, Iterator
from functools import lru_cache, partial
from operator import attrgetter
from typing import Any, Literal

from proto.rules import Situation
from services.rules.packs.format import Plate, When
from services.rules.signs.sign_codes import hours_of, parse_reading, within_hours

Holds = Literal["yes", "maybe", "no"]
HOURS_OF_DAY = 24.0
_NUMBER = re.compile(r"\b([A-Z]{1,3})[ -]?([0-9]{1,4}[A-Z]?)\b")
"""A road's number, as in `US 290`, `I-10`, `SR 99N` and `A 10;E 55`."""


FLAGS = ("wet", "snow", "lit", "divided", "snow_chains", "novice", "electric", "plate_100", "standing")
"""Facts that are so or not, under one name in a condition and in a situation."""
MASSES = ("mass", "trailer", "combination")
LIGHT_T, MEDIUM_T = 3.5, 7.5
"""Up to which permissible mass a vehicle or a trailer is light, and a lorry is one of the lighter class."""


def holds(when: When, situation: Situation) -> Holds:
    """Judge every condition; one that fails decides, one that is unknown leaves `maybe`."""
    sure = True
    for _, held in _judged(when, situation):
        if held == "no":
            return "no"
        sure = sure and held == "yes"
    return "yes" if sure else "maybe"


def unknown_facts(when: When, situation: Situation) -> tuple[str, ...]:
    """Names (of `words`) of the facts that are unknown and on which the condition depends."""
    return tuple(name for name, held in _judged(when, situation) if held == "maybe")


def _judged(when: When, situation: Situation) -> Iterator[tuple[str, Holds]]:
    return ((name, judge(when, situation)) for name, judge in _named(when))


@lru_cache(maxsize=8192)
def _named(when: When) -> tuple[tuple[str, "Judge"], ...]:
    """The conditions that an effect names: most name two or three, and a question of all laws asks thousands of effects."""
    return tuple((name, judge) for name, named, judge in _CONDITIONS if named(when) not in (None, ()))


def _fact(situation: Situation, name: str) -> bool | None:
    if name == "snow_chains" and situation.vehicle_class == "car_snow_chains":
        return True
    if name == "lit" and any(parse_reading(text).code == "national" for text in situation.ended):
        return False  # the sign says that the lamps mean nothing here
    found: bool | None = getattr(situation, name)
    return found


def _class(allowed: tuple[str, ...], situation: Situation) -> Holds:
    """A car on chains is a car. One that is heavier than its class may be may be of the heavier class."""
    known = "car" if situation.vehicle_class == "car_snow_chains" else situation.vehicle_class
    found = {_member(allowed, each) for each in (known, _heavier(known, situation))}
    return found.pop() if len(found) == 1 else "maybe"


def _heavier(known: str | None, situation: Situation) -> str | None:
    """The class by the masses that are told, where the class that is told is a lighter one: a motorhome of 5 t as a car."""
    mass_t, trailer_t = (usable(each) or 0.0 for each in (situation.mass_t, situation.trailer_t))
    if known in ("car", "van", "lorry_light") and mass_t > LIGHT_T:
        return "lorry" if mass_t > MEDIUM_T else "lorry_light"
    if known in ("car_trailer", "van_trailer") and max(mass_t, trailer_t) > LIGHT_T:
        return "lorry_trailer"
    return known


def _numbers(road: str | None) -> set[tuple[str, str]]:
    """The numbers in a road's name, each as the letters before it and the rest."""
    return {(each[1], each[2]) for each in _NUMBER.finditer((road or "").upper())}


def _on_roads(roads: tuple[str, ...], road: str | None) -> Holds:
    """Whether it is one of these roads; a name without a number of their kind may be one of them."""
    if not roads:
        return "yes"
    listed, known = {each for name in roads for each in _numbers(name)}, _numbers(road)
    if listed & known:
        return "yes"
    return "no" if {letters for letters, _ in listed} & {letters for letters, _ in known} else "maybe"


def _off_roads(letters: tuple[str, ...], road: str | None) -> Holds:
    """No road with one of these letters before its number; one without a number may be renamed where it has one."""
    if not letters:
        return "yes"
    known = {each for each, _ in _numbers(road)}
    if not known:
        return "maybe"
    return "no" if known.intersection(letters) else "yes"


def usable(number: float | None) -> float | None:
    """A finite number that is not negative; anything else is unknown."""
    return number if number is not None and math.isfinite(number) and number >= 0 else None


def known_hour(time_of_day_h: float | None) -> float | None:
    """Hours since midnight, below 24; no clock shows anything else, so that it is unknown."""
    hour = usable(time_of_day_h)
    return hour if hour is not None and hour < HOURS_OF_DAY else None


def plate_holds(plate: Plate | None, text: str, situation: Situation) -> Holds:
    """Whether the sign above a plate is in force; a plate may hold where it is not known what it says."""
    if plate is None:
        return "maybe"
    if plate.type == "wet":
        return _flag(True, situation.wet)
    if plate.type == "vehicle" and plate.classes:
        return _class(plate.classes, situation)
    if plate.type == "hours":
        return _time(text, situation.time_of_day_h)
    if plate.electric_exempt and situation.electric:
        return "no"
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


def _flagged(name: str, when: When, situation: Situation) -> Holds:
    return _flag(getattr(when, name), _fact(situation, name))


def _heavier_than(name: str, when: When, situation: Situation) -> Holds:
    return _above(getattr(when, f"{name}_above_t"), getattr(situation, f"{name}_t"))


def _above(limit_t: float | None, mass_t: float | None) -> Holds:
    if limit_t is None:
        return "yes"
    known_t = usable(mass_t)
    if known_t is None:
        return "maybe"
    return "yes" if known_t > limit_t else "no"


def _in_period(period: tuple[str, str] | None, day: str | None) -> Holds:
    if period is None:
        return "yes"
    if day is None:
        return "maybe"
    first, last = period
    inside = first <= day <= last if first <= last else day >= first or day <= last
    return "yes" if inside else "no"


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


Judge = Callable[[When, Situation], Holds]
_CONDITIONS: tuple[tuple[str, Callable[[When], Any], Judge], ...] = (
    ("road", lambda when: when.road_types or when.announced or None, _road),
    ("road_name", lambda when: when.roads, lambda when, here: _on_roads(when.roads, here.road_name)),
    ("road_name", lambda when: when.not_roads, lambda when, here: _off_roads(when.not_roads, here.road_name)),
    ("vehicle", lambda when: when.vehicle_classes, lambda when, here: _class(when.vehicle_classes, here)),
    *((name, attrgetter(name), partial(_flagged, name)) for name in FLAGS),
    *((name, attrgetter(f"{name}_above_t"), partial(_heavier_than, name)) for name in MASSES),
    (
        "visibility",
        attrgetter("visibility_below_m"),
        lambda when, here: _visibility(when.visibility_below_m, here.visibility_m),
    ),
    ("time", attrgetter("hours"), lambda when, here: _within(when.hours, here.time_of_day_h)),
    ("day", attrgetter("period"), lambda when, here: _in_period(when.period, here.day)),
    ("lane", attrgetter("lanes"), lambda when, here: "maybe"),
    ("zone_here", attrgetter("zone"), lambda when, here: _zone(when.zone, here.zone)),
    ("part", attrgetter("subdivision"), lambda when, here: _part(when.subdivision, here.jurisdiction)),
)
"""Of each condition the name of its fact (of `words`), whether an effect names it, and whether it holds."""
