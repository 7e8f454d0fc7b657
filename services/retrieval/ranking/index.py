"""One jurisdiction's passages: BM25 language by language, cosine where embeddings are there, mixed per corpus."""

from collections.abc import Callable, Collection, Mapping, Sequence
from typing import Protocol, TypeVar

import numpy as np
from numpy.typing import NDArray
from rank_bm25 import BM25Okapi

from drivemcp.errors import DriveMcpError
from proto.rules import Passage
from services.retrieval.corpus import Text
from services.retrieval.encoding.encoders import Vectors
from services.retrieval.ranking.analysis import Analyser
from services.retrieval.ranking.filters import Filter
from services.retrieval.ranking.tuning import BM25_HALF

Scores = NDArray[np.float64]
Places = NDArray[np.intp]
S = TypeVar("S")

DEEP = 1000
"""So many of the best are put in order; each provision once is sure to be among them."""


class EngineAway(DriveMcpError, ConnectionError):
    """The engine behind an index does not answer now, or not in time; `memory` does."""


class Shelf(Protocol):
    """The passages of one language."""

    def score(self, words: str, scores: Scores) -> None:
        """Write the scores of these passages into those of all, which are 0 before."""

    def known_share(self, words: str) -> float:
        """How much of a question is in words of these passages: 0 to 1."""


class _Bm25:
    """The passages of one language and their BM25."""

    def __init__(self, language: str, places: Places, texts: Sequence[str]) -> None:
        self._places = places
        self._analyser = Analyser(language, texts)
        self._bm25 = BM25Okapi([self._analyser.of_passage(text) or ["-"] for text in texts])

    def score(self, words: str, scores: Scores) -> None:
        """Write the scores of these passages into those of all."""
        scores[self._places] = self._bm25.get_scores(self._analyser.of_question(words))

    def known_share(self, words: str) -> float:
        """See `Analyser.known_share`."""
        return self._analyser.known_share(words)


class Index:
    """Immutable once made; `with_rows` gives a new one."""

    def __init__(
        self, texts: Sequence[Text], rows: Vectors | None = None, shelves: Mapping[str, Shelf] | None = None
    ) -> None:
        self.texts = tuple(texts)
        self.rows = rows
        self.shelves = shelved(self.texts, _Bm25) if shelves is None else shelves
        self.by_id = {text.passage_id: text for text in self.texts}
        self._kinds, self._kind_of = _kinds(self.texts)

    def with_rows(self, rows: Vectors) -> "Index":
        """The same texts with their embeddings."""
        return Index(self.texts, rows, self.shelves)

    @property
    def memory(self) -> "Index":
        """What answers by BM25 where an engine does not: without an engine, the index itself."""
        return self

    def tongues(self, language: str) -> frozenset[str]:
        """The tongues to search for a question in a language: of each corpus that one, or all where it has none in it."""
        every = {text.tongue: text for text in self._kinds}
        spoken = {text.corpus for text in every.values() if text.language == language}
        return frozenset(name for name, text in every.items() if text.corpus not in spoken or text.language == language)

    def known_share(self, words: str, language: str) -> float:
        """How much of a question is in words of the passages of its language; of any language, where its own has no passages."""
        shelves = [self.shelves[language]] if language in self.shelves else self.shelves.values()
        return max((shelf.known_share(words) for shelf in shelves), default=0.0)

    def search(
        self,
        words: str,
        vector: Vectors | None,
        *,
        keep: Filter,
        lambda_for: Callable[[str], float],
        floor: float,
        limit: int,
    ) -> list[Passage]:
        """The best passages among those to keep, each provision once; without a vector by BM25 alone."""
        chosen = self._kept(keep)
        if not len(chosen):
            return []
        bm25 = normalised(self._matches(words, {text.language for text in self._kinds if keep(text)})[chosen])
        cosine = None if vector is None or self.rows is None else self._cosines(chosen, vector)
        score = bm25 if cosine is None else self.mixed(chosen, bm25, stretched(cosine, floor), lambda_for)
        return self.best(chosen, score, bm25, cosine, limit)

    def _kept(self, keep: Filter) -> Places:
        return np.flatnonzero(np.array([keep(text) for text in self._kinds], dtype=bool)[self._kind_of])

    def _matches(self, words: str, languages: Collection[str]) -> Scores:
        scores = np.zeros(len(self.texts), dtype=np.float64)
        for language in languages:
            self.shelves[language].score(words, scores)
        return scores

    def _cosines(self, chosen: Places, vector: Vectors) -> Scores:
        assert self.rows is not None
        rows = self.rows if len(chosen) == len(self.rows) else self.rows[chosen]
        # rows and vector are finite and of length one, and so is what comes out; BLAS may raise the flag all the same
        with np.errstate(invalid="ignore"):
            return (rows @ vector).astype(np.float64)

    def mixed(self, chosen: Places, bm25: Scores, cosine: Scores, lambda_for: Callable[[str], float]) -> Scores:
        """The paper's score of the passages at these places."""
        weight = np.array([lambda_for(text.corpus) for text in self._kinds])[self._kind_of[chosen]]
        return np.asarray((1.0 - weight) * bm25 + weight * cosine, dtype=np.float64)

    def best(self, chosen: Places, score: Scores, bm25: Scores, cosine: Scores | None, limit: int) -> list[Passage]:
        """The passages at the best of these places, each provision once."""
        found: dict[str, Passage] = {}
        for at in _ordered(chosen, score):
            text = self.texts[chosen[at]]
            if score[at] <= 0.0 or len(found) == limit:
                break
            if text.name not in found:
                found[text.name] = _passage(text, score[at], bm25[at], None if cosine is None else cosine[at])
        return list(found.values())


