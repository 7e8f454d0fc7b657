"""One jurisdiction's passages: BM25 language by language, cosine where embeddings are there, mixed per corpus."""

from collections.abc import Callable, Collection, Mapping, Sequence

import numpy as np
from numpy.typing import NDArray
from rank_bm25 import BM25Okapi

from proto.rules import Passage
from services.retrieval.analysis import Analyser
from services.retrieval.corpus import Text
from services.retrieval.encoders import Vectors
from services.retrieval.tuning import BM25_HALF

Scores = NDArray[np.float64]


class _Shelf:
    """The passages of one language and their BM25."""

    def __init__(self, language: str, places: NDArray[np.intp], texts: Sequence[str]) -> None:
        self._places = places
        self._analyser = Analyser(language, texts)
        self._bm25 = BM25Okapi([self._analyser.of_passage(text) or ["-"] for text in texts])

    def score(self, words: str, scores: Scores) -> None:
        """Write the scores of these passages into those of all."""
        scores[self._places] = self._bm25.get_scores(self._analyser.of_question(words))


class Index:
    """Immutable once made; `with_rows` gives a new one."""

    def __init__(
        self, texts: Sequence[Text], rows: Vectors | None = None, shelves: Mapping[str, _Shelf] | None = None
    ) -> None:
        self.texts = tuple(texts)
        self.rows = rows
        self._shelves = _shelves(self.texts) if shelves is None else shelves

    def with_rows(self, rows: Vectors) -> "Index":
        """The same texts with their embeddings."""
        return Index(self.texts, rows, self._shelves)

    def search(
        self,
        words: str,
        vector: Vectors | None,
        *,
        keep: Callable[[Text], bool],
        lambda_for: Callable[[str], float],
        floor: float,
        limit: int,
    ) -> list[Passage]:
        """The best passages among those to keep, each provision once; without a vector by BM25 alone."""
        chosen = np.array([i for i, text in enumerate(self.texts) if keep(text)], dtype=np.intp)
        if not len(chosen):
            return []
        bm25 = normalised(self._matches(words, {self.texts[i].language for i in chosen})[chosen])
        cosine = None if vector is None or self.rows is None else (self.rows[chosen] @ vector).astype(np.float64)
        score = bm25 if cosine is None else self._mixed(chosen, bm25, stretched(cosine, floor), lambda_for)
        return self._best(chosen, score, bm25, cosine, limit)

    def _matches(self, words: str, languages: Collection[str]) -> Scores:
        scores = np.zeros(len(self.texts), dtype=np.float64)
        for language in languages:
            self._shelves[language].score(words, scores)
        return scores

    def _mixed(
        self, chosen: NDArray[np.intp], bm25: Scores, cosine: Scores, lambda_for: Callable[[str], float]
    ) -> Scores:
        weight = np.array([lambda_for(self.texts[i].corpus) for i in chosen])
        return np.asarray((1.0 - weight) * bm25 + weight * cosine, dtype=np.float64)

    def _best(
        self, chosen: NDArray[np.intp], score: Scores, bm25: Scores, cosine: Scores | None, limit: int
    ) -> list[Passage]:
        found: dict[str, Passage] = {}
        for at in np.lexsort((chosen, -score)):  # equal scores: as in the pack, so that answers repeat
            text = self.texts[chosen[at]]
            if score[at] <= 0.0 or len(found) == limit:
                break
            if text.name not in found:
                found[text.name] = _passage(text, score[at], bm25[at], None if cosine is None else cosine[at])
        return list(found.values())


def _shelves(texts: Sequence[Text]) -> dict[str, _Shelf]:
    places: dict[str, list[int]] = {}
    for place, text in enumerate(texts):
        places.setdefault(text.language, []).append(place)
    return {
        language: _Shelf(language, np.array(those, dtype=np.intp), [texts[i].indexed for i in those])
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
