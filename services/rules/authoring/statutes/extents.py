"""What of an Act of legislation.gov.uk counts for a part of the country, or is repealed for some cases: kept, marked and told."""

from typing import TYPE_CHECKING

from services.rules.authoring.statutes.statute import local, walked

if TYPE_CHECKING:
    from xml.etree.ElementTree import Element

_CHANGES = frozenset({"Addition", "Substitution", "Repeal"})
_LABELS = frozenset({"Pnumber", "Number", "Title"})
"""Elements whose words take no remark: numbers and headings."""
_KEPT = "RetainedRepeal"


def inherited(root: "Element", attribute: str) -> dict[int, str]:
    """The attribute of each element, by the element's identity: its own, or that of what holds it."""
    found = {id(root): root.get(attribute, "")}
    for at in root.iter():
        found |= {id(below): below.get(attribute) or found[id(at)] for below in at}
    return found


def keep_partial(root: "Element", aside: frozenset[str]) -> tuple[str, ...]:
    """Rename each repeal whose text is retained, write behind a change for what it is made, and tell the places of both."""
    places, extents = inherited(root, "id"), inherited(root, "RestrictExtent")
    labels = {id(below) for at in root.iter() if local(at) in _LABELS for below in at.iter()}
    told = dict[str, None]()
    for at in walked(root, aside):
        said = _made_for(at, extents[id(at)]) if local(at) in _CHANGES else ""
        if not said:
            continue
        if id(at) not in labels:
            _remark(at, said)
        if local(at) == "Repeal":
            at.tag = _KEPT
        told[f"{places[id(at)] or 'a provision without an id'} ({said})"] = None
    return (f"of a part of the country or of some cases only, drafted all the same: {', '.join(told)}",) if told else ()


def _made_for(at: "Element", provisions: str) -> str:
    """For which part of the country (`S`, `E+W`) or cases alone a change is made; empty: for all of its provision, or its text is gone."""
    extent = at.get("Extent", "")
    if local(at) != "Repeal":
        return extent if extent != provisions else ""
    if at.get("RetainText", "").lower() not in ("true", "1"):
        return ""
    return f"repealed: {extent}" if extent else "repealed for some cases"


def _remark(at: "Element", said: str) -> None:
    """Write a remark behind an element: `30 (E+W) 20 (S) mph`."""
    tail = at.tail or ""
    at.tail = f" ({said}){'' if tail and not tail[0].isalnum() else ' '}{tail}"
