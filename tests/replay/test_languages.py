"""Locked runs, decided again for drivers of every language: their own words, and the same decisions."""

import re
import tomllib
from collections.abc import Iterator
from functools import cache
from typing import Any

import msgspec
import pytest

from domain.languages import LANGUAGES
from drivemcp.files.place_names import installed, named
from services.orchestrator.speech.wording import FOLDER
from tests.replay.compare import outcomes
from tests.replay.files import LOGS, Parts, read_lines
from tests.replay.ticks import LoggedTick, decided_again

RUNS = ("border-to-miles", "car-must-stop", "motorway-gantries", "town-in-rain")


def in_language(name: str, language: str) -> Iterator[LoggedTick]:
    """A log as it would have been with a driver of that language; what experts answered stays as it is."""
    for entry in read_lines(LOGS / name / "inputs.jsonl.gz", LoggedTick):
        inputs = {**entry.inputs, "preferences": {**(entry.inputs.get("preferences") or {}), "language": language}}
        calls = tuple(
            msgspec.structs.replace(call, arguments=_for_language(call.arguments, language)) for call in entry.calls
        )
        yield msgspec.structs.replace(entry, inputs=inputs, calls=calls)


def _for_language(arguments: Any, language: str) -> Any:
    if not isinstance(arguments, dict):
        return arguments
    told = {name: _for_language(value, language) for name, value in arguments.items()}
    return {**told, "language": language} if "language" in told else told


@cache
def patterns(language: str) -> tuple[re.Pattern[str], ...]:
    """What the directives of a language look like, with any values but its own names of countries, plates and sides."""
    table = tomllib.loads((FOLDER / f"{language}.toml").read_text(encoding="utf-8"))
    places = [name.said or name.name for each in installed().values() if (name := named(each, language)) is not None]
    names = {"country": places, "plate": table["plate"].values(),
             "side": (table["word"]["left"], table["word"]["right"])}  # fmt: skip
    own = {name: f"(?:{'|'.join(map(re.escape, each))})" for name, each in names.items()}
    parts = (re.split(r"\{(\w+)\}", template) for template in table["directive"].values())
    return tuple(
        re.compile("".join(own.get(one, ".+") if at % 2 else re.escape(one) for at, one in enumerate(each)))
        for each in parts
    )


@cache
def locked(name: str) -> list[Parts]:
    return outcomes(name)


def reads_a_plate(name: str, language: str) -> bool:
    """Whether a plate of the run is in this language: its driver is not told what a foreign one says."""
    entries = read_lines(LOGS / name / "inputs.jsonl.gz", LoggedTick)
    return any(re.search(rf"plate:\w+:{language}\b", str(entry.inputs)) for entry in entries)


@pytest.mark.parametrize("language", LANGUAGES)
@pytest.mark.parametrize("name", RUNS)
def test_every_language_speaks_every_phrase_of_a_locked_run_and_decides_the_same(name: str, language: str) -> None:
    said = list(decided_again(in_language(name, language)))
    if not reads_a_plate(name, language):
        assert [parts["decision"]["kind"] for parts in said] == [parts["decision"]["kind"] for parts in locked(name)]
    texts = {parts["advisory"].get("directive", "") for parts in said} - {""}
    assert bool(texts) == any(parts["advisory"].get("directive") for parts in locked(name))
    assert {parts["advisory"].get("language") for parts in said} == {language}
    strange = [text for text in texts if not any(each.fullmatch(text) for each in patterns(language))]
    assert strange == []
