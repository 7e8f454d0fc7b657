"""Akoma Ntoso 3.0: `<section>` or `<article>` with `<subsection>` or `<paragraph>`."""

import re
from collections import Counter
from collections.abc import Callable, Iterator
from datetime import UTC, date, datetime
from typing import TYPE_CHECKING

import msgspec

from services.rules.authoring.statutes.languages import language_of
from services.rules.authoring.statutes.leftovers import in_force, over, unread
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
from services.rules.book import normal_jurisdiction

if TYPE_CHECKING:
    from xml.etree.ElementTree import Element

ROOTS = frozenset({"akomaNtoso"})
_WHOLE = {"section": "s.", "article": "art.", "rule": "r.", "regulation": "reg."}
_PARTS = frozenset({"subsection", "paragraph", "clause"})
_ASIDE = frozenset({"meta", "preface", "preamble", "conclusions", "quotedStructure", "embeddedStructure", "toc"})
_SCHEDULES = frozenset({"schedule", "annex", "appendix", "attachment"})
_GONE = frozenset(
    {
        "removed",
        "repealed",
        "revoked",
        "annulled",
        "expired",
        "spent",
        "suspended",
        "ignored",
        "prospective",
        "proposed",
        "notinforce",
    }
)
_NOTES = frozenset({"noteRef", "authorialNote", "remark", "del"})
_DROPPED = _NOTES | {"num", "heading", "subheading", "crossHeading"}
_HOLDS = frozenset({"p", "td", "th", "li"})
"""What holds the text of a schedule without sections."""
_LABEL = re.compile(
    r"^\s*(?:articles?|art(?:ikel|[ií]culo|icolo|igo|yku[lł])?\b\.?|sections?|secci[oó]n|sec\.|s\.|rule|regulation|reg\.|regel|par(?:agraa?f)?\b\.?)\s*",
    re.I,
)
"""What some write before a number."""


def read(root: "Element") -> Statute:
    """All sections with text."""
    title = (
        words(first(root, "docTitle"), _NOTES)
        or words(first(root, "shortTitle"), _NOTES)
        or _value(root, "FRBRalias", "value")
    )
    language, told = language_of(_value(root, "FRBRlanguage", "language"))
    country = normal_jurisdiction(_value(root, "FRBRcountry", "value").partition("-")[0]) or ""
    address = next(
        (uri for name in ("FRBRuri", "FRBRthis") if (uri := _value(root, name, "value")).startswith("http")), ""
    )
    left = told + in_force(root, _out_of_force(root))
    schedules = [at for at in walked(root, _ASIDE) if _is_schedule(at)]
    inside = {id(below) for schedule in schedules for below in schedule.iter()}
    wholes = [at for at in walked(root, _ASIDE) if _kind(at) in _WHOLE and id(at) not in inside]
    chapters = _chapters(root, wholes)
    sections = [part for at in wholes for part in _section(at, title, address, chapters.get(id(at), ""))]
    nested = {id(below) for schedule in schedules for below in schedule.iter() if below is not schedule}
    outermost = [at for at in schedules if id(at) not in nested]
    sections += [part for at in outermost for part in _schedule(at, title, address)]
    statute = Statute(
        title=title,
        short=title,
        language=language,
        jurisdiction=country if len(country) == 3 else "",
        sections=tuple(sections),
        left=left,
    )
    return msgspec.structs.replace(statute, left=left + unread(root, statute, _ASIDE, _DROPPED))


def _chapters(root: "Element", wholes: list["Element"]) -> dict[int, str]:
    """The chapter's number of each section whose own number another chapter has too, as in Finland and Sweden."""
    of = {id(below): _label(at, "num") for at in root.iter() if local(at) == "chapter" for below in at.iter()}
    numbers = Counter(_label(at, "num") for at in wholes)
    return {id(at): chapter for at in wholes if numbers[_label(at, "num")] > 1 and (chapter := of.get(id(at)))}


def _is_schedule(at: "Element") -> bool:
    return local(at) in _SCHEDULES or (local(at) in ("hcontainer", "doc") and at.get("name", "") in _SCHEDULES)


