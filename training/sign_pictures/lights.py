"""Drawn traffic lights: round lamps and arrows in a housing, some with a lit green arrow beside a red."""

from typing import NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

from services.simulator.signart import symbols
from services.simulator.signart.lettering import Box
from services.simulator.signart.painter import Painter

Picture = NDArray[np.uint8]
Chance = np.random.Generator
Paint = tuple[int, int, int]

HEIGHT_PX = 112
_LAMPS: dict[str, tuple[bool, bool, bool]] = {
    "red": (True, False, False),
    "red_amber": (True, True, False),
    "amber": (False, True, False),
    "green": (False, False, True),
    "off": (False, False, False),
}
_LIT: tuple[Paint, Paint, Paint] = ((255, 45, 35), (255, 190, 50), (50, 255, 140))
_TURNS_DEG = {"left": 270.0, "straight": 0.0, "right": 90.0}
_FILTER_SHARE = 0.15
"""Of the round reds, how many have a green arrow lit beside them: what they say is red."""
_DARK, _SUNLIT, _SUNLIT_SHARE = (0.08, 0.22), (0.22, 0.6), 0.35
"""What share of its lit colour an unlit lamp shows; in how many heads the low sun stands on the lamps, lit or not."""
_HALO_SHARE, _VISOR_SHARE = 0.35, 0.35


class Lamp(NamedTuple):
    """One lamp of a head: its place, its size, its colour's index, and where its arrow points (empty: round)."""

    x: int
    y: int
    radius: int
    colour: int
    way: str = ""


