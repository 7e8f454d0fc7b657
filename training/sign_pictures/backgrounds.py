"""What stands behind and beside signs in training pictures, and things that are no signs at all, drawn here."""

from collections.abc import Callable

import cv2
import numpy as np
from numpy.typing import NDArray

from training.sign_pictures.faces import Face

Picture = NDArray[np.uint8]
Chance = np.random.Generator
Family = Callable[[Chance], NDArray[np.float32]]

BACKGROUND_PX = 160
_SKY = ((190, 205, 225), (150, 180, 220), (170, 172, 178), (225, 228, 232), (110, 130, 160))
_GREEN = ((60, 90, 45), (85, 110, 55), (40, 65, 35), (110, 120, 70), (75, 80, 50))
_BUILT = ((150, 80, 60), (190, 175, 150), (120, 120, 122), (90, 88, 86), (205, 200, 190), (165, 120, 80))


def _colour(table: tuple[tuple[int, int, int], ...], chance: Chance) -> NDArray[np.float32]:
    base = np.array(table[int(chance.integers(len(table)))], np.float32)
    return np.asarray(np.clip(base * chance.uniform(0.6, 1.2) + chance.normal(0, 6, 3), 0, 255), np.float32)


def _noise(chance: Chance, cells: int, size: int = BACKGROUND_PX) -> NDArray[np.float32]:
    coarse = chance.normal(0, 1, (cells, cells)).astype(np.float32)
    return np.asarray(cv2.resize(coarse, (size, size), interpolation=cv2.INTER_CUBIC), np.float32)[..., None]


def _sky(chance: Chance) -> NDArray[np.float32]:
    ramp = np.linspace(0, 1, BACKGROUND_PX, dtype=np.float32)[:, None, None]
    clouds = _noise(chance, 5) * chance.uniform(2, 14)
    return np.asarray(_colour(_SKY, chance) * (1 - ramp) + _colour(_SKY, chance) * ramp + clouds, np.float32)


def _foliage(chance: Chance) -> NDArray[np.float32]:
    out = np.broadcast_to(_colour(_GREEN, chance), (BACKGROUND_PX, BACKGROUND_PX, 3)).copy()
    for cells in (8, 20, 50):
        out += _noise(chance, cells) * chance.uniform(8, 22)
    return out


def _wall(chance: Chance) -> NDArray[np.float32]:
    out = np.broadcast_to(_colour(_BUILT, chance), (BACKGROUND_PX, BACKGROUND_PX, 3)).copy() + _noise(chance, 12) * 6
    for _ in range(int(chance.integers(2, 9))):
        x, y = (int(v) for v in chance.integers(0, BACKGROUND_PX, 2))
        w, h = (int(v) for v in chance.integers(8, 45, 2))
        shade = float(chance.uniform(20, 230))
        cv2.rectangle(out, (x, y), (x + w, y + h), (shade, shade, shade * 1.05), -1)
    return out


def _road(chance: Chance) -> NDArray[np.float32]:
    out = np.full((BACKGROUND_PX, BACKGROUND_PX, 3), float(chance.uniform(60, 140)), np.float32)
    out += _noise(chance, 60) * 8
    for _ in range(int(chance.integers(0, 4))):
        ends = [tuple(int(v) for v in chance.integers(-20, BACKGROUND_PX + 20, 2)) for _ in range(2)]
        cv2.line(out, ends[0], ends[1], (215, 215, 215), int(chance.integers(2, 10)))
    return out


def _bars(chance: Chance) -> NDArray[np.float32]:
    """Poles, railings and trunks before a sky: a family that only tests see."""
    out = _sky(chance)
    for _ in range(int(chance.integers(3, 12))):
        x = int(chance.integers(0, BACKGROUND_PX))
        shade = _colour(_BUILT, chance)
        lean = int(chance.integers(-25, 25))
        cv2.line(out, (x, 0), (x + lean, BACKGROUND_PX), shade.tolist(), int(chance.integers(1, 14)))
    return out


def _bokeh(chance: Chance) -> NDArray[np.float32]:
    """Blurred spots of light, as in a town at dusk: a family that only tests see."""
    out = np.full((BACKGROUND_PX, BACKGROUND_PX, 3), float(chance.uniform(15, 90)), np.float32) + _noise(chance, 7) * 10
    for _ in range(int(chance.integers(4, 16))):
        centre = tuple(int(v) for v in chance.integers(0, BACKGROUND_PX, 2))
        cv2.circle(out, centre, int(chance.integers(3, 16)), chance.uniform(60, 255, 3).tolist(), -1)
    return np.asarray(cv2.GaussianBlur(out, (0, 0), float(chance.uniform(1, 4))), np.float32)


_FAMILIES = {"train": (_sky, _foliage, _wall, _road), "test": (_bars, _bokeh, _foliage, _wall)}


