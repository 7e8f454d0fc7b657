"""Units as bus descriptions spell them, and how a number in one becomes a number in another."""

import math
from typing import NamedTuple

from services.can.errors import ProfileError


class Linear(NamedTuple):
    """`value * scale + offset`."""

    scale: float = 1.0
    offset: float = 0.0

    def then(self, after: "Linear") -> "Linear":
        """This, and `after` on its result."""
        return Linear(self.scale * after.scale, self.offset * after.scale + after.offset)


SPELLINGS: dict[str, tuple[str, ...]] = {
    "m/s": ("mps", "meterspersecond", "meter/s", "unit_meterperseco"),
    "km/h": ("kph", "kmh", "km/hr", "kmph", "kilometerperhour", "unit_kilometerperhour", "unit_kilometperhour"),
    "mph": ("mi/h", "mile/h", "miles/h", "unit_mileperhour"),
    "m/s2": ("m/s^2", "m/s²", "m/ss", "m/s/s", "m/s**2", "mps2", "m/sec2", "unit_meterpersecosquar", "meters/sec^2"),
    "g": ("gn", "gforce", "g's"),
    "rad": ("radian", "radians"),
    "deg": ("°", "degree", "degrees", "grad", "unit_degreofarc", "degreeofarc"),
    "rad/s": ("rad/sec", "radps", "radians/second", "rad/second"),
    "deg/s": ("°/s", "deg/sec", "degree/s", "degrees/s", "degree/sec", "dps", "grad/s", "unit_degreofarcpersecon"),
    "rpm": ("1/min", "u/min", "r/min", "min-1", "/min", "upm", "unit_minutinver"),
    "bar": ("unit_bar",),
    "kPa": ("unit_kilopasca",),
    "Pa": ("unit_pasca",),
    "psi": ("lb/in2", "lbf/in2"),
    "%": ("percent", "pct", "unit_percen", "unit_percent"),
    "share": (),
    "degC": ("°c", "c", "celsius", "deg c", "degree c", "degreecelsius", "grad c", "unit_degrecelsi"),
    "degF": ("°f", "f", "fahrenheit", "deg f", "degree f", "unit_degrefahre"),
    "lx": ("lux",),
    "V": ("volt", "volts", "unit_volt"),
    "km": ("kilometer", "kilometers", "unit_kilometer"),
    "mi": ("mile", "miles", "unit_mile"),
    "m": ("meter", "meters", "unit_meter"),
    "s": ("sec", "second", "seconds", "unit_secon"),
}
"""Our name of a unit -> how descriptions spell it, in small letters; blanks at the ends do not count."""

LINEAR: dict[tuple[str, str], Linear] = {
    ("km/h", "m/s"): Linear(1 / 3.6),
    ("mph", "m/s"): Linear(0.44704),
    ("g", "m/s2"): Linear(9.80665),
    ("deg", "rad"): Linear(math.pi / 180),
    ("deg/s", "rad/s"): Linear(math.pi / 180),
    ("rpm", "rad/s"): Linear(math.pi / 30),
    ("kPa", "bar"): Linear(0.01),
    ("Pa", "bar"): Linear(1e-5),
    ("psi", "bar"): Linear(0.0689475729),
    ("%", "share"): Linear(0.01),
    ("degF", "degC"): Linear(5 / 9, -160 / 9),
    ("mi", "km"): Linear(1.609344),
    ("m", "km"): Linear(0.001),
}
"""(unit on the bus, unit of the field). A pair that is not here is an error, never a guess."""

_CANONICAL = {spelling: unit for unit, spellings in SPELLINGS.items() for spelling in (unit.lower(), *spellings)}


def canonical(unit: str) -> str | None:
    """Our name of a unit, None where it is not known. Pa is told from psi and bar by its letters alone."""
    return _CANONICAL.get(" ".join(unit.replace("\ufffd", "°").lower().split()))


def linear(bus_unit: str, field_unit: str) -> Linear:
    """How a number in `bus_unit` becomes one in `field_unit` (one of SPELLINGS). Raises ProfileError."""
    known = canonical(bus_unit)
    if known is not None and known == field_unit:
        return Linear()
    try:
        return LINEAR[known or "", field_unit]
    except KeyError:
        raise ProfileError(f"no conversion from {bus_unit!r} to {field_unit!r}") from None