def draw_head(label: str, chance: Chance) -> Picture:
    """A three-lamp head from the front, RGBA: housing, perhaps a backboard, lamps with a hot middle."""
    colour, way = _taken_apart(label)
    width = int(chance.integers(38, 56))
    picture = _housing(width, chance)
    radius = int(chance.uniform(0.2, 0.4) * width)
    lamps = [Lamp(width // 2, int(HEIGHT_PX * (0.18 + 0.32 * index)), radius, index, way) for index in range(3)]
    unlit = chance.uniform(*(_SUNLIT if chance.random() < _SUNLIT_SHARE else _DARK))
    visor = chance.uniform(0.1, 0.35) if chance.random() < _VISOR_SHARE else 0.0
    halo = chance.uniform(0.1, 0.45) if chance.random() < _HALO_SHARE else 0.0
    for lamp, lit in zip(lamps, _LAMPS[colour], strict=True):
        _draw(picture, lamp, lit, chance, unlit * chance.uniform(0.85, 1.0))
        _shade(picture, lamp, visor)
    for lamp, lit in zip(lamps, _LAMPS[colour], strict=True):
        _shine(picture, lamp, halo if lit else 0.0)
    return (
        _with_filter(picture, radius, chance) if label == "light:red" and chance.random() < _FILTER_SHARE else picture
    )


def _taken_apart(label: str) -> tuple[str, str]:
    colour, _, way = label.removeprefix("light:").rpartition("_")
    return (colour, way) if way in _TURNS_DEG else (label.removeprefix("light:"), "")


def _housing(width: int, chance: Chance) -> Picture:
    picture = np.zeros((HEIGHT_PX, width, 4), np.uint8)
    shade = int(chance.integers(14, 60))
    picture[...] = (shade, shade + int(chance.integers(0, 12)), shade, 255)
    if chance.random() < 0.12:  # American heads are often yellow
        picture[...] = (int(chance.integers(170, 230)), int(chance.integers(130, 170)), 20, 255)
    if chance.random() < 0.35:
        cv2.rectangle(picture, (0, 0), (width - 1, HEIGHT_PX - 1), (235, 235, 235, 255), 2)
    return picture


def _with_filter(head: Picture, radius: int, chance: Chance) -> Picture:
    """The head and, at the height of its green lamp, a smaller housing with a lit green arrow."""
    width, left = head.shape[1], bool(chance.random() < 0.5)
    picture = np.zeros((HEIGHT_PX, 2 * width, 4), np.uint8)
    start, beside = (width, 0) if left else (0, width)
    picture[:, start : start + width] = head
    picture[int(0.66 * HEIGHT_PX) :, beside : beside + width] = head[2, 2]
    lamp = Lamp(beside + width // 2, int(0.83 * HEIGHT_PX), radius, 2, "left" if left else "right")
    _draw(picture, lamp, True, chance)
    return picture


def _draw(picture: Picture, lamp: Lamp, lit: bool, chance: Chance, unlit: float = 0.1) -> None:
    base = _LIT[lamp.colour]
    if not lit or lamp.way:
        _disc(picture, lamp, lamp.radius, _shaded(base, 0.04 if lit else unlit, 12))
    if not lit:
        return
    noise = chance.normal(0, 8, 3)
    gain = chance.uniform(0.75, 1.0)
    colour = _clipped([part * gain + float(noise[index]) for index, part in enumerate(base)])
    if lamp.way:
        _arrow(picture, lamp, colour)
        return
    _disc(picture, lamp, lamp.radius, colour)
    if chance.random() < 0.6:
        white = chance.uniform(0.3, 0.9)
        hot = _clipped([part + (255 - part) * white for part in colour])
        _disc(picture, lamp, int(lamp.radius * chance.uniform(0.3, 0.8)), hot)


def _arrow(picture: Picture, lamp: Lamp, colour: Paint) -> None:
    size = max(4, round(2.1 * lamp.radius))
    painter = Painter(1.0, 1.0, size)
    symbols.arrow(painter, Box(0.03, 0.03, 0.94, 0.94), colour, _TURNS_DEG[lamp.way])
    shape = painter.picture()
    top, left = lamp.y - size // 2, lamp.x - size // 2
    y0, x0 = max(0, top), max(0, left)
    part = picture[y0 : top + size, x0 : left + size, :3]
    seen = shape[y0 - top : y0 - top + part.shape[0], x0 - left : x0 - left + part.shape[1]]
    share = seen[..., 3:].astype(np.float32) / 255
    part[...] = (part * (1 - share) + seen[..., :3] * share).astype(np.uint8)


def _shade(picture: Picture, lamp: Lamp, share: float) -> None:
    """The visor's shadow, or the visor seen from below: the upper part of the lamp is dark."""
    if share:
        height = max(1, round(2 * share * lamp.radius))
        top = lamp.y - lamp.radius
        axes = (round(1.1 * lamp.radius), height)
        dark = tuple(int(part) for part in picture[2, 2, :3])
        cv2.ellipse(picture, (lamp.x, top), axes, 0, 0, 360, (*dark, 255), -1, cv2.LINE_AA)


def _shine(picture: Picture, lamp: Lamp, strength: float) -> None:
    """Light scattered around a lit lamp, by lens and by haze."""
    if strength:
        rows, columns = np.mgrid[: picture.shape[0], : picture.shape[1]]
        far = ((rows - lamp.y) ** 2 + (columns - lamp.x) ** 2) / (1.6 * lamp.radius) ** 2
        light = strength * np.exp(-far)[..., None] * np.array(_LIT[lamp.colour], np.float32)
        picture[..., :3] = np.clip(picture[..., :3] + light, 0, 255).astype(np.uint8)


def _disc(picture: Picture, lamp: Lamp, radius: int, colour: Paint) -> None:
    cv2.circle(picture, (lamp.x, lamp.y), radius, (*colour, 255), -1, cv2.LINE_AA)


def _shaded(colour: Paint, share: float, least: int) -> Paint:
    return _clipped([part * share + least for part in colour])


def _clipped(parts: list[float]) -> Paint:
    red, green, blue = (int(np.clip(part, 0, 255)) for part in parts)
    return red, green, blue