def _schedule(at: "Element", title: str, address: str) -> Iterator[Section]:
    """Its sections or paragraphs, and what stands beside these; a schedule without any is one section."""
    named = next(
        (
            _label(each, "num", "heading")
            for each in at.iter()
            if child(each, "num", "heading") is not None and local(each) not in _PARTS
        ),
        "",
    )
    named = named or next((name for each in at.iter() if (name := each.get("name", ""))), "Schedule")
    units = _units(at)
    for place, unit in enumerate(units, 1):
        own = number(_label(unit, "num")) or str(place)
        if text := _text(unit):
            heading = _label(unit, "heading")
            yield Section(
                cited=f"{title} {named} para. {own}", key=f"{named}-{own}", text=text, heading=heading, url=address
            )
    held = {id(below) for unit in units for below in unit.iter()}
    beside: list[str] = []
    for below in walked(at, _DROPPED):
        if local(below) in _HOLDS and id(below) not in held:
            beside.append(words(below, _DROPPED))
            held |= {id(each) for each in below.iter()}
    if text := " ".join(filter(None, beside)):
        yield Section(cited=f"{title} {named}", key=named, text=text, url=address)


def _units(at: "Element") -> list["Element"]:
    """The outermost sections or paragraphs."""
    found: list[Element] = []
    held: set[int] = set()
    for below in walked(at, _ASIDE):
        if below is not at and id(below) not in held and (_kind(below) in _WHOLE or local(below) in _PARTS):
            found.append(below)
            held |= {id(each) for each in below.iter()}
    return found


def _out_of_force(root: "Element") -> Callable[["Element"], str]:
    """By the element's status, or by its period, whose dates stand in the meta data; of the root, by the act's life cycle."""
    today = datetime.now(UTC).date()
    dates = {f"#{at.get('eId', '')}": at.get("date", "") for at in root.iter() if local(at) == "eventRef"}
    periods = {
        f"#{at.get('eId', '')}": [
            (dates.get(each.get("start", ""), ""), dates.get(each.get("end", ""), "")) for each in at
        ]
        for at in root.iter()
        if local(at) == "temporalGroup"
    }

    def why(at: "Element") -> str:
        if at is root:
            return _repealed(root, today)
        if (status := at.get("status", "").lower()).replace("-", "") in _GONE:
            return status
        times = periods.get(at.get("period", ""), [])
        current = [
            start for start, end in times if not (end and over(end, today)) and not (start and not over(start, today))
        ]
        return "outside its period" if times and not current else ""

    return why


def _repealed(root: "Element", today: date) -> str:
    """That the act's life cycle has a repeal which is not ahead; a repeal without a date is taken as past."""
    cycle = first(root, "lifecycle")
    events = [] if cycle is None else list(cycle)
    repeals = [at.get("date", "") for at in events if at.get("type", "").lower().startswith("repeal")]
    return ", ".join(f"repealed on {day or 'a day unknown'}" for day in repeals if day[:10] <= today.isoformat())


def _section(at: "Element", title: str, address: str, chapter: str) -> Iterator[Section]:
    named = _label(at, "num")
    own, heading = number(_LABEL.sub("", named)), _label(at, "heading")
    cited = f"§ {own}" if "§" in named else f"{_WHOLE[_kind(at)]} {own}"
    if chapter:
        cited = f"{number(chapter)}:{own} §" if "§" in named else f"ch. {number(chapter)} {cited}"
        own = f"{number(chapter)}-{own}"
    parts = [below for below in at if local(below) in _PARTS]
    if not parts and any(below is not at and _kind(below) in _WHOLE for below in at.iter()):
        return  # a heading of sections, which have their own turn; what else it says is told as not read
    lead, tail = "", ""
    if parts:
        own_words = (below for below in at if local(below) not in ("num", "heading", "subheading"))
        lead, tail = around(own_words, lambda below: local(below) in _PARTS, _DROPPED - {"num"})
    for place, part in enumerate(parts or [at], 1):
        numbered = number(_label(part, "num")) or (str(place) if len(parts) > 1 else "") if part is not at else ""
        mark = f" Abs. {numbered}" if "§" in named else f"({numbered})"
        text = _text(part)
        yield Section(
            cited=f"{title} {cited}" + (mark if numbered else ""),
            key=f"{own}-{numbered}" if numbered else own,
            text=" ".join(filter(None, (lead, text, tail))) if text else "",
            heading=heading,
            url=address,
        )


def _text(part: "Element") -> str:
    """Without the part's own number and heading; numbers of points stay."""
    inside = [below for below in part if local(below) not in ("num", "heading", "subheading")]
    return " ".join(words(below, _DROPPED - {"num"}) for below in inside).strip()


def _label(at: "Element", *names: str) -> str:
    """The words of a number or a heading, without its notes."""
    return words(child(at, *names), _NOTES)


def _kind(at: "Element") -> str:
    return at.get("name", "") if local(at) == "hcontainer" else local(at)


def _value(root: "Element", name: str, attribute: str) -> str:
    found = first(root, name)
    return found.get(attribute, "") if found is not None else ""
