"""Reads advice from the answer to a whole prompt, by the front end's parser and by a few closed forms more.

A sentence that has no known form from its first to its last letter says nothing. Of several sentences the most careful one
counts, and of several limits the lowest: no sentence can raise what another one says. A limit ahead is not a limit in force.
"""

import re
from typing import NamedTuple

from evaluation.baselines.direct.forms import FORMS, Action, N
from proto.scene import Unit
from services.drivelm.guard.grounding import KMH
from services.drivelm.vocabulary.jurisdictions import allowed_limits
from services.drivelm.vocabulary.parser import Statement, parse
from services.drivelm.vocabulary.text import cleaned

MOST_CHARS, MOST_SENTENCES = 1200, 8


class Advice(NamedTuple):
    """What to do; `none`: nothing was understood. A limit without a unit in its sentence has the unit `None`."""

    action: Action
    value: float | None = None
    unit: Unit | None = None
    hazard: str = ""


NO_ADVICE = Advice("none")
_FORMS = tuple((form.pattern(), form) for form in FORMS)
_LIMITS = tuple(
    re.compile(form)
    for form in (
        rf"(?:drive|go) (?:at most|no faster than) {N}",
        rf"(?:slow down|keep) to {N}",
        rf"(?:in|inside|outside|within|on) [a-z ,()'-]{{3,90}} the speed limit(?: for [a-z ]{{3,40}})? is {N}",
        rf"start of a built-up area: {N} unless another limit is signed",
    )
)
_AHEAD = re.compile(r"^(the (?:traffic sign|sign|panel|speed limit)) ahead (is|shows) ", re.IGNORECASE)
_ACTOR = re.compile(
    r"a (?P<kind>vehicle|pedestrian|cyclist) is (?:[0-9]{1,3} m )?ahead in the path(?P<nearer> and comes nearer)?"
)
_HAZARDS = {"vehicle": "closing_lead", "pedestrian": "pedestrian", "cyclist": "pedestrian"}
_SIGNS: dict[str, Action] = {"stop": "stop", "yield": "give_way", "crossing": "give_way"}
_RANK: tuple[Action, ...] = ("stop", "hazard", "give_way", "limit", "limit_ahead", "slow", "none")


def advice_of(text: str) -> Advice:
    """The advice in a text, or `NO_ADVICE`."""
    found = [_of_sentence(each) for each in sentences(text)[:MOST_SENTENCES]]
    return min(found, key=careful, default=NO_ADVICE)


def sentences(text: str) -> list[str]:
    """The sentences of a text, as they stand."""
    parts = re.split(r"(?<=[.!?])\s+|\n+", text[:MOST_CHARS])
    return [part.strip(" -") for part in parts if part.strip(" -")]


def careful(advice: Advice) -> tuple[int, float]:
    """How careful an advice is: the least is the most careful."""
    return _RANK.index(advice.action), (advice.value or 0.0) * KMH[advice.unit]


def _of_sentence(sentence: str) -> Advice:
    if not sentence.isascii() or len(sentence) != len(cleaned(sentence, len(sentence))):
        return NO_ADVICE
    said = sentence.lower().rstrip(".!")
    for pattern, form in _FORMS:
        if match := pattern.fullmatch(said):
            return _of_form(match, form.action, form.hazard)
    here = _AHEAD.sub(r"\1 \2 ", sentence)
    if (statement := parse(here)) is not None:
        advice = _of_statement(statement)
        return advice._replace(action="limit_ahead") if here != sentence and advice.action == "limit" else advice
    if said == "brake":
        return Advice("slow")
    if actor := _ACTOR.fullmatch(said):
        return Advice("hazard", hazard=_HAZARDS[actor["kind"]])
    matches = (form.fullmatch(said) for form in _LIMITS)
    match = next((each for each in matches if each is not None), None)
    return _of_form(match, "limit") if match else NO_ADVICE


def _of_form(match: re.Match[str], action: Action, hazard: str = "") -> Advice:
    if "value" not in match.re.groupindex:
        return Advice(action, hazard=hazard)
    limit = _limit(float(match["value"]), "mph" if match["unit"] == "mph" else "km/h")
    return limit._replace(action=action) if limit.action == "limit" else limit


def _of_statement(statement: Statement) -> Advice:
    if statement.kind == "limit":
        plain = statement.value is not None and statement.scope != "end"
        return _limit(float(statement.value or 0), statement.unit) if plain else NO_ADVICE
    if statement.reading.startswith(("light:red", "light:amber")):
        return Advice("stop")
    return Advice(_SIGNS.get(statement.reading, "none"))


def _limit(value: float, unit: Unit | None) -> Advice:
    return Advice("limit", value, unit) if value in allowed_limits(None, unit) else NO_ADVICE
