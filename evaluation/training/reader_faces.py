"""The bank of drawn faces a reader learns from: every class in every country, lettering and state of wear."""

from typing import NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

from services.drivelm.classes import LIGHTS, LIMIT_VALUES, PANELS, PLATES, SIGNS
from services.simulator.signart.catalogue import CODES, COUNTRIES
from services.simulator.signart.draw import draw_lettered, face_size_m
from services.simulator.signart.lettering import Lettering

Picture = NDArray[np.uint8]
Chance = np.random.Generator

_PARTS = (
    "Alt",
    "Neu",
    "Ober",
    "Bad ",
    "Klein",
    "Groß",
    "Nieder",
    "Wald",
    "Sand",
    "Stein",
    "Ash",
    "New",
    "West",
    "East ",
)
_ENDS = (
    "stadt",
    "hausen",
    "burg",
    "dorf",
    "heim",
    "ingen",
    "feld",
    "bach",
    "ford",
    "ton",
    "bury",
    "ham",
    "mouth",
    "ice",
)
_YELLOW, _WHITE, _DARK = ("DEU",), ("GBR", "AUT", "FRA"), ("NLD", "POL")
_TOWN_GROUNDS = {"yellow": _YELLOW, "white": _WHITE, "dark": _DARK}
_CONTINENT = tuple(country for country in COUNTRIES if country != "GBR")


class Order(NamedTuple):
    """What to draw: country, code, and the kind of text that belongs on it."""

    country: str
    code: str
    text: str = ""


def orders(label: str) -> tuple[Order, ...]:
    """Every way in which a class may look; empty for classes that are not signs."""
    if label.startswith("town_"):
        code, ground = label.split(":")
        return tuple(Order(land, code, "town") for land in _TOWN_GROUNDS[ground] if code in CODES[land])
    if label.startswith("info:"):
        code = {"info:units_mph": "info:units", "info:units_kmh": "info:units"}.get(label, "info:side")
        lands = ("GBR",) if label in {"info:units_mph", "info:side_left"} else _CONTINENT
        return tuple(Order(land, code) for land in lands)
    if label == "limit_end":
        return tuple(Order("DEU", f"limit_end:{value}") for value in LIMIT_VALUES)
    if label == "zone_end":
        return (Order("DEU", "zone_end:20"), Order("DEU", "zone_end:30"), Order("GBR", "zone_end:20"))
    text = {"plate:distance": "distance", "plate:time": "time"}.get(label, "")
    return tuple(Order(land, label, text) for land in COUNTRIES if label in CODES[land])


def text_for(kind: str, chance: Chance) -> str:
    """A made-up town, distance or time of day."""
    if kind == "town":
        name = str(chance.choice(_PARTS)) + str(chance.choice(_ENDS))
        below = f"\nKreis {chance.choice(_PARTS)!s}{chance.choice(_ENDS)!s}" if chance.random() < 0.4 else ""
        return name + below
    if kind == "distance":
        return str(chance.choice(["{} m", "{}m"])).format(int(chance.integers(1, 20)) * 50)
    if kind == "time":
        start, end = int(chance.integers(0, 24)), int(chance.integers(0, 24))
        return str(chance.choice(["{}-{} h", "{} - {} h", "{}-{} Uhr"])).format(start, end)
    return ""


class Face(NamedTuple):
    """A drawn face and how wide it is for its height."""

    picture: Picture
    aspect: float


def draw_bank(labels: tuple[str, ...], letters: dict[str, Lettering], each: int, seed: int) -> dict[str, list[Face]]:
    """``each`` faces per class, RGBA with the longer side 112 px."""
    chance = np.random.default_rng([seed, 11])
    return {label: [_draw(label, letters, chance) for _ in range(each)] for label in labels}


def _draw(label: str, letters: dict[str, Lettering], chance: Chance) -> Face:
    if label in LIGHTS:
        return draw_light(label, chance)
    choices = orders(label)
    order = choices[int(chance.integers(len(choices)))]
    lettering = letters[str(chance.choice(sorted(letters)))]
    seed = int(chance.integers(0, 1 << 30)) if chance.random() < 0.8 else 0
    text = text_for(order.text, chance)
    picture = draw_lettered(order.country, order.code, lettering, text=text, size_px=112, seed=seed)
    width_m, height_m = face_size_m(order.country, order.code)
    return Face(picture, width_m / height_m)


_LAMPS: dict[str, tuple[bool, bool, bool]] = {
    "light:red": (True, False, False),
    "light:red_amber": (True, True, False),
    "light:amber": (False, True, False),
    "light:green": (False, False, True),
    "light:off": (False, False, False),
}
_LIT = ((255, 45, 35), (255, 190, 50), (50, 255, 140))


def draw_light(label: str, chance: Chance) -> Face:
    """A three-lamp head from the front: housing, perhaps a backboard, visors, lamps with a hot middle."""
    height, width = 112, int(chance.integers(38, 56))
    picture = np.zeros((height, width, 4), np.uint8)
    shade = int(chance.integers(14, 60))
    picture[...] = (shade, shade + int(chance.integers(0, 12)), shade, 255)
    if chance.random() < 0.35:
        cv2.rectangle(picture, (0, 0), (width - 1, height - 1), (235, 235, 235, 255), 2)
    radius = int(chance.uniform(0.2, 0.4) * width)
    for index, lit in enumerate(_LAMPS[label]):
        centre = (width // 2, int(height * (0.18 + 0.32 * index)))
        _lamp(picture, centre, radius, index, lit, chance)
    return Face(picture, width / height)


def _lamp(picture: Picture, centre: tuple[int, int], radius: int, index: int, lit: bool, chance: Chance) -> None:
    if not lit:
        dark = tuple(int(part * chance.uniform(0.08, 0.22) + 12) for part in _LIT[index])
        cv2.circle(picture, centre, radius, (*dark, 255), -1, cv2.LINE_AA)
        return
    gain = chance.uniform(0.75, 1.0)
    colour = tuple(int(np.clip(part * gain + chance.normal(0, 8), 0, 255)) for part in _LIT[index])
    cv2.circle(picture, centre, radius, (*colour, 255), -1, cv2.LINE_AA)
    if chance.random() < 0.6:
        hot = tuple(int(part + (255 - part) * chance.uniform(0.3, 0.9)) for part in colour)
        cv2.circle(picture, centre, int(radius * chance.uniform(0.3, 0.8)), (*hot, 255), -1, cv2.LINE_AA)


def drawable() -> tuple[str, ...]:
    """Every class that is drawn from a face (all but ``other``)."""
    return (*SIGNS, *PLATES, *PANELS, *LIGHTS)
