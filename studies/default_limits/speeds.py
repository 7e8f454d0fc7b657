"""What a row of the table allows a vehicle in one moment: general and own limits, and the conditions of both."""

import re
from collections.abc import Iterator

import msgspec

from domain.units import to_mps
from proto.scene import Unit
from studies.default_limits.filters import compared

WALK = 7.0
"""km/h, where the table says walking pace."""
_SPEED = re.compile(r"(\d+(?:\.\d+)?)(?: (mph|km/h))?$")
_COMPARED = re.compile(r"(\w+)\s*(<=|>=|<|>)\s*([\d.]+)$")
_HOURS = re.compile(r"(\d\d):(\d\d)-(\d\d):(\d\d)$")
_OF_TRAINS = re.compile(r"\b(?:trailers?|articulated|caravan)\b")


class Vehicle(msgspec.Struct, frozen=True, kw_only=True):
    """A class of vehicle as the table knows it."""

    modes: tuple[str, ...] = ()
    """Its own words, the closest first: `coach`, `bus`."""
    facts: frozenset[str] = frozenset()
    """`trailer`, `articulated`."""
    amounts: dict[str, float] = {}
    """`maxweightrating` in tonnes, `length` in metres."""


class Moment(msgspec.Struct, frozen=True, kw_only=True):
    """Weather and time of day."""

    wet: bool = False
    hour: float = 12.0


class Speed(msgspec.Struct, frozen=True):
    """As the table writes it."""

    value: float
    unit: Unit = "km/h"

    @property
    def mps(self) -> float:
        """In SI."""
        return to_mps(self.value, self.unit)

    def __str__(self) -> str:
        return f"{self.value:g} {self.unit}"


def parse_speed(text: str) -> Speed | None:
    """`50`, `30 mph`, `walk`; None for anything else (`none`, a speed by lane)."""
    if text.strip() == "walk":
        return Speed(WALK)
    match = _SPEED.match(text.strip())
    return Speed(float(match[1]), "mph" if match[2] == "mph" else "km/h") if match else None


def limit_of(tags: dict[str, str], vehicle: Vehicle, moment: Moment) -> Speed | None:
    """The lowest speed that binds: the road's, and the vehicle's own in place of what is said of every vehicle's mass."""
    own = next((list(found) for mode in vehicle.modes if (found := tuple(_stated(tags, mode, vehicle, moment)))), [])
    own_train = any(_OF_TRAINS.search(tags.get(f"maxspeed:{mode}:conditional", "")) for mode in vehicle.modes)
    general = [
        speed
        for speed, condition in _conditional(tags.get("maxspeed:conditional", ""))
        if _holds(condition, vehicle, moment) and not (own and _about_mass(condition, own_train))
    ]
    road = parse_speed(tags.get("maxspeed", ""))
    return min([*own, *general, *([road] if road else [])], key=lambda speed: speed.mps, default=None)


def minimum_of(tags: dict[str, str]) -> Speed | None:
    """What the row says of slow vehicles."""
    return parse_speed(tags.get("minspeed", ""))


def _about_mass(condition: str, own_train: bool) -> bool:
    """A condition that a class's own limit stands in place of: on mass, and on trailers where the class has one of its own."""
    return own_train if _OF_TRAINS.search(condition) else "weight" in condition


def _stated(tags: dict[str, str], mode: str, vehicle: Vehicle, moment: Moment) -> Iterator[Speed]:
    if (speed := parse_speed(tags.get(f"maxspeed:{mode}", ""))) is not None:
        yield speed
    for speed, condition in _conditional(tags.get(f"maxspeed:{mode}:conditional", "")):
        if _holds(condition, vehicle, moment):
            yield speed


def _conditional(text: str) -> Iterator[tuple[Speed, str]]:
    """`80 @ (trailer); 60 @ (maxweightrating>7.5 AND trailer)`."""
    for part in text.split(";"):
        value, _, condition = part.partition("@")
        if (speed := parse_speed(value)) is not None:
            yield speed, condition.strip().removeprefix("(").removesuffix(")")


def _holds(condition: str, vehicle: Vehicle, moment: Moment) -> bool:
    return all(_fact(each.strip(), vehicle, moment) for each in condition.split(" AND "))


def _fact(text: str, vehicle: Vehicle, moment: Moment) -> bool:
    if text == "wet":
        return moment.wet
    if match := _COMPARED.match(text):
        return compared(str(vehicle.amounts.get(match[1], "")), match[2], match[3])
    if match := _HOURS.match(text):
        begin, end = int(match[1]) + int(match[2]) / 60, int(match[3]) + int(match[4]) / 60
        return begin <= moment.hour < end if begin <= end else not end <= moment.hour < begin
    return text in vehicle.facts
