"""`python -m studies gvqa.answer FILE.json OUT.json`: what the embedded backend answers of a DriveLM file's questions.

It is given the file's objects and nothing else: no picture, no annotated answer, no description of the scene. With `--black`
it is given no objects either, as from a black picture: the control, whose every answer is a guess. Its answers
go to OUT.json in the challenge's form, for `python -m studies gvqa OUT.json FILE.json`; the table tells, for each
family of questions, how many it answers and how many not.
"""

import argparse
import sys
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import msgspec

from drivemcp.errors import ToolFailed, UserError
from proto.scene import SceneGraph
from services.drivelm.graph.answering import ask
from services.drivelm.graph.templates import recognise
from studies.gvqa.drivelm_json import from_drivelm
from studies.gvqa.files import SUBMITTED, Row, load, of_file, questions_only, rows
from studies.gvqa.json_fields import UnreadableGraph, as_object, field
from studies.gvqa.language_model import answers_by
from studies.output import Sheet, add_json, show

Answers = Callable[[SceneGraph, str], str]
"""From a scene and a question to an answer; empty: an abstention."""


class Answered(NamedTuple):
    """A question, its family ("other forms" where it has none), and the answer; empty: abstained."""

    id: str
    question: str
    family: str
    answer: str


def answers(document: object, *, black: bool = False, by: Answers | None = None) -> list[Answered]:
    """An answer or none to each question of a file, whether it holds answers or not. Raises ``UnreadableGraph``.

    `black`: the objects of the file are left out as well. `by`: what answers in place of the embedded backend.
    """
    document = questions_only(document)
    hidden: dict[str, Any] = {"qa": (), "description": "", **({"objects": ()} if black else {})}
    graphs = {
        (name, key): msgspec.structs.replace(graph, **hidden)
        for name, scene in from_drivelm(document).items()
        for key, graph in scene.frames.items()
    }
    return [_answer(row, graphs, by or embedded) for row in rows(document)]


def embedded(graph: SceneGraph, question: str) -> str:
    """The embedded backend's answer; empty: it abstains."""
    found = ask(graph, question)
    return found.text if found.score > 0 else ""


def _answer(row: Row, graphs: Mapping[tuple[str, str], SceneGraph], by: Answers) -> Answered:
    place, asked = row.place, recognise(row.place.question)
    said = by(graphs[place.scene, place.frame], place.question)
    number = f"{place.scene}_{place.frame}_{row.number}"
    return Answered(number, place.question, asked.family if asked else "other forms", said)


def main(arguments: Sequence[str]) -> int:
    """Answer a file. Exit status: 0 answered, 2 it cannot be read."""
    parser = argparse.ArgumentParser(prog="python -m studies gvqa.answer", description=__doc__)
    parser.add_argument("file", type=Path)
    parser.add_argument("out", type=Path)
    parser.add_argument(
        "--submission", type=Path, metavar="FILE.json",
        help=f"a JSON object with {', '.join(SUBMITTED)}: OUT.json becomes the challenge's submission",
    )  # fmt: skip
    parser.add_argument(
        "--set", action="append", default=[], metavar="KEY=VALUE",
        help="a setting of drivelm: prompt_backend=gguf asks a model; answers.record=FILE keeps its answers, answers.play=FILE plays them",
    )  # fmt: skip
    parser.add_argument("--black", action="store_true", help="answer without the file's objects: the control")
    add_json(parser)
    flags = parser.parse_args(arguments)
    try:
        by_whom = answers_by(flags.set) if flags.set else None
        found = of_file(flags.file, lambda document: answers(document, black=flags.black, by=by_whom))
        by = _submitter(flags.submission) if flags.submission else None
    except (UnreadableGraph, UserError, ToolFailed) as error:
        sys.stderr.write(f"studies.gvqa.answer: {error}\n")
        return 2
    flags.out.write_bytes(as_challenge(found, by))
    show([sheet(found)], as_json=flags.json)
    return 0


def _submitter(path: Path) -> dict[str, Any]:
    """What is said beside the answers of a submission. Raises ``UnreadableGraph`` for what is absent."""
    said = as_object(load(path), str(path))
    return {name: field(said, name, str(path))[0] for name in SUBMITTED}


def as_challenge(found: Sequence[Answered], by: Mapping[str, Any] | None = None) -> bytes:
    """The answers as JSON in the challenge's form, abstentions left out: a list, or with `by` the object that is submitted."""
    given = [{"id": one.id, "question": one.question, "answer": one.answer} for one in found if one.answer]
    return msgspec.json.format(msgspec.json.encode(given if by is None else {**by, "results": given}))


def sheet(found: Sequence[Answered]) -> Sheet:
    """Answered and abstained by family, and over all."""
    answered, asked = Counter(one.family for one in found if one.answer), Counter(one.family for one in found)
    counted = sorted(asked, key=lambda name: (-answered[name], name))
    rows = [(name, answered[name], asked[name] - answered[name]) for name in counted]
    return Sheet(
        ("family", "answered", "abstained"), [*rows, ("all", answered.total(), asked.total() - answered.total())]
    )


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
