"""What of a statute is not made into drafts: what is not in force, and text that stands in no section."""

import re
from collections import Counter
from collections.abc import Callable
from datetime import date
from typing import TYPE_CHECKING

import msgspec

from services.rules.authoring.statutes.statute import Statute, local, numbers, walked, words

if TYPE_CHECKING:
    from xml.etree.ElementTree import Element

SHOWN = 3
EXCERPT = 70
_HOLD_TEXT = frozenset({"p", "P", "Text", "content", "Para", "td", "entry", "LA", "block", "li"})

_PICTURES = frozenset({"img", "Image", "IMG"})
_ONE = r"(?:\d+ [a-z](?![\w.])|[\w.]+)"
_NUMBER = re.compile(rf"^(?:{numbers(_ONE)}|\d+[a-z]?[.)])\s*")
_GONE = re.compile(
    r"(?:\W*(?:§+|s\.|(?:sub-?)?section|article|art\.|regulation|reg\.|rule|(?:sub-?)?paragraph|para\.?|schedule)\s*[\w().-]*)?"
    r"\W*(?:(?:is|was|has been|wurde|ist)\s+)?(?:repealed|revoked|deleted|omitted|spent|weggefallen|aufgehoben|gestrichen|abrog\w*|"
    r"supprim\w*|vervallen|uchylon\w*|soppress\w*|derogad\w*)\b"
    r"(?:\s+(?:by|with effect|from|on|durch|mit|par|da|por|przez|bij)\b.{0,160})?\W*",
    re.I,
)
"""All that stands in a provision that is no longer one."""

OutOfForce = Callable[["Element"], str]
"""Why an element is not in force; empty where it is."""


def in_force(root: "Element", why: OutOfForce) -> tuple[str, ...]:
    """Take from the tree what is not in force, and say what was taken; a statute that is not in force as a whole stays, and is told."""
    taken: list[str] = []
    todo = [root]
    while todo:
        at = todo.pop()
        reasons = {id(below): reason for below in at if (reason := why(below))}
        taken += [_named(below, reasons[id(below)]) for below in at if id(below) in reasons]
        if reasons:
            _remove(at, frozenset(reasons))
        todo += at
    return whole(why(root)) + ((f"not in force, left out: {counted(taken)}",) if taken else ())


def whole(reason: str) -> tuple[str, ...]:
    """That the statute is not in force as a whole; nothing where no reason is given."""
    return (f"the whole statute is marked as not in force, drafted all the same: {reason}",) if reason else ()


def kept(statute: Statute) -> Statute:
    """Without the sections whose only words are that they are gone, and those without words, which are told."""
    gone = [each for each in statute.sections if _GONE.fullmatch(each.text)]
    empty = [each for each in statute.sections if not each.text.strip(" .-–…")]
    told = [
        f"{why}, left out: {', '.join(each.cited for each in found)}"
        for why, found in (("not in force", gone), ("without a text (repealed?)", empty))
        if found
    ]
    left_out = {id(each) for each in (*gone, *empty)}
    sections = tuple(each for each in statute.sections if id(each) not in left_out)
    return msgspec.structs.replace(statute, sections=sections, left=(*told, *statute.left))


def _remove(at: "Element", gone: frozenset[int]) -> None:
    """Remove these children, by their identity; the text behind them stays."""
    last: Element | None = None
    for below in list(at):
        if id(below) not in gone:
            last = below
            continue
        tail = below.tail or ""
        at.remove(below)
        if last is not None:
            last.tail = (last.tail or "") + tail
        else:
            at.text = (at.text or "") + tail


def unread(root: "Element", statute: Statute, aside: frozenset[str], dropped: frozenset[str]) -> tuple[str, ...]:
    """What stands in the document and in no section, counted, with the first of it."""
    read = " ".join(f"{each.heading} {each.text}" for each in statute.sections)
    missing = [
        text
        for at in walked(root, aside | dropped)
        if local(at) in _HOLD_TEXT
        and len(text := words(at, dropped)) > 1
        and text.strip(" .-–")
        and not any(form in read for form in (text, words(at, dropped - {"num"}), _NUMBER.sub("", text)))
    ]
    pictures = [
        excerpt(next((said for name in ("alt", "src", "SRC", "ResourceRef") if (said := at.get(name, ""))), local(at)))
        for at in walked(root, aside | dropped)
        if local(at) in _PICTURES
    ]
    told = (("not read", [excerpt(text) for text in dict.fromkeys(missing)]), ("pictures, not read", pictures))
    return tuple(f"{what}: {counted(found)}" for what, found in told if found)


def over(text: str, today: date) -> bool:
    """Whether a date (2024-01-31) is today or before."""
    try:
        return date.fromisoformat(text[:10]) <= today
    except ValueError:
        return False


def _named(at: "Element", reason: str) -> str:
    return f"{local(at)} {excerpt(words(at))} ({reason})"


def excerpt(text: str) -> str:
    return repr(text if len(text) <= EXCERPT else f"{text[:EXCERPT]}...")


def counted(found: list[str]) -> str:
    listed = "; ".join(Counter(found))[:600] if len(found) <= SHOWN else "; ".join(found[:SHOWN]) + "; ..."
    return f"{len(found)} part{'s' if len(found) > 1 else ''}: {listed}"
