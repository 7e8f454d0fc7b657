"""gesetze-im-internet.de: `<dokumente>` of `<norm>`, each a section whose paragraphs begin with their number in brackets."""

import re
from collections.abc import Iterator
from typing import TYPE_CHECKING

import msgspec

from services.rules.authoring.statutes.leftovers import unread
from services.rules.authoring.statutes.statute import Section, Statute, child, first, local, number, words

if TYPE_CHECKING:
    from xml.etree.ElementTree import Element

ROOTS = frozenset({"dokumente"})
_PARAGRAPH = re.compile(r"\((\d+[a-z]?)\)\s*")
_GONE = re.compile(r"\(?(weggefallen|aufgehoben)\)?\.?", re.I)
_ASIDE = frozenset({"metadaten", "fussnoten", "TOC"})
_NOTES = frozenset({"FnR", "Footnotes", "Footnote", "noindex"})


def read(root: "Element") -> Statute:
    """All norms that have a name (`§ 3`, `Anlage 2`) and text."""
    head = first(root, "metadaten")
    title = words(first(root, "langue")) or words(first(root, "kurzue"))
    short = words(child(head, "amtabk")) or words(child(head, "jurabk")) if head is not None else ""
    sections = [part for norm in root if local(norm) == "norm" for part in _norm(norm, short or title)]
    statute = Statute(title=title, short=short or title, language="de", jurisdiction="DEU", sections=tuple(sections))
    gone = [section.cited for section in sections if _GONE.fullmatch(section.text)]
    kept = tuple(section for section in sections if section.cited not in gone)
    told = (f"not in force, left out: {', '.join(gone)}",) if gone else ()
    return msgspec.structs.replace(statute, sections=kept, left=told + unread(root, statute, _ASIDE, _NOTES))


def _norm(norm: "Element", short: str) -> Iterator[Section]:
    head, content = child(norm, "metadaten"), first(norm, "Content")
    name = words(child(head, "enbez")) if head is not None else ""
    if not name or content is None:
        return
    heading = words(child(head, "titel")) if head is not None else ""
    key = number(name) if name.startswith("§") else name
    for numbered, text in _paragraphs(content):
        yield Section(
            cited=f"{short} {name}" + (f" Abs. {numbered}" if numbered else ""),
            key=f"{key}-{numbered}" if numbered else key,
            text=text,
            heading=heading,
        )


def _paragraphs(content: "Element") -> Iterator[tuple[str, str]]:
    """Number (empty: the section has none) and text; what has no number of its own belongs to what is before it."""
    found: list[tuple[str, str]] = []
    for below in content:
        text = words(below, _NOTES)
        match = _PARAGRAPH.match(text)
        if match:
            found.append((match[1], text[match.end() :]))
        elif text and found:
            found[-1] = (found[-1][0], f"{found[-1][1]} {text}")
        elif text:
            found.append(("", text))
    yield from ((numbered, text) for numbered, text in found if text.strip(" -–"))
