"""What every face is drawn with: colours of this one sign (it may be faded), its letters, its text and its country."""

from typing import NamedTuple

import numpy as np

from services.simulator.signart.lettering import Lettering
from services.simulator.signart.painter import Colour

_FRESH: dict[str, Colour] = {
    "white": (246, 246, 244),
    "black": (22, 22, 24),
    "red": (190, 22, 34),
    "blue": (10, 72, 152),
    "yellow": (250, 200, 20),
    "green": (0, 110, 70),
    "grey": (125, 128, 130),
    "orange": (240, 120, 20),
}


class Palette(NamedTuple):
    """The paints of one sign, RGB."""

    white: Colour
    black: Colour
    red: Colour
    blue: Colour
    yellow: Colour
    green: Colour
    grey: Colour
    orange: Colour


class Sheet(NamedTuple):
    """One order to the sign painter."""

    country: str
    text: str
    letters: Lettering
    paint: Palette


def palette(seed: int) -> Palette:
    """Seed 0 is factory fresh; any other seed gives a slightly different, possibly sun-bleached set of paints."""
    if seed == 0:
        return Palette(**_FRESH)
    chance = np.random.default_rng(seed)
    bleach = float(chance.uniform(0.0, 0.22))
    paints = {}
    for name, colour in _FRESH.items():
        shifted = np.array(colour, np.float64) * chance.uniform(0.9, 1.06) + chance.normal(0, 4, 3)
        paints[name] = (
            shifted * (1 - bleach) + bleach * np.array((205, 200, 195)) if name not in {"white", "black"} else shifted
        )
    return Palette(**{name: _as_colour(value) for name, value in paints.items()})


def _as_colour(value: np.ndarray) -> Colour:
    red, green, blue = (int(part) for part in np.clip(value, 0, 255))
    return red, green, blue
