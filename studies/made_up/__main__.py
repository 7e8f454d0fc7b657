"""`python -m studies made_up CASSETTE`: numbers, units, road users and citations that a model makes up, and whether it heeds the scene."""

import argparse
import sys
from collections.abc import Iterable, Sequence
from pathlib import Path

import msgspec

from drivemcp.config import settings_of
from drivemcp.errors import UserError
from evaluation.baselines.direct import cassette
from evaluation.baselines.direct.answer_sources import source_of, template_of
from evaluation.baselines.direct.cassette import Line
from evaluation.baselines.direct.template import filled
from evaluation.tables.columns import Column
from services.drivelm.backends.config import AnswersConfig
from services.drivelm.service import DrivelmConfig
from studies.made_up.checks import made_up
from studies.made_up.controls import Controls, Says, controls
from studies.output import Cell, Sheet, add_json, percent, show

METHODS = ("scene alone", "with passages of law", "with tools")
SHARES = (
    "understood",
    "abstains",
    "number that stands nowhere",
    "other unit",
    "road user that is not there",
    "citation of nothing",
)
COLUMNS: tuple[str | Column, ...] = ("backend", "prompt", "answers", *map(percent, SHARES))
CONTROLS: tuple[str | Column, ...] = (
    "backend",
    "prompt",
    percent("answers without a scene"),
    percent("stays with another's scene"),
)
NOTE = (
    "Each share is of the answers of its kind (with a number, with a unit, that name a road user, that cite), with the exact binomial 95 % "
    "interval; answers of one drive are not independent, so that intervals are too narrow."
)
CONTROL_NOTE = (
    "Without a scene each question is asked once and must be left unanswered. Another's scene is one in which the reader without a model "
    "finds other advice to the same question."
)


def main(arguments: Sequence[str]) -> int:
    """Show the tables. Exit status: 0, or 2 where a file or a setting cannot be used."""
    parser = argparse.ArgumentParser(prog="python -m studies made_up", description=__doc__)
    parser.add_argument("cassette", type=Path, help="recorded answers (drivemcp evaluate TABLE --record-answers FILE)")
    parser.add_argument("--controls", type=Path, metavar="FILE", help="a cassette of the answers to the controls")
    parser.add_argument(
        "--ask", action="store_true", help="ask the model for controls that are not in --controls yet, and record them"
    )
    parser.add_argument(
        "--most", type=int, default=100, metavar="N", help="answers a method whose scene is swapped (100)"
    )
    parser.add_argument(
        "--set", action="append", default=[], metavar="drivelm.KEY=VALUE", help="a setting of the backend that is asked"
    )
    add_json(parser)
    flags = parser.parse_args(arguments)
    try:
        show(sheets(flags), as_json=flags.json)
    except UserError as error:
        sys.stderr.write(f"studies.made_up: {error}\n")
        return 2
    return 0


def sheets(flags: argparse.Namespace) -> list[Sheet]:
    """The checks, and where a cassette of controls is named the controls."""
    groups = grouped(cassette.read(flags.cassette))
    found = [Sheet(COLUMNS, [_row(key, lines) for key, lines in groups.items()], [NOTE])]
    if flags.controls is None:
        return found
    modelled = {key: lines for key, lines in groups.items() if not key[0].startswith("embedded")}
    rows = [_controlled(key, controls(lines, says(key[0], flags), flags.most)) for key, lines in modelled.items()]
    return [*found, Sheet(CONTROLS, rows, [CONTROL_NOTE])]


def grouped(lines: Iterable[Line]) -> dict[tuple[str, str], list[Line]]:
    """Answers by backend, and by what stood in the prompt."""
    groups: dict[tuple[str, str], list[Line]] = {}
    for line in lines:
        method = METHODS[2] if line.tools else METHODS[1] if line.passages else METHODS[0]
        groups.setdefault((line.backend, method), []).append(line)
    return dict(sorted(groups.items(), key=lambda each: (each[0][0], METHODS.index(each[0][1]))))


def says(backend: str, flags: argparse.Namespace) -> Says:
    """The backend of that name, asked or played. Raises UserError where its settings make it another one."""
    kind, _, rest = backend.partition(":")
    settings = settings_of([f"drivelm.prompt_backend={kind}", *flags.set]).get("drivelm", {})
    if kind == "gguf":
        settings.setdefault("gguf", {})["decoding"] = rest.partition(":")[0]
    answers = (
        AnswersConfig(record=str(flags.controls))
        if flags.ask
        else AnswersConfig(play=str(flags.controls), model=backend)
    )
    try:
        config = msgspec.structs.replace(msgspec.convert(settings, DrivelmConfig), answers=answers)
    except msgspec.ValidationError as error:
        raise UserError(f"--set: {error}") from None
    template = template_of(config)
    source = source_of(config, template, None, "embedded")
    if source.name != backend:
        raise UserError(f"the cassette is of {backend}, and the model that is set is {source.name}")
    return lambda asked: source.answer(asked, filled(template, asked), None).text


def _row(key: tuple[str, str], lines: Sequence[Line]) -> list[Cell]:
    answers, *counts = made_up(lines)
    return [*key, answers, *(count.percent() for count in counts)]


def _controlled(key: tuple[str, str], found: Controls) -> list[Cell]:
    return [*key, *(count.percent() for count in found)]


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
