"""`python -m studies gvqa PREDICTIONS.json REFERENCE.json`: the table, or `--json`."""

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path

import msgspec

from studies.gvqa.files import load, rows
from studies.gvqa.json_fields import UnreadableGraph
from studies.gvqa.pairing import Oddities, pair
from studies.gvqa.scores import Report, report

TOLD = {
    "unanswered": "questions without an answer (score 0)",
    "other_question": "answers given to another question than the reference's under that id (ignored)",
    "disputed": "questions with several answers that differ (score 0)",
    "unknown": "answers to what the reference does not ask (ignored)",
    "wrong_form": "rows that are no answer: an id or an answer is missing or no text (ignored)",
    "broken_tags": "answers with a broken object tag (its point is not counted)",
}


def main(arguments: Sequence[str]) -> int:
    """Score one file against another. Exit status: 0 scored, 2 a file cannot be read."""
    parser = argparse.ArgumentParser(
        prog="python -m studies gvqa",
        description="Scores answers to DriveLM's questions offline: exact match, coordinate match, BLEU, ROUGE-L, CIDEr.",
    )
    parser.add_argument(
        "predictions", type=Path, help="a file of DriveLM's form, or its challenge's list of id and answer"
    )
    parser.add_argument("reference", type=Path, help="a file of DriveLM's form")
    parser.add_argument("--json", action="store_true", help="one JSON object instead of text")
    flags = parser.parse_args(arguments)
    try:
        found = report(*pair(load(flags.predictions), rows(load(flags.reference))))
    except UnreadableGraph as error:
        sys.stderr.write(f"studies.gvqa: {error}\n")
        return 2
    sys.stdout.write(msgspec.json.encode(found).decode() + "\n" if flags.json else table(found))
    return 0


def table(found: Report) -> str:
    """The report as text."""
    lines = [f"{'metric':<20} {'asked':>6} {'answered':>9} {'score':>8}"]
    for one in found.scores:
        value = "none" if one.score is None else f"{one.score:.4f}"
        lines.append(f"{one.metric:<20} {one.asked:>6} {one.answered:>9} {value:>8}")
    lines.append(f"{found.answered} of {found.asked} questions answered")
    if found.judged:
        lines.append(f"{found.judged} questions are for a language model to judge: not scored here")
    return "\n".join([*lines, *_odd(found.oddities)]) + "\n"


def _odd(oddities: Oddities) -> list[str]:
    return [f"{getattr(oddities, name)} {words}" for name, words in TOLD.items() if getattr(oddities, name)]
