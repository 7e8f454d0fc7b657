"""Every way in which the reader's classes look: in which country, by which code, and with what kind of text.

The reader learns from faces drawn by it, and modelled sensors find by it the class of a face.
"""

from functools import cached_property
from typing import NamedTuple

from services.drivelm.vocabulary.classes import LIMIT_VALUES, OTHER, PANELS, PLATES, READER_CLASSES, SIGNS
from services.simulator.signart.catalogue import CODES, COUNTRIES

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
    """What kind of text (see `training.sign_pictures.texts`) a class carries in a country."""
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


class Classes:
    """Looks faces up; `code` is `COUNTRY CODE` as `sight.Thing` has it."""

    @cached_property
    def _table(self) -> dict[str, str]:
        table: dict[str, str] = {}
        for name in (*SIGNS, *PLATES):
            for order in orders(name):
                table.setdefault(f"{order.country} {order.code}", name)
        return table

    def label(self, code: str) -> str:
        """The class; `other` for what the reader does not read."""
        bare = code.partition(" ")[2]
        if bare.startswith(("led:", "light:")):
            return bare if bare in READER_CLASSES else OTHER
        return self._table.get(code, OTHER) if f"led:{bare}" not in PANELS else self._table.get(code, f"led:{bare}")


CLASSES = Classes()
