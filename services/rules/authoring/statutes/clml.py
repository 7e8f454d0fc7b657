"""legislation.gov.uk: `<Legislation>`, whose provisions are `<P1>` with subsections `<P2>`."""

import re
from collections.abc import Iterator
from datetime import UTC, datetime
from typing import TYPE_CHECKING

import msgspec

from services.rules.authoring.statutes.extents import inherited, keep_partial
from services.rules.authoring.statutes.languages import language_of
from services.rules.authoring.statutes.leftovers import counted, excerpt, in_force, over, unread
from services.rules.authoring.statutes.statute import (
    Section,
    Statute,
    around,
    child,
    first,
    local,
    number,
    walked,
    words,
)

if TYPE_CHECKING:
    from xml.etree.ElementTree import Element

ROOTS = frozenset({"Legislation"})
_PLACE = re.compile(
    r"(?:schedule(?:-(?!part|chapter|paragraph)(?P<schedule>[^-]+))?-)?(?:(?:part|chapter)-[^-]+-)*"
    r"(?P<kind>section|regulation|article|rule|paragraph)-(?P<number>[^-]+)"
)
_CITED = {"section": "s.", "regulation": "reg.", "article": "art.", "rule": "r.", "paragraph": "para."}
_ASIDE = frozenset({"BlockAmendment", "Contents", "Commentaries", "Versions", "Resources", "Metadata", "Footnotes"})
"""Text quoted into other Acts, and what is not the Act's."""
_GONE = frozenset({"Repealed", "Prospective", "Removed", "Revoked", "Dead"})
_DROPPED = frozenset({"CommentaryRef", "FootnoteRef", "MarginNoteRef", "Repeal", "Title"})


def read(root: "Element") -> Statute:
    """All provisions with text that are in force."""
    title = words(first(root, "title"))
    language, told = language_of(words(first(root, "language")))
    left = told + in_force(root, _out_of_force)
    left += _versions(root) + keep_partial(root, _ASIDE - {"BlockAmendment"})
    sections = list[Section]()
    headings: dict[int, str] = {}
    for at in walked(root, _ASIDE):
        if local(at) == "P1group":
            heading = words(child(at, "Title"), _DROPPED - {"Title"})
            headings |= {id(below): heading for below in at.iter() if local(below) == "P1"}
        elif local(at) == "P1":
            sections += _provision(at, title, headings.get(id(at), ""))
        elif local(at) == "Schedule":
            sections += _schedule(at, title)
    statute = Statute(title=title, short=title, language=language, jurisdiction="GBR", sections=tuple(sections))
    beside = _DROPPED | {"IntroductoryText", "SignedSection", "ExplanatoryNotes", "EarlierOrders"}
    return msgspec.structs.replace(statute, left=left + _of_a_part(root) + unread(root, statute, _ASIDE, beside))


def _versions(root: "Element") -> tuple[str, ...]:
    """Other versions of provisions, mostly of another part of the country; a version without words is a picture of what is read."""
    versions = [at for at in root.iter() if local(at) == "Version" and words(at)]
    found = [
        f"{_inside(at, 'id')} {excerpt(words(at))} ({_inside(at, 'RestrictExtent') or 'no extent'})" for at in versions
    ]
    return (f"other versions of provisions, left out: {counted(found)}",) if found else ()


def _inside(at: "Element", attribute: str) -> str:
    """The attribute of the first part that has it, or else the element's own."""
    return next((value for below in [*list(at.iter())[1:], at] if (value := below.get(attribute))), "")


def _of_a_part(root: "Element") -> tuple[str, ...]:
    """What does not extend to England: it is drafted, and its author has to say where it counts."""
    placed = [at for at in walked(root, _ASIDE) if local(at) == "P1" or _beside(at)]
    extent_of = inherited(root, "RestrictExtent")
    extents = ((at.get("id") or words(child(at, "Pnumber", "Number")), extent_of[id(at)]) for at in placed)
    found = [f"{name} ({extent})" for name, extent in extents if extent and "E" not in extent.split("+")]
    return (f"does not extend to England, drafted all the same: {', '.join(found)}",) if found else ()


def _out_of_force(at: "Element") -> str:
    """By its status, or by the dates between which this version of it is in force."""
    today = datetime.now(UTC).date()
    if at.get("Status", "") in _GONE:
        return at.get("Status", "").lower()
    if (start := at.get("RestrictStartDate", "")) and not over(start, today):
        return f"from {start}"
    end = at.get("RestrictEndDate", "")
    return f"until {end}" if end and over(end, today) else ""


def _schedule(at: "Element", title: str) -> Iterator[Section]:
    """What of a schedule stands in no numbered paragraph, such as a table; the paragraphs have their own turn."""
    named = words(child(at, "Number")) or "Schedule"
    if text := _beside(at):
        heading = words(first(at, "Title"))
        yield Section(
            cited=f"{title} {named}", key=named, text=text, heading=heading, url=_address(at.get("DocumentURI") or "")
        )


def _beside(schedule: "Element") -> str:
    """The words of the largest parts of a schedule without a numbered paragraph; none of any other element."""
    todo = list(reversed(schedule)) if local(schedule) == "Schedule" else []
    found: list[str] = []
    while todo:
        at = todo.pop()
        if any(local(below) == "P1" for below in walked(at, _ASIDE)):
            todo += reversed(at) if local(at) != "P1" else ()
        elif local(at) not in ("Number", "TitleBlock", "Reference"):
            found.append(words(at, _DROPPED))
    text = " ".join(filter(None, found))
    return text if text.strip(" .") else ""


def _provision(p1: "Element", title: str, heading: str) -> Iterator[Section]:
    own = number(words(child(p1, "Pnumber")))
    label, schedule, key = _placed(p1, own)
    subsections = [at for at in walked(p1, _ASIDE) if local(at) == "P2"]
    inside = [below for at in p1 for below in (at if local(at) == "P1para" else [at]) if local(below) != "Pnumber"]
    lead, tail = (
        around(inside, lambda at: any(local(below) == "P2" for below in at.iter()), _DROPPED)
        if subsections
        else ("", "")
    )
    for at in subsections or [p1]:
        numbered = number(words(child(at, "Pnumber"))) if at is not p1 else ""
        text = " ".join(words(below, _DROPPED) for below in at if local(below) != "Pnumber").strip()
        yield Section(
            cited=f"{title} {schedule}{label} {own}" + (f"({numbered})" if numbered else ""),
            key=f"{key}-{numbered}" if numbered else key,
            text=" ".join(filter(None, (lead, text, tail))) if text.strip(" .") else "",
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
