"""gesetze-im-internet.de: `<dokumente>` of `<norm>`, each a section whose paragraphs begin with their number in brackets."""

import re
from collections.abc import Iterator
from typing import TYPE_CHECKING

import msgspec

from services.rules.authoring.statutes.leftovers import unread, whole
from services.rules.authoring.statutes.statute import (
    JOINING,
    Section,
    Statute,
    child,
    first,
    local,
    number,
    numbers,
    words,
)

if TYPE_CHECKING:
    from xml.etree.ElementTree import Element

ROOTS = frozenset({"dokumente"})
_ONE = r"\d{1,3}(?:\s?[a-z](?![\w.]))?"
_PARAGRAPH = re.compile(rf"{numbers(_ONE)}\s*")
_WORD = re.compile(rf"{_ONE}|[,;/–—-]|{JOINING}")
_IN_WORDS = {"u.": "und", "-": "bis", "–": "bis", "—": "bis"}
_ASIDE = frozenset({"metadaten", "fussnoten", "TOC"})
_NOTES = frozenset({"FnR", "Footnotes", "Footnote", "noindex"})


def read(root: "Element") -> Statute:
    """All norms that have a name (`§ 3`, `Anlage 2`) and text."""
    head = first(root, "metadaten")
    title = words(first(root, "langue")) or words(first(root, "kurzue"))
    short = words(child(head, "amtabk")) or words(child(head, "jurabk")) if head is not None else ""
    sections = [part for norm in root if local(norm) == "norm" for part in _norm(norm, short or title)]
    statute = Statute(title=title, short=short or title, language="de", jurisdiction="DEU", sections=tuple(sections))
    return msgspec.structs.replace(statute, left=whole(_repealed(head)) + unread(root, statute, _ASIDE, _NOTES))


def _repealed(head: "Element | None") -> str:
    """What the publisher says on the repeal (`Aufh`) of the statute, its day among the words."""
    states = [at for at in head if local(at) == "standangabe"] if head is not None else []
    return ", ".join(
        words(child(at, "standkommentar")) or "repealed" for at in states if words(child(at, "standtyp")) == "Aufh"
    )


def _norm(norm: "Element", short: str) -> Iterator[Section]:
    head, text = child(norm, "metadaten"), first(norm, "text")
    content = first(text, "Content") if text is not None else None  # foot notes have one too
    name = words(child(head, "enbez")) if head is not None else ""
    if not name or content is None:
        return
    heading = words(child(head, "titel")) if head is not None else ""
    key = number(name) if name.startswith("§") else name
    for numbered, words_of in _paragraphs(content) or [("", "")]:
        yield Section(
            cited=f"{short} {name}" + (f" Abs. {numbered}" if numbered else ""),
            key=f"{key}-{numbered}" if numbered else key,
            text=words_of,
            heading=heading,
        )


def _paragraphs(content: "Element") -> list[tuple[str, str]]:
    """Number (empty: the section has none) and text; what has no number of its own belongs to what is before it."""
    found: list[tuple[str, str]] = []
    for below in content:
        text = words(below, _NOTES)
        match = _PARAGRAPH.match(text)
        if match:
            found.append((_numbered(match.group()), text[match.end() :]))
        elif text and found:
            found[-1] = (found[-1][0], f"{found[-1][1]} {text}")
        elif text:
            found.append(("", text))
    return found


def _numbered(text: str) -> str:
    """`(1 a)` → `1a`, `(2), (3) u. (5)` → `2, 3 und 5`, `(4) - (5)` → `4 bis 5`."""
    said = (each.replace(" ", "") for each in _WORD.findall(text))
    return " ".join(_IN_WORDS.get(each, each) for each in said).replace(" ,", ",")
