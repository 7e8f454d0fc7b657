"""`python -m studies gvqa PREDICTIONS.json ... REFERENCE.json`: the table, or `--json`."""

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path

from evaluation.tables.columns import Column
from studies.gvqa.files import of_file, rows
from studies.gvqa.json_fields import UnreadableGraph
from studies.gvqa.pairing import Oddities, pair
from studies.gvqa.scores import Report, report
from studies.output import Sheet, add_json, show

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
        "predictions", type=Path, nargs="+", help="files of DriveLM's form, or its challenge's lists of id and answer"
    )
    parser.add_argument("reference", type=Path, help="a file of DriveLM's form")
    add_json(parser)
    flags = parser.parse_args(arguments)
    try:
        reference = of_file(flags.reference, rows)
        found = {str(file): report(*of_file(file, lambda each: pair(each, reference))) for file in flags.predictions}
    except UnreadableGraph as error:
        sys.stderr.write(f"studies.gvqa: {error}\n")
        return 2
    show([sheet(*each) for each in found.items()], as_json=flags.json, figures=found)
    return 0


def sheet(name: str, found: Report) -> Sheet:
    """A row a metric, of the answers of one file."""
    rows = [(name, one.metric, one.asked, one.answered, one.score, one.lenient) for one in found.scores]
    notes = [f"{found.answered} of {found.asked} questions answered"]
    if found.judged:
        notes.append(f"{found.judged} questions are for a language model to judge: not scored here")
    return Sheet(
        ("answers", "metric", "asked", "answered", Column(title="score", places=4), Column(title="lenient", places=4)),
        rows,
        [*notes, *_odd(found.oddities)],
    )


def _odd(oddities: Oddities) -> list[str]:
    return [f"{getattr(oddities, name)} {words}" for name, words in TOLD.items() if getattr(oddities, name)]
