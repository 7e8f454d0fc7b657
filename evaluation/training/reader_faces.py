"""The bank of drawn faces a reader learns from: every class in every country, lettering and state of wear."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from evaluation.training.reader_lights import draw_head
from evaluation.training.reader_texts import text_for
from services.drivelm.classes import LIGHTS, LIMIT_VALUES, PANELS, PLATES, SIGNS
from services.simulator.signart.catalogue import CODES, COUNTRIES
from services.simulator.signart.draw import draw_lettered, face_size_m
from services.simulator.signart.lettering import Lettering

Picture = NDArray[np.uint8]
Chance = np.random.Generator

_YELLOW, _WHITE, _DARK = ("DEU",), ("GBR", "AUT", "FRA"), ("NLD", "POL", "CHE")
_TOWN_GROUNDS = {"yellow": _YELLOW, "white": _WHITE, "dark": _DARK}
_CONTINENT = tuple(country for country in COUNTRIES if country not in ("GBR", "USA"))
_BOARDS = "USA"


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
    if label == "info:interstate":
        return (Order(_BOARDS, label, "interstate"),)
    if label.startswith("info:"):
        code = {"info:units_mph": "info:units", "info:units_kmh": "info:units"}.get(label, "info:side")
        lands = ("GBR",) if label in {"info:units_mph", "info:side_left"} else _CONTINENT
        return tuple(Order(land, code) for land in lands)
    head, _, tail = label.partition(":")
    if label == "limit_end":
        return tuple(Order(land, f"limit_end:{value}") for value in LIMIT_VALUES for land in _CONTINENT)
    if label == "zone_end":
        return tuple(Order(land, code) for land in COUNTRIES for code in CODES[land] if code.startswith("zone_end"))
    if head == "limit_board":
        return (Order(_BOARDS, f"limit:{tail}"),)
    found = [land for land in COUNTRIES if label in CODES[land] and not (head == "limit" and land == _BOARDS)]
    return tuple(Order(land, label, _text_kind(label, land)) for land in found)


def _text_kind(label: str, land: str) -> str:
    """What kind of text (see ``reader_texts``) a class carries in a country."""
    if label.startswith("plate:when_wet:"):
        return f"wet:{label.rpartition(':')[2]}"
    if label in ("plate:arrow_left", "plate:arrow_right"):
        return "arrow"
    kind = _TEXT_KINDS.get(label.removeprefix("plate:").partition(":")[0], "")
    return f"{kind}:{land}" if kind in ("time", "distance", "lorries") else kind


_TEXT_KINDS = {
    "time": "time", "distance": "distance", "length": "length", "lorries": "lorries", "advisory": "advisory",
    "school_limit": "school", "general": "general",
}  # fmt: skip


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
        head = draw_head(label, chance)
        return Face(head, head.shape[1] / head.shape[0])
    choices = orders(label)
    order = choices[int(chance.integers(len(choices)))]
    lettering = letters[str(chance.choice(sorted(letters)))]
    seed = int(chance.integers(0, 1 << 30)) if chance.random() < 0.8 else 0
    text = text_for(order.text, chance)
    picture = draw_lettered(order.country, order.code, lettering, text=text, size_px=112, seed=seed)
    width_m, height_m = face_size_m(order.country, order.code)
    return Face(picture, width_m / height_m)


def drawable() -> tuple[str, ...]:
    """Every class that is drawn from a face (all but ``other``)."""
    return (*SIGNS, *PLATES, *PANELS, *LIGHTS)
