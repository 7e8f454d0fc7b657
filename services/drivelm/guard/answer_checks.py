"""Checks a backend's answer against the picture it is about, before anything in it is believed.

An answer may name places as DriveLM does (`<c1,CAM_FRONT,x,y>`, or `(x, y)` in pixels of the whole picture). A place
outside the picture, or where nothing is tracked, is a thing invented; so is an answer to another question. Such an
answer says nothing, and the fault is remembered against its track.
"""

import math
import re
from collections.abc import Iterable, Sequence
from typing import NamedTuple

from services.drivelm.backends.backend import NO_ANSWER, Answer
from services.drivelm.reading.crops import Region
from services.drivelm.vocabulary.classes import KIND_OF_QUESTION, OTHER
from services.drivelm.vocabulary.jurisdictions import unit_of
from services.drivelm.vocabulary.parser import parse

Readings = tuple[tuple[str, float], ...]
OUTSIDE = "names a place outside the picture"
NOTHING_THERE = "names a place where it was not asked"
OTHER_QUESTION = "answers another question"
MOST_CHARS = 400
MOST_ALTERNATIVES = 8
INSIDE = 0.5
"""Share of a box that must lie in the picture."""
_AT = r"\s*(-?[0-9]{1,7}(?:\.[0-9]{1,4})?)\s*"
_NAMED = rf"(?:<c[0-9]{{1,3}},\s*[A-Z_]{{1,30}},{_AT},{_AT}>|\({_AT},{_AT}\))"
_PLACE = re.compile(_NAMED)
_APART = re.compile(rf"(?<=[a-z])\s{_NAMED}(?=[ .]|$)")
"""A place after a word and before the next: taking it out must never join what stood apart."""


class CheckedAnswer(NamedTuple):
    """The readings of an answer, and its fault; empty: no fault."""

    readings: Readings = ()
    fault: str = ""


class Shown(NamedTuple):
    """What the question was about: a region of a picture of this size."""

    region: Region
    width_px: int
    height_px: int


def checked(answer: Answer, question: str, jurisdiction: str | None, shown: Shown) -> CheckedAnswer:
    """An answer as readings with probabilities; what is not grounded, or what the parser refuses, gives no reading.

    A sentence in a unit that the country does not use is refused too. A condition said in the sentence itself is not
    kept: conditions come from plates, and without one a limit counts always, which is the careful side.
    """
    offered = _offered(answer)
    fault = next((wrong for text, _ in offered if (wrong := misplaced(text, shown))), "")
    if fault:
        return CheckedAnswer((), fault)
    kind = KIND_OF_QUESTION.get(question, "")
    readings = _readings(offered, jurisdiction)
    best = max(readings, key=lambda row: row[1], default=(OTHER, 0.0))[0]
    fitting = tuple(row for row in readings if answers(kind, row[0]))
    return CheckedAnswer(fitting, "" if answers(kind, best) else OTHER_QUESTION)


def as_many(answers: Sequence[Answer], count: int) -> list[Answer]:
    """One answer per picture, whatever the backend returned; with another number they cannot be assigned."""
    return list(answers) if len(answers) == count else [NO_ANSWER] * count


def misplaced(text: str, shown: Shown) -> str:
    """What is wrong with the places that a text names; empty where they are in the region asked about."""
    for x, y in places(text):
        if not (0 <= x < shown.width_px and 0 <= y < shown.height_px):
            return OUTSIDE
        if not _holds(shown.region, x, y):
            return NOTHING_THERE
    return ""


def places(text: str) -> tuple[tuple[float, float], ...]:
    """The places named, in pixels of the whole picture."""
    return tuple((float(a or c), float(b or d)) for a, b, c, d in _PLACE.findall(text[:MOST_CHARS]))


def inside(shown: Shown) -> bool:
    """Whether enough of the region lies in the picture to be asked about."""
    region = shown.region
    if not all(map(math.isfinite, region)):
        return False
    width = min(region.x1_px, shown.width_px) - max(region.x0_px, 0.0)
    height = min(region.y1_px, shown.height_px) - max(region.y0_px, 0.0)
    return min(width, height) > 0 and width * height >= INSIDE * region.width_px * region.height_px


def answers(kind: str, reading: str) -> bool:
    """Whether a reading answers a question about a thing of this kind: lamps for lights, plates for plates."""
    head = reading.partition(":")[0]
    if reading == OTHER:
        return True
    if kind in ("light", "plate"):
        return head == kind
    return head != "light"


def _offered(answer: Answer) -> tuple[tuple[str, float], ...]:
    rows = answer.alternatives[:MOST_ALTERNATIVES] or ((answer.text, answer.score),)
    return tuple((text.strip(), _share(share)) for text, share in rows if _plain(text))


def _plain(text: str) -> bool:
    """Whether a text can be of the language agreed on: printable ASCII, short. Look-alikes and controls are not."""
    return 0 < len(text) <= MOST_CHARS and text.isascii() and text.strip().isprintable()


def _share(score: float) -> float:
    return min(1.0, max(0.0, score)) if math.isfinite(score) else 0.0


def _readings(offered: Iterable[tuple[str, float]], jurisdiction: str | None) -> Readings:
    readings: dict[str, float] = {}
    for text, share in offered:
        statement = parse(_APART.sub("", text))
        if statement is not None and statement.unit in (None, unit_of(jurisdiction)):
            readings[statement.reading] = max(readings.get(statement.reading, 0.0), share)
    return tuple(readings.items())


def _holds(region: Region, x: float, y: float) -> bool:
    margin = 0.25 * max(region.width_px, region.height_px)
    across = region.x0_px - margin <= x <= region.x1_px + margin
    return across and region.y0_px - margin <= y <= region.y1_px + margin
