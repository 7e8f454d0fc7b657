"""Signs with pictures that no class of ours has: invented symbols in triangles, diamonds, rings and discs, arrows to the side,
boards and ends of something else. What they teach is that a sign of a known shape may say something unknown."""

from collections.abc import Callable

import cv2
import numpy as np
from numpy.typing import NDArray

from training.sign_pictures.faces import Face

Chance = np.random.Generator
Canvas = NDArray[np.uint8]
Colour = tuple[int, int, int]

_PX, _FINE = 112, 4
"""Side of a face, and how many times larger it is drawn."""
_SIDE = _PX * _FINE
_RED, _BLUE, _WHITE, _BLACK, _YELLOW = (190, 20, 35), (10, 75, 155), (244, 245, 243), (22, 22, 24), (250, 195, 20)


def unknown_face(chance: Chance) -> Face:
    """One such face, RGBA."""
    draw = _KINDS[int(chance.integers(len(_KINDS)))]
    canvas = np.zeros((_SIDE, _SIDE, 4), np.uint8)
    draw(canvas, chance)
    shade = chance.normal(0, 10, 3) + chance.normal(0, 8)
    small = cv2.resize(canvas, (_PX, _PX), interpolation=cv2.INTER_AREA).astype(np.float32)
    small[..., :3] = small[..., :3] / np.maximum(small[..., 3:] / 255, 1 / 255) + shade
    return Face(np.clip(small, 0, 255).astype(np.uint8), 1.0)


def _fill(canvas: Canvas, corners: list[tuple[float, float]], colour: Colour) -> None:
    points = (np.array(corners) * _SIDE).round().astype(np.int32)
    cv2.fillPoly(canvas, [points], (*colour, 255))


def _disc(canvas: Canvas, x: float, y: float, radius: float, colour: Colour) -> None:
    cv2.circle(canvas, (round(x * _SIDE), round(y * _SIDE)), round(radius * _SIDE), (*colour, 255), -1)


def _line(canvas: Canvas, x0: float, y0: float, x1: float, y1: float, width: float, colour: Colour) -> None:
    start, end = (round(x0 * _SIDE), round(y0 * _SIDE)), (round(x1 * _SIDE), round(y1 * _SIDE))
    cv2.line(canvas, start, end, (*colour, 255), max(1, round(width * _SIDE)))


def _symbol(canvas: Canvas, x: float, y: float, size: float, colour: Colour, chance: Chance) -> None:
    """An invented picture within ``size`` around a place: three to six parts, so that it is no single bar or arrow."""
    for _ in range(int(chance.integers(3, 7))):
        dx, dy = chance.uniform(-0.32, 0.32, 2) * size
        part = chance.random()
        if part < 0.3:
            angles = np.sort(chance.uniform(0, 2 * np.pi, int(chance.integers(3, 7))))
            reach = size * chance.uniform(0.12, 0.3, len(angles))
            _fill(
                canvas,
                [(x + dx + r * np.cos(a), y + dy + r * np.sin(a)) for a, r in zip(angles, reach, strict=True)],
                colour,
            )
        elif part < 0.5:
            _disc(canvas, x + dx, y + dy, size * chance.uniform(0.06, 0.16), colour)
        elif part < 0.75:
            ex, ey = chance.uniform(-0.4, 0.4, 2) * size
            _line(canvas, x + dx, y + dy, x + ex, y + ey, size * chance.uniform(0.06, 0.16), colour)
        elif part < 0.88:
            width, height = size * chance.uniform(0.1, 0.6), size * chance.uniform(0.08, 0.3)
            left, top = x + dx, y + dy
            _fill(
                canvas, [(left, top), (left + width, top), (left + width, top + height), (left, top + height)], colour
            )
        else:
            reach_px = round(size * chance.uniform(0.1, 0.3) * _SIDE)
            centre = (round((x + dx) * _SIDE), round((y + dy) * _SIDE))
            start, end = float(chance.uniform(0, 180)), float(chance.uniform(200, 360))
            thick = round(size * 0.09 * _SIDE)
            cv2.ellipse(canvas, centre, (reach_px, reach_px), 0, start, end, (*colour, 255), thick)


def _triangle(canvas: Canvas, chance: Chance) -> None:
    edge, ground = float(chance.uniform(0.09, 0.15)), _YELLOW if chance.random() < 0.15 else _WHITE
    _fill(canvas, [(0.5, 0.03), (0.99, 0.93), (0.01, 0.93)], _RED)
    _fill(
        canvas,
        [(0.5, 0.03 + 1.8 * edge), (0.99 - 1.55 * edge, 0.93 - 0.8 * edge), (0.01 + 1.55 * edge, 0.93 - 0.8 * edge)],
        ground,
    )
    _symbol(canvas, 0.5, 0.62, float(chance.uniform(0.32, 0.5)), _BLACK, chance)


def _diamond(canvas: Canvas, chance: Chance) -> None:
    _fill(canvas, [(0.5, 0.0), (1.0, 0.5), (0.5, 1.0), (0.0, 0.5)], _BLACK)
    _fill(canvas, [(0.5, 0.03), (0.97, 0.5), (0.5, 0.97), (0.03, 0.5)], _YELLOW)
    _symbol(canvas, 0.5, 0.5, float(chance.uniform(0.4, 0.6)), _BLACK, chance)


def _ring(canvas: Canvas, chance: Chance) -> None:
    _disc(canvas, 0.5, 0.5, 0.49, _RED)
    _disc(canvas, 0.5, 0.5, 0.49 - float(chance.uniform(0.07, 0.12)), _WHITE)
    for _ in range(int(chance.integers(1, 3))):
        colour = _RED if chance.random() < 0.25 else _BLACK
        _symbol(canvas, 0.5 + float(chance.uniform(-0.08, 0.08)), 0.5, float(chance.uniform(0.3, 0.5)), colour, chance)
    if chance.random() < 0.3:
        _line(canvas, 0.17, 0.17, 0.83, 0.83, 0.07, _RED)


