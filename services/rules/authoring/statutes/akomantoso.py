"""Akoma Ntoso 3.0: `<section>` or `<article>` with `<subsection>` or `<paragraph>`."""

from collections.abc import Iterator
from typing import TYPE_CHECKING

from services.rules.authoring.statutes.statute import Section, Statute, child, first, local, number, walked, words
from services.rules.book import normal_jurisdiction

if TYPE_CHECKING:
    from xml.etree.ElementTree import Element

ROOTS = frozenset({"akomaNtoso"})
_WHOLE = {"section": "s.", "article": "art.", "rule": "r.", "regulation": "reg."}
_PARTS = frozenset({"subsection", "paragraph", "clause"})
_ASIDE = frozenset({"meta", "quotedStructure", "embeddedStructure", "toc", "attachments"})
_DROPPED = frozenset({"noteRef", "authorialNote", "remark", "del", "num", "heading"})
_LANGUAGES = {
    "eng": "en",
    "deu": "de",
    "ger": "de",
    "fra": "fr",
    "fre": "fr",
    "nld": "nl",
    "pol": "pl",
    "ita": "it",
    "spa": "es",
}


def read(root: "Element") -> Statute:
    """All sections with text."""
    title = words(first(root, "docTitle")) or words(first(root, "shortTitle")) or _value(root, "FRBRalias", "value")
    language = _value(root, "FRBRlanguage", "language").lower()
    country = normal_jurisdiction(_value(root, "FRBRcountry", "value")[:2]) or ""
    address = next(
        (uri for name in ("FRBRuri", "FRBRthis") if (uri := _value(root, name, "value")).startswith("http")), ""
    )
    sections = [part for at in walked(root, _ASIDE) if _kind(at) in _WHOLE for part in _section(at, title, address)]
    return Statute(
        title=title,
        short=title,
        language=_LANGUAGES.get(language, language[:2]) or "en",
        jurisdiction=country if len(country) == 3 else "",
        sections=tuple(sections),
    )


def _section(at: "Element", title: str, address: str) -> Iterator[Section]:
    named = words(child(at, "num"))
    own, heading = number(named.lower().removeprefix("article").removeprefix("art.")), words(child(at, "heading"))
    cited = f"§ {own}" if "§" in named else f"{_WHOLE[_kind(at)]} {own}"
    parts = [below for below in at if local(below) in _PARTS]
    for part in parts or [at]:
        numbered = number(words(child(part, "num"))) if part is not at else ""
        mark = f" Abs. {numbered}" if "§" in named else f"({numbered})"
        text = _text(part)
        if text:
            yield Section(
                cited=f"{title} {cited}" + (mark if numbered else ""),
                key=f"{own}-{numbered}" if numbered else own,
                text=text,
                heading=heading,
                url=address,
            )


def _text(part: "Element") -> str:
    """Without the part's own number and heading; numbers of points stay."""
    inside = [below for below in part if local(below) not in ("num", "heading", "subheading")]
    return " ".join(words(below, _DROPPED - {"num"}) for below in inside).strip()


def _kind(at: "Element") -> str:
    return at.get("name", "") if local(at) == "hcontainer" else local(at)


def _value(root: "Element", name: str, attribute: str) -> str:
    found = first(root, name)
    return found.get(attribute, "") if found is not None else ""
