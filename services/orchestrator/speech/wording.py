"""Words: phrases by language out of tables, speeds in the driver's unit. Text from outside enters as a value only."""

import tomllib
from functools import cache
from pathlib import Path
from typing import Any

from domain.units import shown, told_distance, told_target
from proto.decision import Preferences
from proto.weather import Conditions
from services.orchestrator.signs import border_evidence
from services.orchestrator.text import plain

FOLDER = Path(__file__).parent / "phrases"
LANGUAGES = ("en", "de")
Table = dict[str, dict[str, str]]


@cache
def phrases(language: str) -> Table:
    """The table of a language; English for one that has none."""
    path = FOLDER / f"{language if language in LANGUAGES else 'en'}.toml"
    table: Table = tomllib.loads(path.read_text(encoding="utf-8"))
    return table


def say(preferences: Preferences, section: str, phrase: str, /, **values: Any) -> str:
    """One phrase with its values; values are cleaned, and never looked into for further placeholders."""
    template = phrases(preferences.language)[section][phrase]
    return template.format_map({name: plain(str(value)) for name, value in values.items()})


def word(preferences: Preferences, name: str) -> str:
    """A single word."""
    return phrases(preferences.language)["word"][name]


def speed(preferences: Preferences, mps: float) -> str:
    """A measured speed in the driver's unit."""
    return f"{shown(mps, preferences.unit)} {preferences.unit}"


def distance(preferences: Preferences, metres: float) -> str:
    """A distance in the driver's unit."""
    return told_distance(metres, preferences.unit)


def drive(preferences: Preferences, mps: float) -> str:
    """A target in the driver's unit, in steps that can be driven."""
    return f"{told_target(mps, preferences.unit)} {preferences.unit}"


LITTLE, FULL = 0.35, 0.7
"""Of mu."""


def grip_word(preferences: Preferences, conditions: Conditions | None) -> str:
    """The grip as one word, by its least; uncertain where nothing tells whether the road is wet: unknown grip is not ice."""
    if conditions is None or conditions.mu_low < LITTLE:
        open_ended = conditions is None or (conditions.wet is None and conditions.mu_high > FULL)
        return word(preferences, "uncertain" if open_ended else "little")
    return word(preferences, "reduced" if conditions.mu_low < FULL else "full")


def toned(preferences: Preferences, directive: str, urgency: str) -> str:
    """Politeness where there is time for it."""
    if preferences.tone != "friendly" or urgency in ("warning", "alarm") or not directive:
        return directive
    return phrases(preferences.language)["word"]["friendly"].format_map({"directive": directive})


def evidence_in_words(preferences: Preferences, text: str) -> str:
    """`border sign (6.0), side of traffic (2.5)`; codes of one kind are added up."""
    table, weights = phrases(preferences.language)["evidence"], dict[str, float | None]()
    for item in border_evidence.items(text):
        before = weights.get(item.word)
        weights[item.word] = item.weight if before is None or item.weight is None else before + item.weight
    return ", ".join(table[word] if sum_ is None else f"{table[word]} ({sum_:.1f})" for word, sum_ in weights.items())