def _order(canvas: Canvas, chance: Chance) -> None:
    """A blue disc with a bent arrow, two arrows, or an invented symbol."""
    _disc(canvas, 0.5, 0.5, 0.49, _WHITE)
    _disc(canvas, 0.5, 0.5, 0.475, _BLUE)
    if chance.random() < 0.4:
        _symbol(canvas, 0.5, 0.5, float(chance.uniform(0.4, 0.6)), _WHITE, chance)
        return
    side, width = float(chance.choice([-1, 1])), float(chance.uniform(0.08, 0.13))
    foot = 0.5 - side * float(chance.uniform(0.0, 0.18))
    bend = float(chance.uniform(0.38, 0.58))
    _line(canvas, foot, 0.82, foot, bend, width, _WHITE)
    _line(canvas, foot, bend, 0.5 + 0.2 * side, bend, width, _WHITE)
    _tip(canvas, 0.5 + 0.38 * side, bend, side, 0.0)
    if chance.random() < 0.5:
        _line(canvas, foot, bend, foot, 0.3, width, _WHITE)
        _tip(canvas, foot, 0.12, 0.0, -1.0)


def _tip(canvas: Canvas, x: float, y: float, dx: float, dy: float) -> None:
    """An arrow's head that ends at a place."""
    back, half = 0.2, 0.14
    left = (x - back * dx - half * dy, y - back * dy + half * dx)
    right = (x - back * dx + half * dy, y - back * dy - half * dx)
    _fill(canvas, [(x, y), left, right], _WHITE)


def _end(canvas: Canvas, chance: Chance) -> None:
    """The end of something that no class of ours ends: lorries, symbols on pale grey under dark bars."""
    grey = tuple(int(v) for v in np.full(3, chance.integers(110, 170)))
    _disc(canvas, 0.5, 0.5, 0.49, _BLACK)
    _disc(canvas, 0.5, 0.5, 0.475, _WHITE)
    if chance.random() < 0.6:
        _lorry(canvas, 0.5, 0.5, (grey[0], grey[1], grey[2]))
    else:
        _symbol(canvas, 0.5, 0.5, float(chance.uniform(0.4, 0.6)), (grey[0], grey[1], grey[2]), chance)
    for offset in np.linspace(-0.09, 0.09, int(chance.integers(3, 6))):
        _line(canvas, 0.2 + offset, 0.84 + offset / 3, 0.8 + offset, 0.16 + offset / 3, 0.018, _BLACK)


def _lorry(canvas: Canvas, x: float, y: float, colour: Colour) -> None:
    _fill(canvas, [(x - 0.05, y - 0.18), (x + 0.3, y - 0.18), (x + 0.3, y + 0.1), (x - 0.05, y + 0.1)], colour)
    _fill(canvas, [(x - 0.26, y - 0.04), (x - 0.08, y - 0.1), (x - 0.08, y + 0.1), (x - 0.28, y + 0.1)], colour)
    for wheel in (-0.18, 0.02, 0.22):
        _disc(canvas, x + wheel, y + 0.12, 0.05, colour)


def _lorries(canvas: Canvas, chance: Chance) -> None:
    """No lorries, or no overtaking by them: a ring with one, before a car or alone."""
    _disc(canvas, 0.5, 0.5, 0.49, _RED)
    _disc(canvas, 0.5, 0.5, 0.39, _WHITE)
    if chance.random() < 0.5:
        _lorry(canvas, 0.47, 0.5, _BLACK)
        return
    left, right = (_RED, _BLACK) if chance.random() < 0.7 else (_BLACK, _RED)
    _fill(canvas, [(0.15, 0.36), (0.46, 0.36), (0.46, 0.6), (0.15, 0.6)], left)
    _disc(canvas, 0.22, 0.63, 0.04, left)
    _disc(canvas, 0.4, 0.63, 0.04, left)
    _fill(canvas, [(0.56, 0.52), (0.6, 0.42), (0.78, 0.42), (0.82, 0.52), (0.84, 0.62), (0.54, 0.62)], right)


def _board(canvas: Canvas, chance: Chance) -> None:
    """A blue or white board with an invented symbol."""
    ground, ink = (_BLUE, _WHITE) if chance.random() < 0.7 else (_WHITE, _BLACK)
    _fill(canvas, [(0.02, 0.02), (0.98, 0.02), (0.98, 0.98), (0.02, 0.98)], ink)
    _fill(canvas, [(0.05, 0.05), (0.95, 0.05), (0.95, 0.95), (0.05, 0.95)], ground)
    for _ in range(int(chance.integers(1, 3))):
        x, y = (float(v) for v in chance.uniform(0.4, 0.6, 2))
        _symbol(canvas, x, y, float(chance.uniform(0.4, 0.8)), ink, chance)


def _no_stopping(canvas: Canvas, chance: Chance) -> None:
    _disc(canvas, 0.5, 0.5, 0.49, _RED)
    _disc(canvas, 0.5, 0.5, 0.4, _BLUE)
    _line(canvas, 0.2, 0.2, 0.8, 0.8, 0.09, _RED)
    if chance.random() < 0.5:
        _line(canvas, 0.8, 0.2, 0.2, 0.8, 0.09, _RED)


_KINDS: tuple[Callable[[Canvas, Chance], None], ...] = (
    _triangle, _triangle, _triangle, _diamond, _ring, _ring, _order, _order, _end, _end, _lorries, _board, _no_stopping,
)  # fmt: skip
