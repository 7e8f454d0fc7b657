"""A statute in a publisher's XML, parsed without entities, external references or network: its sections, and the words of an element."""

from collections.abc import Callable, Iterable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import msgspec

from services.rules.authoring.statutes.marks.raised import RAISED, raised
from services.rules.errors import PackError

if TYPE_CHECKING:
    from xml.etree.ElementTree import Element

MAX_BYTES = 50_000_000


class Section(msgspec.Struct, frozen=True, kw_only=True):
    """The smallest part that is cited: a subsection, or a section without any."""

    cited: str
    """`StVO § 3 Abs. 1`"""
    key: str
    """For an id: `3-1`."""
    text: str
    """One line."""
    heading: str = ""
    url: str = ""


class Statute(msgspec.Struct, frozen=True, kw_only=True):
    """What was read."""

    title: str
    short: str
    language: str
    jurisdiction: str
    sections: tuple[Section, ...]
    left: tuple[str, ...] = ()
    """What was left out, and why, in words."""


def parse(path: Path) -> "Element":
    """The root element. Raises PackError for what is no XML, declares entities, or refers to other files."""
    try:
        from defusedxml import DefusedXmlException
        from defusedxml.ElementTree import ParseError, fromstring
    except ModuleNotFoundError:
        raise PackError("importing statutes needs defusedxml: pip install 'drivemcp[rulepack]'") from None
    try:
        if path.stat().st_size > MAX_BYTES:
            raise PackError(f"{path} is larger than {MAX_BYTES // 1_000_000} MB")
        root: Element = fromstring(path.read_bytes(), forbid_entities=True, forbid_external=True)
    except OSError as error:
        raise PackError(f"cannot read {path}: {error.strerror}") from None
    except ParseError as error:
        raise PackError(f"{path}: no well-formed XML: {error}") from None
    except DefusedXmlException as error:
        raise PackError(f"{path}: entities and references to other files are refused: {error}") from None
    except (ValueError, LookupError) as error:  # an encoding that is unknown, or not the text's
        raise PackError(f"{path}: no XML that can be read: {error}") from None
    return root


def local(element: "Element") -> str:
    """A tag without its namespace; empty for comments."""
    return element.tag.rpartition("}")[2] if isinstance(element.tag, str) else ""


def child(element: "Element", *names: str) -> "Element | None":
    """The first child of one of these names."""
    return next((below for below in element if local(below) in names), None)


def first(element: "Element", *names: str) -> "Element | None":
    """The first descendant of one of these names."""
    return next((below for below in element.iter() if local(below) in names), None)


def words(element: "Element | None", without: frozenset[str] = frozenset()) -> str:
    """All text below an element on one line, in its order, without elements of some names. Depth is no matter."""
    todo: list[Element | str] = [] if element is None else [element]
    parts: list[str] = []
    start = -1  # of the raised text that is being read
    while todo:
        at = todo.pop()
        if at == _LOWERED:
            parts[start:], start = [raised("".join(parts[start:]))], -1
            continue
        if isinstance(at, str):
            parts.append(at)
            continue
        name = local(at)
        if not name or name in without:
            continue
        before, after = ("(", ") ") if name == "Pnumber" else (" ", " ") if name in BLOCKS else ("", "")
        own = at.text or ("−" if at.get("Name") == "Minus" else " " if name == "Character" else "")
        if name in RAISED and start < 0:
            start, after = len(parts), _LOWERED
        inside: list[Element | str] = [before, own]
        for below in at:
            inside += [below, below.tail or ""]
        todo += reversed([*inside, after])
    return " ".join("".join(parts).split())


def around(
    items: Iterable["Element"], is_part: Callable[["Element"], bool], without: frozenset[str]
) -> tuple[str, str]:
    """(lead-in, tail): the words before the first part, and those between and behind the parts."""
    before: list[str] = []
    behind: list[str] = []
    told = before
    for at in items:
        if is_part(at):
            told = behind
        else:
            told.append(words(at, without))
    return " ".join(filter(None, before)), " ".join(filter(None, behind))


def number(text: str) -> str:
    """`(1a)`, `1a.`, `§ 3` → the number alone."""
    return " ".join(text.replace("§", " ").split()).strip(" ().")


def numbers(one: str) -> str:
    """The pattern of a number in brackets, or of several: `(2)`, `(2) bis (4)`, `(2), (3) u. (5)`, `(2, 3)`."""
    some = rf"{one}(?:(?:\s*[,;/–—-]\s*|\s+(?:{JOINING})\s+){one})*"
    return rf"\(\s*{some}\s*\)(?:\s*(?:[,;/–—-]|{JOINING})\s*\(\s*{some}\s*\))*"


def walked(root: "Element", skipped: frozenset[str]) -> "Iterator[Element]":
    """Every element in the document's order, without what lies below those of some names."""
    todo = [root]
    while todo:
        at = todo.pop()
        if local(at) and local(at) not in skipped:
            yield at
            todo += reversed(at)


JOINING = r"bis|und|u\.|sowie"
"""German words between the numbers of paragraphs."""
_LOWERED = "\0"
"""Stands where raised text ends; no XML has it."""
BLOCKS = frozenset(
    {"P", "DL", "DT", "DD", "LA", "BR", "row", "entry", "Text", "Title", "Number", "P3", "P4", "P5", "ListItem", "Para",
     "p", "num", "heading", "intro", "content", "wrapUp", "list", "point", "paragraph", "subparagraph", "item", "li", "tr", "td", "th",
     "br", "eol", "listIntroduction", "listConclusion"}
)  # fmt: skip
"""Elements that stand apart from what is before and behind them."""
