"""On what evidence the country changed: codes of signs with their weights, as the front end states them; told in words.

Text from outside: it is taken item by item in a closed form, or not at all.
"""

import re
from typing import NamedTuple

MOST = 6
_ITEM = re.compile(r"(?P<code>[a-z_]{1,24}(?::[A-Za-z0-9_]{1,12}){0,2})(?: (?P<weight>[0-9]{1,2}\.[0-9]))?")
_WORDS: dict[str, str] = {
    "border": "border", "position": "position",
    "town_entry": "town", "town_exit": "town", "plate:when_wet": "language", "info:units": "units",
    "info:side": "side", "keep_left": "side", "keep_right": "side", "oncoming": "side", "limit:": "number", "zone:": "number",
    "led:": "number", "limit_board": "style", "school_limit": "style", "general": "style", "national": "style", "school": "style",
    "plate:advisory": "style", "info:interstate": "style", "all_end": "style", "limit_end": "style", "priority_road": "style",
    "no_overtaking_end": "style", "diamond": "style",
}  # fmt: skip
"""How a code begins, to the word in the table `evidence` of the phrases; the first that fits."""


class Item(NamedTuple):
    """One code, and how much it weighed in log-odds; None where that was not stated."""

    code: str
    weight: float | None

    @property
    def word(self) -> str:
        """Its word in the phrases; empty: no code of ours."""
        return next((word for head, word in _WORDS.items() if self.code.startswith(head)), "")


def items(text: str) -> tuple[Item, ...]:
    """The items of a text; none unless all of it is of the form, and every code one of ours."""
    found = [_ITEM.fullmatch(part) for part in text.split(", ")[: MOST + 1]]
    read = [Item(each["code"], float(each["weight"]) if each["weight"] else None) for each in found if each]
    return tuple(read) if len(found) == len(read) <= MOST and all(item.word for item in read) else ()


def kept(text: str) -> str:
    """The text, if it is evidence."""
    return text if items(text) else ""
