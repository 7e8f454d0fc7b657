"""The words of one language's passages as sparse vectors: the dot product with a question's is its Okapi BM25.

The same numbers as rank-bm25's, so that an engine that multiplies sparse vectors ranks as the index in memory does; held by
term, so that a question reads only the passages that have its words.
"""

import math
from array import array
from collections import Counter
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from services.retrieval.ranking.analysis import Analyser

K1, B, EPSILON = 1.5, 0.75, 0.25
"""rank-bm25's defaults; EPSILON: share of the mean weight that a term in more than half of the passages gets."""
NO_WORDS = ("-",)

Sparse = tuple[NDArray[np.uint32], NDArray[np.float32]]


class Terms:
    """Immutable once made; `first` is the number of its first term, so that languages share one space of terms."""

    def __init__(self, language: str, places: NDArray[np.intp], texts: Sequence[str], first: int = 0) -> None:
        self._places = places
        self._analyser = Analyser(language, texts)
        self._numbers: dict[str, int] = {}
        self._first = first
        self._starts, self._terms, self._values = self._weighed(texts)
        self._weights = self._rarities(len(texts))
        self._by_term, self._postings = self._turned()

    def __len__(self) -> int:
        return len(self._numbers)

    def of_passage(self, at: int) -> Sparse:
        """The passage at a place of this language."""
        here = slice(self._starts[at], self._starts[at + 1])
        return self._terms[here] + np.uint32(self._first), self._values[here]

    def of_question(self, words: str) -> Sparse:
        """Its known terms; empty without any."""
        counts = self._counted(words)
        terms = np.fromiter(counts, dtype=np.uint32, count=len(counts))
        repeats = np.fromiter(counts.values(), dtype=np.float32, count=len(counts))
        return terms + np.uint32(self._first), self._weights[terms] * repeats

    def score(self, words: str, scores: NDArray[np.float64]) -> None:
        """Add the scores of these passages to those of all."""
        for term, repeats in self._counted(words).items():
            entries = self._postings[self._by_term[term] : self._by_term[term + 1]]
            scores[self._places[self._passage_of[entries]]] += self._values[entries] * (self._weights[term] * repeats)

    def known_share(self, words: str) -> float:
        """See `Analyser.known_share`."""
        return self._analyser.known_share(words)

    def _counted(self, words: str) -> Counter[int]:
        return Counter(self._numbers[term] for term in self._analyser.of_question(words) if term in self._numbers)

    def _weighed(self, texts: Sequence[str]) -> tuple[NDArray[np.int64], NDArray[np.uint32], NDArray[np.float32]]:
        numbers, terms, counts, sizes, lengths = self._numbers, array("I"), array("I"), array("I"), array("I")
        for text in texts:
            found = Counter(self._analyser.of_passage(text) or NO_WORDS)
            terms.extend([numbers.setdefault(term, len(numbers)) for term in found])
            counts.extend(found.values())
            sizes.append(len(found))
            lengths.append(found.total())
        size, length = np.asarray(sizes, dtype=np.int64), np.asarray(lengths, dtype=np.float64)
        starts = np.concatenate(([0], np.cumsum(size)))
        damped = np.repeat(K1 * (1 - B + B * length / length.mean()), size)
        count = np.asarray(counts, dtype=np.float64)
        values = (count * (K1 + 1) / (count + damped)).astype(np.float32)
        self._passage_of = np.repeat(np.arange(len(texts), dtype=np.uint32), size)
        return starts, np.asarray(terms, dtype=np.uint32), values

    def _rarities(self, passages: int) -> NDArray[np.float32]:
        having = np.bincount(self._terms, minlength=len(self._numbers)).astype(np.float64)
        rarity = np.log(passages - having + 0.5) - np.log(having + 0.5)
        mean = math.fsum(rarity) / len(rarity)
        return np.where(rarity < 0, EPSILON * mean, rarity).astype(np.float32)

    def _turned(self) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
        """Where each term's entries begin, and the entries ordered by term."""
        order = np.argsort(self._terms, kind="stable")
        begins = np.searchsorted(self._terms[order], np.arange(len(self._numbers) + 1))
        return begins, order
