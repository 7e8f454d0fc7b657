"""What every face is drawn with: colours of this one sign (it may be faded), its letters, its text and its country."""

from typing import NamedTuple

import numpy as np

from services.simulator.signart.lettering import Lettering
from services.simulator.signart.painter import Colour


class Palette(NamedTuple):
    """The paints of one sign, RGB; as they stand here, factory fresh."""

    white: Colour = (246, 246, 244)
    black: Colour = (22, 22, 24)
    red: Colour = (190, 22, 34)
    blue: Colour = (10, 72, 152)
    yellow: Colour = (250, 200, 20)
    green: Colour = (0, 110, 70)
    grey: Colour = (125, 128, 130)
    orange: Colour = (240, 120, 20)


class Sheet(NamedTuple):
    """One order to the sign painter."""

    country: str
    text: str
    letters: Lettering
    paint: Palette


def palette(seed: int) -> Palette:
    """Seed 0 is factory fresh; any other seed gives a slightly different, possibly sun-bleached set of paints."""
    if seed == 0:
        return Palette()
    chance = np.random.default_rng(seed)
    bleach = float(chance.uniform(0.0, 0.22))
    paints = {}
    for name, colour in Palette()._asdict().items():
        shifted = np.array(colour, np.float64) * chance.uniform(0.9, 1.06) + chance.normal(0, 4, 3)
        if name not in {"white", "black"}:
            shifted = shifted * (1 - bleach) + bleach * np.array((205, 200, 195))
        paints[name] = _as_colour(shifted)
    return Palette(**paints)


def _as_colour(value: np.ndarray) -> Colour:
    red, green, blue = (int(part) for part in np.clip(value, 0, 255))
    return red, green, blue
