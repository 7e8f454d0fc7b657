"""Effects and their conditions in words that a driver understands."""

from collections.abc import Sequence

from domain.units import spoken
from services.rules.packs.format import (
    Advisory,
    Condition,
    Duty,
    Effect,
    Limit,
    Minimum,
    Prohibition,
    RightOfWay,
    When,
)

ROADS = {
    "urban": "in built-up areas",
    "rural": "outside built-up areas",
    "motorway": "on motorways",
    "dual_carriageway": "on dual carriageways",
    "living_street": "in living streets",
    "expressway": "on expressways",
}
VEHICLES = {
    "car": "cars",
    "motorcycle": "motorcycles",
    "van": "vans",
    "car_trailer": "cars with a trailer",
    "van_trailer": "vans with a trailer",
    "lorry_light": "lorries up to 7.5 t",
    "lorry": "lorries above 7.5 t",
    "lorry_trailer": "lorries with a trailer",
    "bus": "buses",
    "coach": "coaches",
}

FLAGS = {
    "lit": ("with street lamps", "without street lamps"),
    "divided": ("with divided carriageways", "without divided carriageways"),
    "snow_chains": ("on snow chains", "without snow chains"),
    "novice": ("on a probationary licence", "on a full licence"),
    "electric": ("for electric vehicles", "for vehicles that are not electric"),
    "plate_100": ("with approval for 100 km/h", "without approval for 100 km/h"),
    "standing": ("with standing passengers", "without standing passengers"),
}
LANES = {"left": "left", "middle": "middle", "right": "right", "bus": "bus", "hard_shoulder": "hard shoulder"}


def said(effect: Effect) -> str:
    """One effect as a phrase: `limit 50 km/h in built-up areas`."""
    where = conditions(effect.when) if not isinstance(effect, RightOfWay | Condition) else ""
    return f"{subject(effect)} {value(effect)} {where}".replace("  ", " ").strip()


def subject(effect: Effect) -> str:
    """What kind of thing it demands, without its value and conditions."""
    if isinstance(effect, Limit):
        return "limit, whatever a sign shows," if effect.cap else "limit"
    if isinstance(effect, Advisory):
        return "recommended speed"
    if isinstance(effect, Minimum):
        return "minimum speed"
    if isinstance(effect, Prohibition):
        return f"forbidden: {spaced(effect.what)}"
    if isinstance(effect, Duty):
        return f"duty: {spaced(effect.what)}"
    if isinstance(effect, RightOfWay):
        return f"at {spaced(effect.trigger)}"
    return f"how signs are read: {spaced(effect.what)}"


def value(effect: Effect) -> str:
    """What may change while the subject stays: a speed, an action."""
    if isinstance(effect, Limit | Advisory | Minimum):
        return spoken(effect.value, effect.unit)
    if isinstance(effect, Duty | RightOfWay):
        return f"({spaced(effect.action)})"
    return f"(sign {effect.sign})" if isinstance(effect, Prohibition) and effect.sign else ""


def conditions(when: When) -> str:
    """`on motorways, for lorries above 7.5 t, when wet`; empty without conditions."""
    hours = f"from {when.hours[0]:g} to {when.hours[1]:g} h" if when.hours else ""
    parts = (
        _listed(when.road_types, ROADS),
        f"for {_listed(when.vehicle_classes, VEHICLES)}" if when.vehicle_classes else "",
        {True: "when wet", False: "when dry", None: ""}[when.wet],
        {True: "in snow", False: "without snow", None: ""}[when.snow],
        f"with less than {when.visibility_below_m:g} m of sight" if when.visibility_below_m else "",
        hours,
        f"from {when.period[0]} to {when.period[1]}" if when.period else "",
        f"on {', '.join(when.roads)}" if when.roads else "",
        f"off roads numbered {', '.join(when.not_roads)}" if when.not_roads else "",
        *(FLAGS[name][not getattr(when, name)] for name in FLAGS if getattr(when, name) is not None),
        *(
            f"with a {name} above {above_t:g} t"
            for name in ("mass", "trailer", "combination")
            if (above_t := getattr(when, f"{name}_above_t")) is not None
        ),
        f"in the {_listed(when.lanes, LANES)} lane" if when.lanes else "",
        f"where a sign shows less than {when.posted_below:g}" if when.posted_below else "",
        {True: "within a speed zone", False: "outside speed zones", None: ""}[when.zone],
        f"in {when.subdivision}" if when.subdivision else "",
        "only from the road's own sign on" if when.announced else "",
    )
    return ", ".join(part for part in parts if part)


def spaced(text: str) -> str:
    """A name of the format without underscores."""
    return text.replace("_", " ")


def _listed(names: Sequence[str], words: dict[str, str]) -> str:
    said = [words[name] for name in names]
    return " and ".join([", ".join(said[:-1]), said[-1]] if len(said) > 1 else said)