def _kinds(texts: Sequence[Text]) -> tuple[list[Text], Places]:
    """One text of each kind that a filter distinguishes, and each text's kind: filters look at few texts, not at all of them."""
    kinds: dict[object, int] = {}
    first: list[Text] = []
    kind_of = np.empty(len(texts), dtype=np.intp)
    for place, text in enumerate(texts):
        kind = kinds.setdefault((text.language, text.corpus, text.road_types, text.effective), len(kinds))
        if kind == len(first):
            first.append(text)
        kind_of[place] = kind
    return first, kind_of


def _ordered(chosen: Places, score: Scores) -> Places:
    """The best first, as places among the chosen; equal scores as in the pack, so that answers repeat."""
    if len(score) <= DEEP:
        return np.lexsort((chosen, -score))
    deep = np.flatnonzero(score >= np.partition(score, -DEEP)[-DEEP])
    return np.asarray(deep[np.lexsort((chosen[deep], -score[deep]))], dtype=np.intp)


def shelved(texts: Sequence[Text], make: Callable[[str, Places, Sequence[str]], S]) -> dict[str, S]:
    """A shelf for each language, of the places and words of its passages."""
    places: dict[str, list[int]] = {}
    for place, text in enumerate(texts):
        places.setdefault(text.language, []).append(place)
    return {
        language: make(language, np.array(those, dtype=np.intp), [texts[i].indexed for i in those])
        for language, those in places.items()
    }


def normalised(bm25: Scores) -> Scores:
    """BM25 scores into [0, 1), the same way for every query."""
    positive = np.maximum(bm25, 0.0)
    return np.asarray(positive / (positive + BM25_HALF), dtype=np.float64)


def stretched(cosine: Scores, floor: float) -> Scores:
    """Cosines from the encoder's floor to 1 onto 0 to 1."""
    return np.asarray(np.clip((cosine - floor) / (1.0 - floor), 0.0, 1.0), dtype=np.float64)


def _passage(text: Text, score: float, bm25: float, cosine: float | None) -> Passage:
    return Passage(
        passage_id=text.passage_id,
        document=text.document,
        start=text.start,
        end=text.end,
        excerpt=text.excerpt,
        section=text.section,
        kind=text.kind,
        score=float(score),
        bm25=float(bm25),
        cosine=None if cosine is None else float(cosine),
        rulepack_version=text.rulepack_version,
    )
