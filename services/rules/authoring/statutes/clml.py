"""legislation.gov.uk: `<Legislation>`, whose provisions are `<P1>` with subsections `<P2>`."""

import re
from collections.abc import Iterator
from typing import TYPE_CHECKING

from services.rules.authoring.statutes.statute import Section, Statute, child, first, local, number, walked, words

if TYPE_CHECKING:
    from xml.etree.ElementTree import Element

ROOTS = frozenset({"Legislation"})
_PLACE = re.compile(
    r"(?:schedule(?:-(?P<schedule>[^-]+))?-)?(?P<kind>section|regulation|article|rule|paragraph)-(?P<number>[^-]+)"
)
_CITED = {"section": "s.", "regulation": "reg.", "article": "art.", "rule": "r.", "paragraph": "para."}
_ASIDE = frozenset({"BlockAmendment", "Contents", "Commentaries", "Versions", "Resources", "Metadata", "Footnotes"})
"""Text quoted into other Acts, and what is not the Act's."""
_DROPPED = frozenset({"CommentaryRef", "FootnoteRef", "MarginNoteRef", "Repeal", "Title"})


def read(root: "Element") -> Statute:
    """All provisions with text; what is marked as repealed is left out."""
    title = words(first(root, "title"))
    language = words(first(root, "language"))[:2].lower() or "en"
    sections = list[Section]()
    heading = ""
    for at in walked(root, _ASIDE):
        if local(at) == "P1group":
            heading = words(child(at, "Title"), frozenset({"CommentaryRef"}))
        elif local(at) == "P1":
            sections += _provision(at, title, heading)
    return Statute(title=title, short=title, language=language, jurisdiction="GBR", sections=tuple(sections))


def _provision(p1: "Element", title: str, heading: str) -> Iterator[Section]:
    own = number(words(child(p1, "Pnumber")))
    label, schedule, key = _placed(p1, own)
    subsections = [at for at in walked(p1, _ASIDE) if local(at) == "P2"]
    for at in subsections or [p1]:
        numbered = number(words(child(at, "Pnumber"))) if at is not p1 else ""
        text = " ".join(words(below, _DROPPED) for below in at if local(below) != "Pnumber").strip()
        if text.strip(" ."):
            yield Section(
                cited=f"{title} {schedule}{label} {own}" + (f"({numbered})" if numbered else ""),
                key=f"{key}-{numbered}" if numbered else key,
                text=text,
                heading=heading,
                url=_address(at.get("DocumentURI") or p1.get("DocumentURI") or ""),
            )


def _placed(p1: "Element", own: str) -> tuple[str, str, str]:
    """How a provision is cited: its label, its schedule where it is in one, and its key."""
    place = _PLACE.match(p1.get("id", ""))
    if place is None:
        return "s.", "", own
    label, named = _CITED[place["kind"]], place["schedule"] or ""
    if not p1.get("id", "").startswith("sch"):
        return label, "", own
    return label, f"Sch. {named} ".replace("  ", " "), f"sch{named}-{own}"


def _address(text: str) -> str:
    return re.sub(r"^http:", "https:", text) if text.startswith(("http://", "https://")) else ""
