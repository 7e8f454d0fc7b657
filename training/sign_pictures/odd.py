"""Signs that the reader must not take for a limit: other things in a red ring, blue minimum speeds, other boards."""

import numpy as np

from services.simulator.signart import america, discs
from services.simulator.signart.lettering import Box, Lettering, write_centred
from services.simulator.signart.painter import Painter
from services.simulator.signart.sheet import Sheet, palette
from training.sign_pictures.faces import Face

Chance = np.random.Generator
_PX = 112
# Weights, heights and widths, and numbers that no listed country posts in a ring.
_IN_RINGS = (
    "3,5t", "7,5t", "12t", "2,8m", "3,8m", "4m", "2m", "70m", "P", "0", "1", "2", "25", "35", "45", "55", "65", "75", "85",
    "140", "150", "160", "180", "200", "500", "800", "18t", "5,5t",
)  # fmt: skip
_MINIMUM = ("30", "40", "50", "60", "70", "80")
_BOARDS = (
    "NO|PARKING", "NO|TURN|ON RED", "MINIMUM|40", "MINIMUM|45", "LEFT|LANE", "NO|TRUCKS", "KEEP|RIGHT", "ROAD|CLOSED", "EXIT|25",
    "EXIT|45", "ROUTE|30", "MILE|65", "TRUCK|ROUTE", "BUS|ONLY", "2 HOUR|PARKING",
)  # fmt: skip


def odd_faces(letters: dict[str, Lettering], count: int, seed: int) -> list[Face]:
    """``count`` such faces in the given letterings, RGBA."""
    chance = np.random.default_rng([seed, 71])
    return [_odd(letters, chance) for _ in range(count)]


def _odd(letters: dict[str, Lettering], chance: Chance) -> Face:
    lettering = letters[str(chance.choice(sorted(letters)))]
    paint = palette(int(chance.integers(0, 1 << 30)))
    sheet = Sheet(str(chance.choice(["DEU", "GBR", "FRA", "POL", "CHE"])), "", lettering, paint)
    kind = chance.random()
    if kind < 0.6:
        painter = Painter(discs.DISC_M, discs.DISC_M, _PX)
        discs.limit(painter, sheet, str(chance.choice(_IN_RINGS)))
        return Face(painter.picture(), 1.0)
    if kind < 0.75:
        return _minimum(sheet, str(chance.choice(_MINIMUM)))
    painter = Painter(*america.BOARD_M, _PX)
    america.worded(painter, sheet, str(chance.choice(_BOARDS)))
    return Face(painter.picture(), america.BOARD_M[0] / america.BOARD_M[1])


def _minimum(sheet: Sheet, value: str) -> Face:
    """A white number on a blue disc: the least speed, never the most."""
    painter, middle = Painter(discs.DISC_M, discs.DISC_M, _PX), discs.DISC_M / 2
    painter.disc((middle, middle), middle, sheet.paint.white)
    painter.disc((middle, middle), 0.95 * middle, sheet.paint.blue)
    write_centred(painter, sheet.letters, value, Box(0.13, 0.19, 0.34, 0.22), sheet.paint.white)
    return Face(painter.picture(), 1.0)
