"""What of an Act of legislation.gov.uk counts for a part of the country, or is repealed for some cases: kept, marked and told."""

from typing import TYPE_CHECKING

from services.rules.authoring.statutes.statute import local, walked

if TYPE_CHECKING:
    from xml.etree.ElementTree import Element

_CHANGES = {"Addition": "{extent}", "Substitution": "{extent}", "Repeal": "repealed: {extent}"}
"""How the text behind a change tells the part of the country for which alone the change was made (`S`, `E+W`)."""
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
    """Rename each repeal whose text is retained, write a change's extent behind the change, and tell the places of both."""
    places, extents = inherited(root, "id"), inherited(root, "RestrictExtent")
    labels = {id(below) for at in root.iter() if local(at) in _LABELS for below in at.iter()}
    told = dict[str, None]()
    for at in walked(root, aside):
        is_repeal = local(at) == "Repeal"
        if local(at) not in _CHANGES or (is_repeal and not _is_retained(at)):
            continue
        extent = at.get("Extent", "")
        said = _CHANGES[local(at)].format(extent=extent) if extent and extent != extents[id(at)] else ""
        if said and id(at) not in labels:
            _remark(at, said)
        if is_repeal:
            at.tag = _KEPT
        if said or is_repeal:
            told[f"{places[id(at)] or 'a provision without an id'} ({said or 'repealed for some cases'})"] = None
    return (f"of a part of the country or of some cases only, drafted all the same: {', '.join(told)}",) if told else ()


def _is_retained(at: "Element") -> bool:
    return at.get("RetainText", "").lower() in ("true", "1")


def _remark(at: "Element", said: str) -> None:
    """Write a remark behind an element: `30 (E+W) 20 (S) mph`."""
    tail = at.tail or ""
    at.tail = f" ({said}){'' if tail and not tail[0].isalnum() else ' '}{tail}"
