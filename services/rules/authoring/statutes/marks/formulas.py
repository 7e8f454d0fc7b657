"""Formulas of a statute (MathML) on one line: `(V^2)/20`; a formula with what has no such form is not read, and both are told."""

import re
from collections.abc import Iterable, Iterator
from typing import TYPE_CHECKING

from services.rules.authoring.statutes.statute import Section, local

if TYPE_CHECKING:
    from xml.etree.ElementTree import Element

MAX_DEPTH = 40
"""Levels of a formula: 40 is beyond any that was printed, and far from the interpreter's own limit."""
UNREAD = "(formula)"
_TOKENS = frozenset({"mi", "mn", "mo", "mtext", "ms", "mspace"})
_ROWS = frozenset({"math", "mrow", "mstyle", "mpadded", "semantics", "mfenced", "msqrt"})
_FORMS = {"mfrac": "{}/{}", "msup": "{}^{}", "msub": "{}_{}", "msubsup": "{}_{}^{}"}
"""How an element writes its parts, each in brackets unless it is a single word."""
_NOTES = frozenset({"annotation", "annotation-xml"})
_INVISIBLE = str.maketrans({"\u2061": " ", "\u2062": "·", "\u2063": ",", "\u2064": "+"})
"""Operators of MathML that print nothing: application, times, separator, plus."""


def write_formulas(root: "Element") -> tuple[str, ...]:
    """Put each formula's line in the place of its elements, and return those lines."""
    found = tuple(at for at in root.iter() if local(at) == "math")
    lines = tuple(_written(at) if _is_readable(at) else UNREAD for at in found)
    for at, line in zip(found, lines, strict=True):
        del at[:]
        at.text = f" {line} "
    return lines


def told(lines: Iterable[str], sections: Iterable[Section]) -> tuple[str, ...]:
    """Where formulas stand that are to be checked, and those that were not read; a single word is no formula."""
    worth = [line for line in dict.fromkeys(lines) if " " in line or "/" in line or "^" in line or line == UNREAD]
    placed = [(each.cited, line) for each in sections for line in worth if line in each.text]
    unread = ", ".join(cited for cited, line in placed if line == UNREAD)
    written = ", ".join(f"{cited} {line!r}" for cited, line in placed if line != UNREAD)
    said = (("formulas, not read", unread), ("formulas on one line, to be checked with the official text", written))
    return tuple(f"{what}: {where}" for what, where in said if where)


def _parts(at: "Element") -> list["Element"]:
    return [below for below in at if local(below) not in _NOTES]


def _is_readable(math: "Element") -> bool:
    """Whether every part has a form, and none lies deeper than MAX_DEPTH."""
    level = [math]
    for _ in range(MAX_DEPTH):
        if not all(_has_form(at) for at in level):
            return False
        level = [below for at in level for below in _parts(at)]
        if not level:
            return True
    return False


def _has_form(at: "Element") -> bool:
    name, count = local(at), len(_parts(at))
    if name in _FORMS:
        return count == _FORMS[name].count("{}") and not at.get("linethickness", "").startswith("0")
    return name in _ROWS or (name in _TOKENS and not count)


def _written(at: "Element") -> str:
    name, parts = local(at), _parts(at)
    if name in _TOKENS:
        return " ".join((at.text or "").translate(_INVISIBLE).split())
    if name in _FORMS:
        return _FORMS[name].format(*map(_grouped, parts))
    if name == "mfenced":
        return f"{at.get('open', '(')}{', '.join(map(_written, parts))}{at.get('close', ')')}"
    row = re.sub(r"(?<=[(\[])\s+|\s+(?=[)\],;])", "", " ".join(_in_row(parts)))
    return f"√({row})" if name == "msqrt" else row


def _in_row(parts: list["Element"]) -> Iterator[str]:
    """A fraction beside a factor stands in brackets: half of v, and not one by twice v."""
    for place, each in enumerate(parts):
        line = _written(each)
        beside = parts[place - 1 : place] if place else []
        is_fraction = local(_alone(each)) == "mfrac"
        yield f"({line})" if is_fraction and any(map(_binds, beside + parts[place + 1 : place + 2])) else line


def _binds(at: "Element") -> bool:
    """A factor, or a sign of division."""
    return local(at) != "mo" or _written(at) in ("/", "÷", ":")


def _alone(at: "Element") -> "Element":
    """What a row holds, where it holds one part."""
    while local(at) in _ROWS - {"mfenced", "msqrt"} and len(_parts(at)) == 1:
        (at,) = _parts(at)
    return at


def _grouped(at: "Element") -> str:
    """In brackets, unless it is a word or has brackets of its own."""
    line = _written(at)
    is_word = local(_alone(at)) in _TOKENS and " " not in line
    return line if is_word or _has_brackets(line) else f"({line})"


def _has_brackets(line: str) -> bool:
    """Whether its first bracket closes at its end."""
    depth = 0
    for place, each in enumerate(line, 1):
        depth += (each == "(") - (each == ")")
        if depth <= 0:
            return place == len(line) and line.startswith("(") and depth == 0
    return False
