"""An index whose ranking is done by an engine; what it cites are the passages that were read here, and it says when it is away."""

import itertools
import threading
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from concurrent.futures import TimeoutError as LateError
from contextlib import suppress

import numpy as np

from proto.rules import Passage
from services.retrieval.corpus import Text
from services.retrieval.encoding.encoders import Vectors
from services.retrieval.engines.stores import Ask, Point, Store, StoreError, collection, fields
from services.retrieval.engines.terms import Sparse, Terms
from services.retrieval.ranking.filters import Filter
from services.retrieval.ranking.index import EngineAway, Index, Places, normalised, shelved, stretched

WIDTH = 200
"""So many of the nearest by words, and by meaning, are candidates; of all both scores are asked for."""
RETRY_S = 5.0
MAX_PENDING = 4
"""Questions that may wait for the engine; a further one is answered without it at once."""

Hits = dict[int, float]


class Engine:
    """A store behind two threads: one fills it, one asks it, within a budget. It says what became of it."""

    def __init__(self, store: Store, budget_s: float | None, tell: Callable[[str], None] = lambda _: None) -> None:
        """`budget_s`: how long a question waits for the engine; None: as long as it takes, filling included."""
        self._store = store
        self._budget_s = budget_s
        self._tell = tell
        self._filled: set[str] = set()
        self._filling: dict[str, Future[None]] = {}
        self._again_s = 0.0
        self._lock = threading.Lock()
        self._waiting = threading.Semaphore(MAX_PENDING)
        self._fills = ThreadPoolExecutor(1, thread_name_prefix="engine-fill")
        self._asks = ThreadPoolExecutor(2, thread_name_prefix="engine")

    def index(self, texts: Sequence[Text]) -> Index:
        """The index of one country's texts; it is put into the engine when it has embeddings."""
        return ScaledIndex(texts, None, terms(texts), self)

    def require(self, index: "ScaledIndex") -> None:
        """Raises EngineAway unless the index is in the engine; sees to it that it will be."""
        with self._lock:
            if index.collection in self._filled:
                return
            filling = self._filling.get(index.collection)
            if (filling is None or filling.done()) and time.monotonic() >= self._again_s:
                filling = self._filling[index.collection] = self._fills.submit(self._fill, index)
        if self._budget_s is None and filling is not None:
            filling.result()
        if index.collection not in self._filled:
            raise EngineAway

    def ask(self, name: str, work: Callable[[Store], tuple[Hits, Hits]]) -> tuple[Hits, Hits]:
        """What `work` finds in the store, within the budget. Raises EngineAway."""
        if not self._waiting.acquire(blocking=self._budget_s is None):
            raise EngineAway
        future = self._asks.submit(work, self._store)
        future.add_done_callback(lambda _: self._waiting.release())
        try:
            return future.result(self._budget_s)
        except LateError:
            raise EngineAway from None
        except StoreError as error:
            self._gone(error, name)
            raise EngineAway from error

    def close(self) -> None:
        """Take no more questions."""
        self._fills.shutdown(wait=False, cancel_futures=True)
        self._asks.shutdown(wait=False, cancel_futures=True)
        self._store.close()

    def _fill(self, index: "ScaledIndex") -> None:
        name, count = index.collection, len(index.texts)
        try:
            if not self._store.holds(name, count):
                assert index.rows is not None
                self._store.fill(name, index.rows.shape[1], index.points())
        except StoreError as error:
            self._gone(error, name)
            return
        with self._lock:
            self._filled.add(name)
        self._tell(f"holds {count} passages of {index.texts[0].jurisdiction}")

    def _gone(self, error: StoreError, name: str) -> None:
        with self._lock:
            told = time.monotonic() < self._again_s
            self._filled.discard(name)
            self._again_s = time.monotonic() + RETRY_S
        if not told:
            self._tell(f"away, BM25 in memory answers: {error}")


