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
    "m/s": ("mps", "meter/s", "unit_meterpersecon"),
    "km/h": ("kph", "kmh", "km/hr", "kmph", "unit_kilometerperhour"),
    "mph": ("mi/h", "mile/h", "miles/h", "unit_mileperhour"),
    "m/s2": ("m/s^2", "m/s²", "m/ss", "m/s/s", "m/s**2", "mps2", "m/sec2", "unit_meterperseconsquar"),
    "g": ("gn", "gforce", "g's", "unit_forceofgravi"),
    "%g": ("unit_percentofforceofgravi",),
    "rad": ("radian", "radians"),
    "deg": ("°", "degree", "degrees", "unit_degreofarc"),
    "rad/s": ("rad/sec", "radps", "rad/second"),
    "deg/s": ("°/s", "deg/sec", "degree/s", "degrees/s", "degree/sec", "dps", "unit_degreofarcpersecon"),
    "rpm": ("1/min", "u/min", "r/min", "min-1", "/min", "unit_minutinver"),
    "bar": ("unit_bar",),
    "mbar": ("unit_millibar", "hpa"),
    "kPa": ("kilopascal", "unit_kilopasca"),
    "Pa": ("pascal", "unit_pasca"),
    "psi": ("lb/in2", "lbf/in2"),
    "%": ("percent", "pct", "unit_percent"),
    "share": (),
    "degC": ("°c", "c", "celsius", "deg c", "degree c", "degrees c", "unit_degrecelsi"),
    "degF": ("°f", "f", "fahrenheit", "deg f", "degree f", "degrees f", "unit_degrefahre"),
    "lx": ("lux",),
    "V": ("volt", "volts", "unit_volt"),
}
"""Our name of a unit -> how descriptions spell it, in small letters; blanks at the ends do not count."""

LINEAR: dict[tuple[str, str], Linear] = {
    ("km/h", "m/s"): Linear(1 / 3.6), ("mph", "m/s"): Linear(0.44704), ("g", "m/s2"): Linear(9.80665),
    ("%g", "m/s2"): Linear(0.0980665), ("deg", "rad"): Linear(math.pi / 180),
    ("deg/s", "rad/s"): Linear(math.pi / 180), ("rpm", "rad/s"): Linear(math.pi / 30),
    ("mbar", "bar"): Linear(0.001), ("kPa", "bar"): Linear(0.01), ("Pa", "bar"): Linear(1e-5),
    ("psi", "bar"): Linear(0.0689475729), ("%", "share"): Linear(0.01), ("degF", "degC"): Linear(5 / 9, -160 / 9),
}  # fmt: skip
"""(unit on the bus, unit of the field). A pair that is not here is an error, never a guess."""

_CANONICAL = {spelling: unit for unit, spellings in SPELLINGS.items() for spelling in (unit.lower(), *spellings)}


def canonical(unit: str) -> str | None:
    """Our name of a unit, None where it is not known."""
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
