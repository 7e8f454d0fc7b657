"""A driver's question: its subject, and the tools that answer it. Pure."""

import re
import tomllib
from functools import cache
from pathlib import Path
from typing import Any, Literal, cast

import msgspec

from domain.languages import LANGUAGES
from proto.decision import Preferences
from services.orchestrator.experts.routing import Call
from services.orchestrator.law import rules_question
from services.orchestrator.law.limits_ahead import sign_question
from services.orchestrator.state import SignAhead, State
from services.orchestrator.text import plain

Subject = Literal["sign", "units", "change", "lamp", "limit", "law", "told"]
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
    """By the words in it; without a known one it is a question for the law books."""
    scores = [
        (weight * len(pattern.findall(question)), -i, name) for i, (name, pattern, weight) in enumerate(_subjects())
    ]
    score, _, name = max(scores)
    return name if score > 0 else "law"


# -- tools to ask ---------------------------------------------------------------------------------------------------------


ASKED: dict[Subject, tuple[str, ...]] = {
    "sign": ("interpret_sign", "assess_weather"),
    "units": ("applicable_limit", "lookup_rule"),
    "change": ("applicable_limit", "assess_weather", "lookup_rule"),
    "lamp": ("vehicle_health", "read_dtcs", "lookup_rule"),
    "limit": ("applicable_limit", "assess_weather"),
    "law": ("lookup_rule",),
    "told": ("lookup_rule",),
}
"""The tools that a question about a subject asks."""


def calls_for(subject: Subject, question: str, state: State) -> tuple[Call, ...]:
    """The calls that answer a question, in the order of `ASKED`."""
    sign, language = sign_asked_about(state), {"language": state.preferences.language}
    arguments: dict[str, list[dict[str, Any]]] = {
        "applicable_limit": [rules_question.situation_arguments(state)],
        "assess_weather": [{}],
        "vehicle_health": [language],
        "read_dtcs": [language],
        "interpret_sign": [sign_question(state, sign)] if sign is not None else [],
        "lookup_rule": _lookups(subject, question, state),
    }
    every = ((tool, each) for tool in ASKED[subject] for each in arguments[tool])
    return tuple(Call(tool=tool, arguments=each, deadline_ms=DEADLINE_MS) for tool, each in every)


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
    "fr": {
        "units": "unité des limites de vitesse, kilomètres ou miles à l'heure",
        "change": "limites de vitesse variables sur les portiques, et panneaux de fin de limite",
        "lamp": "voyant ou défaut des freins : faut-il s'arrêter, peut-on continuer",
    },
    "nl": {
        "units": "eenheid van snelheidslimieten, kilometer of mijl per uur",
        "change": "wisselende snelheidslimieten op matrixborden, en borden die een limiet beëindigen",
        "lamp": "waarschuwingslampje of gebrek aan de remmen: moet de auto stoppen, mag hij doorrijden",
    },
    "pl": {
        "units": "jednostka ograniczeń prędkości, kilometry lub mile na godzinę",
        "change": "zmienne ograniczenia prędkości na tablicach nad drogą i znaki odwołujące ograniczenie",
        "lamp": "kontrolka ostrzegawcza lub usterka hamulców: czy trzeba się zatrzymać, czy wolno jechać dalej",
    },
    "it": {
        "units": "unità dei limiti di velocità, chilometri o miglia all'ora",
        "change": "limiti di velocità variabili sui portali, e segnali di fine limite",
        "lamp": "spia o difetto dei freni: bisogna fermarsi, si può proseguire",
    },
    "es": {
        "units": "unidad de los límites de velocidad, kilómetros o millas por hora",
        "change": "límites de velocidad variables en pórticos, y señales de fin de límite",
        "lamp": "testigo o defecto de los frenos: hay que parar, se puede seguir",
    },
}
"""In the language in which the law is to be told: its text is searched by words too."""


def _lookups(subject: Subject, question: str, state: State) -> list[dict[str, Any]]:
    """In the driver's language, and in English: not every country's law is there in every language."""
    languages = dict.fromkeys((state.preferences.language, "en"))
    queries = {each: LAW_QUERIES[each].get(subject, "") for each in languages if each in LAW_QUERIES}
    if subject in ("law", "told"):
        queries = {state.preferences.language: question}
    return [
        {"query": plain(query, 400), "jurisdiction": state.place, "language": language}
        for language, query in queries.items()
    ]


def sign_asked_about(state: State) -> SignAhead | None:
    """The nearest sign ahead, else the one passed last."""
    ahead = sorted(state.signs.ahead, key=lambda s: (s.distance_m if s.distance_m is not None else 1e3, s.track_id))
    return next(iter((*ahead, *reversed(state.signs.recent))), None)


def in_language(state: State, language: str | None) -> State:
    """The state with another language for this one answer."""
    if language not in LANGUAGES:
        return state
    preferences: Preferences = msgspec.structs.replace(state.preferences, language=language)
    return msgspec.structs.replace(state, preferences=preferences)
