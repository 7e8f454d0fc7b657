"""Words: phrases by language out of tables, speeds in the driver's unit. Text from outside enters as a value only."""

import tomllib
from functools import cache
from pathlib import Path
from typing import Any

from domain.languages import spoken_language
from domain.units import convert, shown, told_distance, told_target
from drivemcp.files.place_names import installed, named
from proto.decision import Preferences
from proto.rules import LegalLimit, PlaceName
from proto.scene import Unit
from proto.speed_assistance import Face
from proto.weather import Conditions
from services.orchestrator.signs import border_evidence
from services.orchestrator.state import State
from services.orchestrator.text import plain

FOLDER = Path(__file__).parent / "phrases"
Table = dict[str, dict[str, str]]


@cache
def phrases(language: str) -> Table:
    """The table of a language; English for one that has none."""
    path = FOLDER / f"{spoken_language(language)}.toml"
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


def decimal(preferences: Preferences, value: float, places: int = 1) -> str:
    """A number with decimals, as the driver's language writes it."""
    text = f"{value:.{places}f}"
    return text if preferences.language == "en" else text.replace(".", ",")


def limit_number(preferences: Preferences, value: float, unit: Unit) -> str:
    """A limit in speech: the number on its sign; in the driver's unit, which is named, where the driver asked for that."""
    if not preferences.converts or preferences.unit == unit:
        return f"{value:g}"
    return f"{int(convert(value, unit, preferences.unit) + 1e-9)} {unit_name(preferences, preferences.unit)}"


def advised_number(preferences: Preferences, mps: float, limit: LegalLimit | None) -> str:
    """A recommended speed in speech: in the unit of the limit beside it, in steps that can be driven."""
    unit = preferences.unit if preferences.converts or limit is None else limit.unit
    return str(told_target(mps, unit))


def unit_name(preferences: Preferences, unit: str) -> str:
    """`miles an hour`."""
    return phrases(preferences.language)["unit"].get(unit, unit)


def units_name(preferences: Preferences, unit: str) -> str:
    """`miles`."""
    return phrases(preferences.language)["units"].get(unit, unit)


def place_name(state: State, code: str) -> PlaceName:
    """A country in the driver's language: as the Rules told it, else as the installed packs do, else as `this country`."""
    language = spoken_language(state.preferences.language)
    told = next((each.name for each in state.held.places if (each.code, each.language) == (code, language)), None)
    known = told or named(installed().get(code, {}), language)
    unnamed = PlaceName(**phrases(language)["a_country"])
    if known is None:
        return unnamed
    inside, out_of = known.inside or unnamed.inside, known.out_of or unnamed.out_of
    return PlaceName(name=known.name, inside=inside, out_of=out_of, said=known.said)


def reading_words(state: State, reading: str) -> str:
    """A sign in words: its number, of a border the country's name, else the code that readers write, without its marks."""
    head, _, tail = reading.partition(":")
    if head == "border":
        return place_name(state, tail).name
    return tail if tail.replace(".", "", 1).isdecimal() else reading.replace("_", " ").replace(":", " ")


def plate_words(preferences: Preferences, plates: tuple[str, ...]) -> str:
    """What the first plate that has words says, in the driver's language; empty: none has."""
    heads = (plate.split(":")[1] for plate in plates if plate.count(":"))
    table = phrases(preferences.language)["plate"]
    return next((table[head] for head in heads if head in table), "")


def few(preferences: Preferences, text: str) -> str:
    """No more words than are heard while driving, and none at the end that leads on to one that is left out."""
    words = text.split()
    kept, leads_on = words[:MOST_WORDS], phrases(preferences.language)["word"]["leads_on"].split()
    while len(kept) < len(words) and len(kept) > 1 and kept[-1].lower() in leads_on:
        kept.pop()
    return " ".join(kept).rstrip(".,;:")


MOST_WORDS = 5
"""Beside a word that introduces them."""
FACES: dict[str, Face] = {
    "person": "person", "lead": "vehicle", "crossing": "vehicle", "slow_traffic": "vehicle",
    "red_light": "red_light", "light_lost": "red_light", "stop_sign": "stop", "stop_line": "stop",
    "give_way": "give_way", "junction": "give_way", "go": "green_light",
    "vehicle_stop_now": "car_fault", "vehicle_stop_soon": "car_fault", "vehicle_with_care": "car_fault",
    "vehicle_leave": "car_fault", "vehicle_ok": "car_fault", "vehicle_trend": "car_fault", "vehicle_sensor": "car_fault",
    "vehicle_unread": "car_fault",
    "overspeed": "limit", "limit": "limit", "limit_plate": "limit", "limit_advisory": "limit_advisory",
    "limit_ahead": "limit_ahead", "zone_ahead": "limit_ahead", "slow_ahead": "limit_ahead", "border": "border",
    "foreign": "sign", "deep_water": "deep_water", "ice": "ice", "water": "slippery", "slippery": "slippery",
    "doubt": "unclear_sign", "degraded": "service_fault", "old_rules": "service_fault",
}  # fmt: skip
"""The sign beside a message, by its phrase; of others `caution`."""


def face(phrase: str) -> Face:
    """The sign beside a message of this phrase, however firmly it is said."""
    plain_phrase = phrase
    for ending in ("_alarm", "_firm", "_open"):
        plain_phrase = plain_phrase.removesuffix(ending)
    return FACES.get(plain_phrase, "caution")


def graver(phrase: str) -> str:
    """The phrase of the same hazard with which it is an alarm, where there is one."""
    alarm = f"{phrase.removesuffix('_alarm')}_alarm"
    return alarm if alarm in phrases("en")["directive"] else phrase


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
    return ", ".join(
        table[word] if sum_ is None else f"{table[word]} ({decimal(preferences, sum_)})"
        for word, sum_ in weights.items()
    )
