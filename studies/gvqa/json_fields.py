"""Taking a JSON value apart, field by field, so that what is wrong is named with its place."""

import math
from collections.abc import Mapping
from typing import Any

from services.drivelm.vocabulary.text import cleaned

FARTHEST_PX = 1e6


class UnreadableGraph(ValueError):
    """The JSON is not DriveLM's format; the message names the field and what is wrong with it, in one line."""

    def __init__(self, message: str) -> None:
        super().__init__(cleaned(message, 300))


def field(row: Mapping[str, Any], name: str, where: str) -> tuple[Any, str]:
    """A field's value and its place. Raises ``UnreadableGraph`` where it is absent."""
    if name not in row:
        raise UnreadableGraph(f"{where}.{name}: absent")
    return row[name], f"{where}.{name}"


def as_object(value: Any, where: str) -> dict[str, Any]:
    """A JSON object."""
    if not isinstance(value, dict):
        raise UnreadableGraph(f"{where}: expected an object, found {_kind(value)}")
    return value


def as_list(value: Any, where: str) -> list[Any]:
    """A JSON array."""
    if not isinstance(value, list):
        raise UnreadableGraph(f"{where}: expected a list, found {_kind(value)}")
    return value


def as_text(value: Any, where: str, null: str | None = None) -> str:
    """A string; ``null`` stands for null, where it is given."""
    if value is None and null is not None:
        return null
    if not isinstance(value, str):
        raise UnreadableGraph(f"{where}: expected text, found {_kind(value)}")
    return value


def as_box(value: Any, where: str) -> tuple[float, float, float, float]:
    """Left, top, right and bottom in pixels."""
    numbers = as_list(value, where)
    if len(numbers) != 4 or not all(_is_pixel(number) for number in numbers):
        raise UnreadableGraph(f"{where}: expected four finite pixel coordinates, found {numbers!r:.80}")
    x0, y0, x1, y1 = (float(number) for number in numbers)
    return x0, y0, x1, y1


def _is_pixel(value: Any) -> bool:
    is_number = isinstance(value, int | float) and not isinstance(value, bool)
    return is_number and abs(value) <= FARTHEST_PX and math.isfinite(value)


def _kind(value: Any) -> str:
    names = {type(None): "null", bool: "a truth value", str: "text", list: "a list", dict: "an object"}
    return names.get(type(value), "a number")
