"""Ordered lists whose numbers stand in attributes alone: each number is written before its item."""

from collections.abc import Callable
from typing import TYPE_CHECKING

from services.rules.authoring.statutes.statute import local

if TYPE_CHECKING:
    from xml.etree.ElementTree import Element

_LISTS = {"OrderedList": "ListItem", "ol": "li"}
"""Lists of legislation.gov.uk and of XHTML, and their items."""
_ROMAN = ((100, "c"), (90, "xc"), (50, "l"), (40, "xl"), (10, "x"), (9, "ix"), (5, "v"), (4, "iv"), (1, "i"))


def _roman(count: int) -> str:
    return next((sign + _roman(count - size) for size, sign in _ROMAN if size <= count), "")


def _letters(count: int) -> str:
    """`a` to `z`, then `aa`, `bb`, as laws go on."""
    turns, place = divmod(count - 1, 26)
    return "abcdefghijklmnopqrstuvwxyz"[place] * (turns + 1)


_NUMERALS: dict[str, Callable[[int], str]] = {
    "alpha": _letters, "a": _letters, "alphaupper": lambda count: _letters(count).upper(), "A": lambda count: _letters(count).upper(),
    "roman": _roman, "i": _roman, "romanupper": lambda count: _roman(count).upper(), "I": lambda count: _roman(count).upper(),
}  # fmt: skip
"""How a list counts by its type; any other counts 1, 2, 3."""
_DECORATED = {
    "parens": "({})", "parenRight": "{})", "brackets": "[{}]", "bracketRight": "{}]", "period": "{}.", "colon": "{}:", "none": "{}",
}  # fmt: skip
"""How a list writes its numbers; one that does not say so writes `1.`."""


_MOST = 400
"""Items of a list that are counted in letters or Roman numerals; what comes behind them is counted 401, 402."""


def number_lists(root: "Element") -> None:
    """Write the number of each item before the item's text, unless the text begins with it."""
    for at in root.iter():
        count = _count(at.get("start", ""), 1)
        for item in (below for below in at if local(below) == _LISTS.get(local(at))):
            count = _count(item.get("value", ""), count)
            number = _numbered(at, item, count)
            said = next((text for text in item.itertext() if text.strip()), "").lstrip()
            item.text = f"{'' if said.startswith(number) else number} {item.text or ''}"
            count += 1


def _numbered(at: "Element", item: "Element", count: int) -> str:
    own = item.get("NumberOverride", "")
    if own and not own.isalnum():
        return own  # with its decoration
    numeral = _NUMERALS.get(at.get("Type", "") or at.get("type", ""), str) if count <= _MOST else str
    return _DECORATED.get(at.get("Decoration", ""), "{}.").format(own or numeral(count))


def _count(text: str, otherwise: int) -> int:
    return int(text) if text.isascii() and text.isdecimal() and 0 < len(text) < 4 and int(text) else otherwise
