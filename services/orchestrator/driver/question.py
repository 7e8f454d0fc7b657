"""A driver's question: what it is about, and whom to ask. Pure."""

import re
import tomllib
from functools import cache
from pathlib import Path
from typing import Literal, cast

import msgspec

from proto.decision import Preferences
from services.orchestrator.experts.routing import Call
from services.orchestrator.law import rules_question
from services.orchestrator.law.limits_ahead import sign_question
from services.orchestrator.state import SignAhead, State
from services.orchestrator.text import plain

Subject = Literal["sign", "units", "change", "lamp", "limit", "law"]
DEADLINE_MS = 250.0


# -- what it is about ----------------------------------------------------------------------------------------------------


@cache
def _subjects() -> tuple[tuple[Subject, re.Pattern[str], int], ...]:
    table = tomllib.loads((Path(__file__).parent / "subjects.toml").read_text(encoding="utf-8"))
    return tuple((cast(Subject, name), _pattern(row["words"]), int(row["weight"])) for name, row in table.items())


def _pattern(words: list[str]) -> re.Pattern[str]:
    parts = (re.escape(word.removesuffix("*")) + (r"\w*" if word.endswith("*") else "") for word in words)
    return re.compile(rf"(?<!\w)(?:{'|'.join(parts)})(?!\w)", re.IGNORECASE)


def subject_of(question: str) -> Subject:
    """By the words in it; what names nothing known is a question for the law books."""
    scores = [
        (weight * len(pattern.findall(question)), -i, name) for i, (name, pattern, weight) in enumerate(_subjects())
    ]
    score, _, name = max(scores)
    return name if score > 0 else "law"


# -- whom to ask ---------------------------------------------------------------------------------------------------------


def calls_for(subject: Subject, question: str, state: State) -> tuple[Call, ...]:
    """A sign → Rules and Weather; units or country → Rules; a changed limit → Rules and Weather; a lamp → CAN and Rules."""
    limit = Call(tool="applicable_limit", arguments=rules_question.situation_arguments(state), deadline_ms=DEADLINE_MS)
    weather = Call(tool="assess_weather", arguments={}, deadline_ms=DEADLINE_MS)
    language = {"language": state.preferences.language}
    car = tuple(Call(tool=t, arguments=language, deadline_ms=DEADLINE_MS) for t in ("vehicle_health", "read_dtcs"))
    table: dict[Subject, tuple[Call, ...]] = {
        "sign": (*_sign_call(state), weather),
        "units": (limit, *_lookups("units", state)),
        "change": (limit, weather, *_lookups("change", state)),
        "lamp": (*car, *_lookups("lamp", state)),
        "limit": (limit, weather),
        "law": (_lookup(question, state, state.preferences.language),),
    }
    return table[subject]


LAW_QUERIES: dict[str, dict[str, str]] = {
    "en": {
        "units": "units of speed limits, kilometres or miles per hour",
        "change": "variable speed limit signs on gantries, and signs that end a limit",
        "lamp": "warning lamp or defect of the brakes: must the car stop, is driving on allowed",
    },
    "de": {
        "units": "Einheit der Geschwindigkeitsbegrenzung, Kilometer oder Meilen in der Stunde",
        "change": "wechselnde Geschwindigkeitsbegrenzungen an Schilderbrücken, und Zeichen, die eine Begrenzung aufheben",
        "lamp": "Warnleuchte oder Mangel an der Bremse: muss angehalten werden, ist die Weiterfahrt erlaubt",
    },
}
"""In the language in which the law is to be told: its text is searched by words too."""


def _lookups(subject: str, state: State) -> tuple[Call, ...]:
    """In the driver's language, and in English: not every country's law is there in every language."""
    languages = dict.fromkeys((state.preferences.language, "en"))
    return tuple(_lookup(LAW_QUERIES[each][subject], state, each) for each in languages if each in LAW_QUERIES)


def _lookup(query: str, state: State, language: str) -> Call:
    here = state.signs.jurisdiction
    return Call(
        tool="lookup_rule",
        arguments={
            "query": plain(query, 400),
            "jurisdiction": here.value if here is not None else None,
            "language": language,
        },
        deadline_ms=DEADLINE_MS,
    )


def sign_asked_about(state: State) -> SignAhead | None:
    """The nearest sign ahead, else the one passed last."""
    ahead = sorted(state.signs.ahead, key=lambda s: (s.distance_m if s.distance_m is not None else 1e3, s.track_id))
    if ahead:
        return ahead[0]
    return state.signs.recent[-1] if state.signs.recent else None


def _sign_call(state: State) -> tuple[Call, ...]:
    sign = sign_asked_about(state)
    if sign is None:
        return ()
    return (Call(tool="interpret_sign", arguments=sign_question(state, sign), deadline_ms=DEADLINE_MS),)


def in_language(state: State, language: str | None) -> State:
    """The state with another language for this one answer."""
    if language not in ("en", "de"):
        return state
    preferences: Preferences = msgspec.structs.replace(state.preferences, language=language)
    return msgspec.structs.replace(state, preferences=preferences)
