"""Finds the line of dark letters on a bright plate, unless the plate has no line, several, or one that is cut off.

Letters are what is dark and wholly surrounded by the plate's bright ground; what touches its border is no letter.
"""

from collections.abc import Sequence
from typing import NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

from services.drivelm.reading.crops import Picture

BOARD_SHARE = 0.35
"""Of the crop, at least, that the plate's ground must span."""
_TALL = 0.6
"""Share of the tallest letter's height from which a mark is a letter, and not a dash, a dot or dirt."""
_ASTRAY = 0.6
"""Share of a letter's height by which a letter's middle may lie off the line."""
_ARROW = 1.25
"""How much higher than the letters the arrows of a length plate are, at least."""
_OFF_CENTRE = 0.04
"""Share of the width by which the rooms left and right of a line may differ: more, and something hides a part of it."""
NARROWEST, WIDEST = 1.7, 2.4
"""Width over height of a plate's ground. A narrower one is seen from far aside, or a part of it is hidden."""
_FRAYED = 0.012
"""Share of the width by which the ground's left or right end may move in beside a line: more, and a letter is cut off."""
_MARGIN = 0.35


class Line(NamedTuple):
    """The line cut out with some margin, and the height of its letters."""

    picture: Picture
    height_px: float


class _Mark(NamedTuple):
    """A connected dark thing on a plate: its box, in whole pixels."""

    x: int
    y: int
    width: int
    height: int

    @property
    def middle_y(self) -> float:
        return self.y + self.height / 2


def only_line(plate: Picture, *, between_arrows: bool = False) -> Line | None:
    """The only line on a plate (uint8 H x W x 3 RGB). None where the plate is not clearly seen, or shows another number
    of lines, or the line does not stand whole in its middle."""
    grey = np.asarray(cv2.cvtColor(plate, cv2.COLOR_RGB2GRAY), np.uint8)
    dark = grey <= cv2.threshold(grey, 0, 255, cv2.THRESH_BINARY + cv2.THRESH_OTSU)[0]
    found = _ground(dark)
    if found is None:
        return None
    ground, shape = found
    marks = _marks(dark, ground)
    letters = _between(marks) if between_arrows else marks
    line = _line(letters, ground) if letters else None
    if line is None or _is_frayed(shape[line.y : line.y + line.height], ground.width):
        return None
    return Line(_cut(plate, line, letters), _height(letters))


def _ground(dark: NDArray[np.bool_]) -> tuple[_Mark, NDArray[np.bool_]] | None:
    """The bright ground of the plate, the largest bright thing in the crop: its box, and where it is."""
    count, labels, stats, _ = cv2.connectedComponentsWithStats((~dark).astype(np.uint8), connectivity=4)
    if count < 2:
        return None
    largest = 1 + int(np.argmax(stats[1:, cv2.CC_STAT_AREA]))
    ground = _mark(stats[largest])
    if ground.width * ground.height < BOARD_SHARE * dark.size:
        return None
    is_plate = NARROWEST <= ground.width / ground.height <= WIDEST
    return (ground, np.asarray(labels == largest, np.bool_)) if is_plate else None


def _is_frayed(rows: NDArray[np.bool_], width: int) -> bool:
    """Whether something bites into the left or right end of the ground beside a line."""
    at, most = np.arange(len(rows)), max(1.2, _FRAYED * width)
    for end in (rows.argmax(axis=1), rows[:, ::-1].argmax(axis=1)):
        straight = np.polyval(np.polyfit(at, end, 1), at) if len(rows) > 1 else end  # a turned plate's ends slant
        if float((end - straight).max()) > most:
            return True
    return False


def _marks(dark: NDArray[np.bool_], ground: _Mark) -> list[_Mark]:
    """What is dark and lies inside the ground, from left to right, without specks."""
    _, _, stats, _ = cv2.connectedComponentsWithStats(dark.astype(np.uint8), connectivity=8)
    inside = [mark for mark in map(_mark, stats[1:]) if _is_inside(mark, ground)]
    tallest = max((mark.height for mark in inside), default=0)
    return sorted(mark for mark in inside if max(mark.width, mark.height) > 0.1 * tallest)


def _mark(row: NDArray[np.int32]) -> _Mark:
    x, y, width, height = (int(each) for each in row[:4])
    return _Mark(x, y, width, height)


def _is_inside(mark: _Mark, ground: _Mark) -> bool:
    across = ground.x < mark.x and mark.x + mark.width < ground.x + ground.width
    return across and ground.y < mark.y and mark.y + mark.height < ground.y + ground.height


def _between(marks: Sequence[_Mark]) -> list[_Mark]:
    """The letters between two arrows; none where the outermost marks are no arrows."""
    inner = list(marks[1:-1])
    least = _ARROW * _height(inner) if inner else 0.0
    return inner if inner and min(marks[0].height, marks[-1].height) >= least else []


def _height(marks: Sequence[_Mark]) -> float:
    """How high the letters are."""
    tallest = max(mark.height for mark in marks)
    return float(np.median([mark.height for mark in marks if mark.height >= _TALL * tallest]))


def _line(marks: Sequence[_Mark], ground: _Mark) -> _Mark | None:
    """The box of all marks, if they stand on one line, in the middle of the plate."""
    height = _height(marks)
    middle = float(np.median([mark.middle_y for mark in marks if mark.height >= _TALL * height]))
    if any(abs(mark.middle_y - middle) > _ASTRAY * height for mark in marks):
        return None
    left, right = min(mark.x for mark in marks), max(mark.x + mark.width for mark in marks)
    aside = abs((left - ground.x) - (ground.x + ground.width - right))
    if aside > max(2.0, _OFF_CENTRE * ground.width):
        return None
    top, bottom = min(mark.y for mark in marks), max(mark.y + mark.height for mark in marks)
    return _Mark(left, top, right - left, bottom - top)


def _cut(plate: Picture, line: _Mark, letters: Sequence[_Mark]) -> Picture:
    margin = round(_MARGIN * _height(letters)) + 1
    x0, y0 = max(0, line.x - margin), max(0, line.y - margin)
    return np.ascontiguousarray(plate[y0 : line.y + line.height + margin, x0 : line.x + line.width + margin])