def background_bank(split: str, count: int, seed: int) -> list[Picture]:
    """``count`` pictures of 160 x 160 RGB; half of them join two families at a slanted edge."""
    chance = np.random.default_rng([seed, 23, len(split)])
    families = _FAMILIES[split]
    return [_background(families, chance) for _ in range(count)]


def _background(families: tuple[Family, ...], chance: Chance) -> Picture:
    picks = [families[int(chance.integers(len(families)))] for _ in range(2)]
    out = picks[0](chance)
    if chance.random() < 0.5:
        other = picks[1](chance)
        rows, columns = np.mgrid[0:BACKGROUND_PX, 0:BACKGROUND_PX]
        edge = rows + chance.normal(0, 0.6) * (columns - BACKGROUND_PX / 2) > chance.uniform(30, 130)
        out = np.asarray(np.where(edge[..., None], other, out), np.float32)
    return np.asarray(np.clip(out, 0, 255), np.uint8)


def distractor(chance: Chance) -> Face:
    """Something a detector may mistake for a sign, a panel or a light, as an RGBA face."""
    kind = _DISTRACTORS[int(chance.integers(len(_DISTRACTORS)))]
    return kind(chance)


def _blank(width: int, height: int) -> Picture:
    return np.zeros((height, width, 4), np.uint8)


def _random_paint(chance: Chance) -> tuple[int, int, int, int]:
    red, green, blue = (int(v) for v in chance.integers(10, 250, 3))
    return red, green, blue, 255


def _back_of_sign(chance: Chance) -> Face:
    out, shade = _blank(96, 96), int(chance.integers(70, 190))
    paint = (shade, shade, shade + 4, 255)
    if chance.random() < 0.5:
        cv2.circle(out, (48, 48), 46, paint, -1, cv2.LINE_AA)
    else:
        cv2.fillPoly(out, [np.array([(48, 4), (92, 88), (4, 88)])], paint, cv2.LINE_AA)
    cv2.rectangle(out, (44, 0), (52, 95), (shade - 25, shade - 25, shade - 25, 255), -1)
    return Face(out, 1.0)


def _vehicle_rear(chance: Chance) -> Face:
    out, paint = _blank(110, 90), _random_paint(chance)
    cv2.rectangle(out, (4, 30), (105, 80), paint, -1)
    cv2.fillPoly(out, [np.array([(16, 30), (28, 4), (82, 4), (94, 30)])], paint)
    cv2.fillPoly(out, [np.array([(24, 29), (33, 10), (77, 10), (86, 29)])], (30, 35, 42, 255))
    glow = int(chance.integers(120, 255))
    for x in (6, 88):
        cv2.rectangle(out, (x, 36), (x + 16, 48), (glow, 20, 20, 255), -1)
    cv2.rectangle(out, (40, 52), (70, 60), (230, 230, 225, 255), -1)
    return Face(out, 110 / 90)


def _billboard(chance: Chance) -> Face:
    height = int(chance.integers(36, 100))
    out = _blank(110, height)
    out[...] = _random_paint(chance)
    for _ in range(int(chance.integers(1, 6))):
        words = "".join(chance.choice(list("ABDEKLMNORSTaeinorst0123456789"), int(chance.integers(2, 8))))
        place = (int(chance.integers(-5, 40)), int(chance.integers(10, height)))
        size = float(chance.uniform(0.3, 1.0))
        cv2.putText(out, words, place, cv2.FONT_HERSHEY_DUPLEX, size, _random_paint(chance), int(chance.integers(1, 3)))
    return Face(out, 110 / height)


def _shape(chance: Chance) -> Face:
    out = _blank(96, 96)
    cv2.ellipse(out, (48, 48), tuple(int(v) for v in chance.integers(15, 47, 2)), 0, 0, 360, _random_paint(chance), -1)
    if chance.random() < 0.6:
        corners = chance.integers(5, 91, (int(chance.integers(3, 6)), 2))
        cv2.fillPoly(out, [corners], _random_paint(chance))
    return Face(out, 1.0)


def _person(chance: Chance) -> Face:
    out, paint = _blank(44, 110), _random_paint(chance)
    cv2.circle(out, (22, 10), 9, (200, 160, 130, 255), -1, cv2.LINE_AA)
    cv2.rectangle(out, (10, 20), (34, 62), paint, -1)
    for x in (12, 25):
        cv2.rectangle(out, (x, 62), (x + 8, 109), _random_paint(chance), -1)
    return Face(out, 0.4)


def _lamp(chance: Chance) -> Face:
    """A single tail light, street lamp or reflection."""
    out = _blank(60, 60)
    paint = ((255, 40, 30), (255, 200, 90), (240, 240, 235))[int(chance.integers(3))]
    cv2.circle(out, (30, 30), int(chance.integers(6, 26)), (*paint, 255), -1, cv2.LINE_AA)
    return Face(out, 1.0)


_DISTRACTORS = (_back_of_sign, _vehicle_rear, _billboard, _shape, _person, _lamp)
