"""Where two records differ, field by field."""

from collections.abc import Iterator
from typing import Any

import msgspec

_SHOWN = 80


class Difference(msgspec.Struct, frozen=True, kw_only=True):
    """One field: as logged, and as decided again."""

    field: str
    logged: str
    again: str

    def __str__(self) -> str:
        return f"{self.field}: {self.logged} -> {self.again}"


def differences(name: str, logged: Any, again: Any) -> Iterator[Difference]:
    """Every leaf that differs; numbers to the last bit."""
    yield from _walk(name, msgspec.to_builtins(logged), msgspec.to_builtins(again))


def _walk(name: str, logged: Any, again: Any) -> Iterator[Difference]:
    if isinstance(logged, dict) and isinstance(again, dict):
        for key in dict.fromkeys((*logged, *again)):
            yield from _walk(f"{name}.{key}", logged.get(key), again.get(key))
    elif isinstance(logged, list | tuple) and isinstance(again, list | tuple) and len(logged) == len(again):
        for i, (one, other) in enumerate(zip(logged, again, strict=True)):
            yield from _walk(f"{name}[{i}]", one, other)
    elif type(logged) is not type(again) or logged != again:
        yield Difference(field=name, logged=_short(logged, again), again=_short(again, logged))


def _short(value: Any, other: Any) -> str:
    """The value, of a long text the part around the first character that differs."""
    text, beside = (msgspec.json.encode(each).decode() for each in (value, other))
    if len(text) <= _SHOWN:
        return text
    same = next((at for at, (one, two) in enumerate(zip(text, beside, strict=False)) if one != two), len(beside))
    start = max(0, same - _SHOWN // 4)
    shown = text[start : start + _SHOWN - 3]
    return ("..." if start else "") + shown + ("..." if start + len(shown) < len(text) else "")