class ScaledIndex(Index):
    """One country's passages in an engine; their words in memory too, for when it is away."""

    def __init__(self, texts: Sequence[Text], rows: Vectors | None, words: Mapping[str, Terms], engine: Engine) -> None:
        super().__init__(texts, rows, words)
        self._words, self._engine = words, engine
        self.collection = "" if rows is None else collection(self.texts[0].jurisdiction, self.texts, rows)
        self._memory = Index(self.texts, None, words)

    def with_rows(self, rows: Vectors) -> Index:
        """The same texts with their embeddings; the engine begins to take them up."""
        made = ScaledIndex(self.texts, rows, self._words, self._engine)
        with suppress(EngineAway):  # it is being filled, or said why not
            self._engine.require(made)
        return made

    @property
    def memory(self) -> Index:
        """BM25 without the engine."""
        return self._memory

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
        """As in memory, from the engine's candidates; without embeddings or a vector the memory does. Raises EngineAway."""
        if vector is None or self.rows is None:
            return self._memory.search(words, vector, keep=keep, lambda_for=lambda_for, floor=floor, limit=limit)
        self._engine.require(self)
        languages = {tongue.partition("/")[2] for tongue in keep.tongues} or self._words.keys()
        sparse = _joined([self._words[name].of_question(words) for name in sorted(languages) if name in self._words])
        bm25, cosine = self._engine.ask(
            self.collection, lambda store: _both(store, self.collection, sparse, vector, keep)
        )
        places = [number for number in sorted(bm25.keys() | cosine.keys()) if keep(self.texts[number])]
        if not places:
            return []
        chosen: Places = np.array(places, dtype=np.intp)
        by_words = normalised(np.array([bm25.get(number, 0.0) for number in places]))
        by_meaning = np.array([cosine.get(number, 0.0) for number in places])
        score = self.mixed(chosen, by_words, stretched(by_meaning, floor), lambda_for)
        return self.best(chosen, score, by_words, by_meaning, limit)

    def points(self) -> Iterator[Point]:
        """All passages for the engine, language by language."""
        assert self.rows is not None
        counts = {language: itertools.count() for language in self._words}
        for number, (text, row) in enumerate(zip(self.texts, self.rows, strict=True)):
            words = self._words[text.language].of_passage(next(counts[text.language]))
            yield Point(number, words, row, fields(text))


def terms(texts: Sequence[Text]) -> dict[str, Terms]:
    """The words of each language, their numbers one after the other."""
    first = 0

    def made(language: str, places: Places, words: Sequence[str]) -> Terms:
        nonlocal first
        found = Terms(language, places, words, first)
        first += len(found)
        return found

    return shelved(texts, made)


def _both(store: Store, name: str, sparse: Sparse, vector: Vectors, keep: Filter) -> tuple[Hits, Hits]:
    """The nearest by words and by meaning; of all of them both scores."""
    asks = [Ask(using="meaning", vector=vector, keep=keep, limit=WIDTH)]
    if len(sparse[0]):
        asks.append(Ask(using="words", vector=sparse, keep=keep, limit=WIDTH))
    cosine, bm25 = (dict(hits) for hits in [*store.ask(name, asks), []][:2])
    rest = []
    if lacking := frozenset(bm25.keys() - cosine.keys()):
        rest.append((cosine, Ask(using="meaning", vector=vector, keep=keep, limit=len(lacking), among=lacking)))
    if len(sparse[0]) and (lacking := frozenset(cosine.keys() - bm25.keys())):
        rest.append((bm25, Ask(using="words", vector=sparse, keep=keep, limit=len(lacking), among=lacking)))
    if rest:
        for (hits, _), more in zip(rest, store.ask(name, [ask for _, ask in rest]), strict=True):
            hits.update(more)
    return bm25, cosine


def _joined(parts: Sequence[Sparse]) -> Sparse:
    return np.concatenate([terms for terms, _ in parts]), np.concatenate([weights for _, weights in parts])
