"""All indexed packs: chooses the jurisdiction before ranking, asks the encoder, remembers repeats."""

import threading
from collections import OrderedDict
from collections.abc import Callable, Collection, Mapping, Sequence
from pathlib import Path
from typing import Literal

import msgspec

from proto.rules import Passage, Retrieved
from services.retrieval.corpus import CorpusError, Text, read_pack
from services.retrieval.encoding.embeddings import embed, read_stored
from services.retrieval.encoding.encoders import Encoder, Vectors
from services.retrieval.encoding.question_vectors import QuestionVectors
from services.retrieval.encoding.reranking import CANDIDATES, LATE_RERANKER, Reranking
from services.retrieval.ranking.everyday import Matter, alone_in, law_words, matters_in, names_a_sign
from services.retrieval.ranking.filters import Filter
from services.retrieval.ranking.index import EngineAway, Index
from services.retrieval.ranking.judging import LOOKED_AT, Facts, observed
from services.retrieval.ranking.tuning import Tuning

LOADING, ABSENT, OFF = "bm25-only (loading)", "bm25-only (not installed)", "bm25-only (switched off)"
LATE, AWAY = "bm25-only (encoder late)", "bm25-only (engine away)"
PASSING = (LATE, AWAY)
"""What may be otherwise the next time: such answers are not remembered."""
FALLBACK = "XXX"
"""The country of the pack that speaks where a country has none of its own."""
Wanted = Literal["statutes", "signs", "all"]


class Request(msgspec.Struct, frozen=True, kw_only=True):
    """One question to the library."""

    query: str
    jurisdiction: str | None = None
    corpus: Wanted = "all"
    language: str | None = None
    road_context: str = ""
    road_type: str | None = None
    on: str = ""
    k: int = 5

    @property
    def words(self) -> str:
        """What is searched for."""
        return f"{self.query} {self.road_context}".strip()

    @property
    def spoken(self) -> str:
        """The language in two letters; empty: none is named."""
        return (self.language or "")[:2].lower()


class State(msgspec.Struct, frozen=True):
    """Swapped as a whole, so that a search never sees half of it."""

    indexes: dict[str, Index]
    vectors: QuestionVectors | None
    status: str


class Library:
    """Searchable at once by BM25; by both once `use` has been given an encoder."""

    def __init__(
        self,
        folders: tuple[Path, ...],
        tuning: Tuning,
        *,
        status: str,
        cache_size: int = 512,
        budget_s: float | None = None,
        index: Callable[[Sequence[Text]], Index] = Index,
        reranking: Reranking | None = None,
    ) -> None:
        """`budget_s`: how long a question waits for the encoder before BM25 answers alone; None: as long as it takes.

        `index`: what ranks the texts of one country.
        """
        self._index = index
        self._reranking = reranking
        self._folders = folders
        self._why: dict[Path, str] = {}
        self.packs = self._read(folders, {})
        self._tuning = tuning
        self._state = State({j: index(texts) for j, texts in _by_jurisdiction(self.packs).items()}, None, status)
        self._cache: OrderedDict[Request, Retrieved] = OrderedDict()
        self._cache_size = cache_size
        self._budget_s = budget_s
        self._lock = threading.Lock()
        self.hits = 0

    @property
    def refused(self) -> list[str]:
        """Why folders cannot be indexed as they are now."""
        return list(self._why.values())

    @property
    def status(self) -> str:
        """The encoder in use, or why there is no encoder."""
        return self._state.status

    def give_up(self, status: str) -> None:
        """Stay with BM25, and say why."""
        self._swap(State(self._state.indexes, None, status))

    def use(self, encoder: Encoder) -> None:
        """Take stored embeddings or make them (slow), then rank by both."""
        indexes = _embedded(encoder, self.packs, self._state.indexes, {})
        self._swap(State(indexes, QuestionVectors(encoder, self._budget_s, self._cache_size), encoder.name))

    def tune(self, tuning: Tuning) -> None:
        """Rank by other weights from now on."""
        self._tuning = tuning
        self._swap(self._state)

    def reload(self, changed: Collection[Path]) -> list[str]:
        """Read changed folders again, embed what is new (slow), and swap; searches go on meanwhile as before.

        Returns why some cannot be used; what was read from them before stays. Not at the same time as `use`.
        """
        packs = self._read(changed, self.packs)
        if packs != self.packs:
            old = self._state
            indexes = {j: self._index(texts) for j, texts in _by_jurisdiction(packs).items()}
            if old.vectors is not None:
                known = {
                    text.indexed: index.rows[at]
                    for index in old.indexes.values()
                    if index.rows is not None
                    for at, text in enumerate(index.texts)
                }
                indexes = _embedded(old.vectors.encoder, packs, indexes, known)
            self.packs = packs
            self._swap(State(indexes, old.vectors, old.status))
        return [self._why[folder] for folder in changed if folder in self._why]

    def search(self, request: Request) -> Retrieved:
        """The best passages of the jurisdiction, or of all where none is named; repeats come from memory."""
        with self._lock:
            if (known := self._cache.get(request)) is not None:
                self._cache.move_to_end(request)
                self.hits += 1
                return known
        state = self._state
        found = self._search(state, request)
        with self._lock:
            if state is self._state and found.encoder not in PASSING and found.reranker != LATE_RERANKER:
                self._cache[request] = found
                while len(self._cache) > self._cache_size:
                    self._cache.popitem(last=False)
        return found

    def observe(self, request: Request) -> tuple[Facts, Vectors | None]:
        """What the judge of an answer looks at."""
        state = self._state
        vector = state.vectors.get(for_encoder(request.words)) if state.vectors else None
        return _facts(state, request, self._ranked(state, request, request.words, vector)), vector

    def _search(self, state: State, request: Request) -> Retrieved:
        words = request.words
        vector = state.vectors.get(for_encoder(words)) if state.vectors and words else None
        status = LATE if state.vectors is not None and vector is None and words else state.status
        try:
            found = self._ranked(state, request, words, vector)
        except EngineAway:
            vector, status = None, AWAY
            found = self._ranked(state, request, words, None)
        named = "signs" if request.corpus == "signs" else "statutes"
        lambda_ = self._tuning.lambda_for(state.status, named) if vector is not None else 0.0
        judge, confidence = self._tuning.judge_for(state.status if vector is not None else LATE), None
        if judge is not None:
            facts = _facts(state, request, found)
            scoped = judge.scoped(facts, vector)
            if scoped < judge.line or _unspoken(_asked(state, request), found, words):
                return Retrieved(passages=(), encoder=status, lambda_=lambda_, out_of_scope=True, confidence=0.0)
            confidence = judge.confidence(facts, scoped) if found else 0.0
        reranker = ""
        if self._reranking is not None:
            found, reranker = self._reranking.reranked(words, found)
        return Retrieved(
            passages=tuple(found[: request.k]),
            encoder=status,
            lambda_=lambda_,
            reranker=reranker,
            confidence=None if reranker not in ("", LATE_RERANKER) else confidence,
        )

    def _ranked(self, state: State, request: Request, words: str, vector: Vectors | None) -> list[Passage]:
        """The best passages of the country asked about; without a vector by BM25 in memory. Raises EngineAway."""
        indexes = _asked(state, request)
        found = [passage for index in indexes for passage in self._ranked_in(state, index, request, words, vector)]
        if request.corpus == "all" and names_a_sign(words):
            found = [_moved(passage, SIGN_LEAD) if passage.kind == "sign_table" else passage for passage in found]
        if alone := alone_in(words):
            found = [passage if _speaks(indexes, passage, alone) else _moved(passage, -ALONE_LEAD) for passage in found]
        wanted = max(request.k, LOOKED_AT if self._reranking is None else CANDIDATES)
        ordered = sorted(found, key=lambda passage: (-passage.score, passage.passage_id))
        once = {passage.passage_id: passage for passage in reversed(ordered)}
        return list(once.values())[::-1][: wanted * len(indexes)]

    def _ranked_in(
        self, state: State, index: Index, request: Request, words: str, vector: Vectors | None
    ) -> list[Passage]:
        corpus = None if request.corpus == "all" else request.corpus
        return (index.memory if vector is None else index).search(
            words,
            vector,
            keep=Filter(
                corpus=corpus,
                tongues=index.tongues(request.spoken),
                road_type=request.road_type,
                on=request.on,
            ),
            lambda_for=lambda corpus: self._tuning.lambda_for(state.status, corpus),
            floor=state.vectors.encoder.floor if state.vectors else 0.0,
            limit=max(request.k, LOOKED_AT if self._reranking is None else CANDIDATES) + BEHIND,
        )

    def _read(self, folders: Collection[Path], before: Mapping[Path, tuple[Text, ...]]) -> dict[Path, tuple[Text, ...]]:
        packs = dict(before)
        for folder in folders:
            self._why.pop(folder, None)
            try:
                packs[folder] = _alone(folder, read_pack(folder), packs)
            except CorpusError as error:
                self._why[folder] = str(error)
        return {folder: packs[folder] for folder in self._folders if folder in packs}

    def take(self, state: State) -> None:
        """Rank by other indexes from now on."""
        self._swap(state)

    def _swap(self, state: State) -> None:
        with self._lock:
            old, self._state = self._state, state
            self._cache.clear()
        if old.vectors is not None and old.vectors is not state.vectors:
            old.vectors.close()

    def close(self) -> None:
        """Take no more questions to the encoder and the reranker."""
        if self._reranking is not None:
            self._reranking.close()
        if (vectors := self._state.vectors) is not None:
            vectors.close()


def for_encoder(words: str) -> str:
    """A question with the law's words for its matters, in English: the encoders know no brands and little dialect."""
    return f"{words} {law_words(words, 'en')}".strip()


BEHIND = 10
"""So many passages more are ranked than are asked for: a sign's entry may come from behind."""
SIGN_LEAD = 0.05
"""Added to the score of a sign's own entry where the question names a sign: statutes on a matter have more of its words."""
ALONE_LEAD = 0.15
"""Taken from the score of passages that do not speak of what only such a passage answers (`alone` in the table of everyday words)."""


def _moved(passage: Passage, by: float) -> Passage:
    return msgspec.structs.replace(passage, score=min(max(passage.score + by, 0.0), 1.0))


def _speaks(indexes: Sequence[Index], passage: Passage, alone: Sequence[Matter]) -> bool:
    """Whether a passage speaks of one of these matters."""
    texts = (index.by_id[passage.passage_id].of_the_law for index in indexes if passage.passage_id in index.by_id)
    return any(matter.is_in(text) for text in texts for matter in alone)


def _unspoken(indexes: Sequence[Index], found: Sequence[Passage], words: str) -> bool:
    """Whether a question has a matter that stands alone and none of the best passages speaks of one: this law says nothing on it."""
    alone = alone_in(words)
    return bool(alone) and not any(_speaks(indexes, passage, alone) for passage in found[:LOOKED_AT])


def _asked(state: State, request: Request) -> list[Index]:
    """The index of the part of the country, else of the country, else of all its parts; else of the conventions.

    Where nothing is known of the country, all.
    """
    place = (request.jurisdiction or "").upper()
    if not place:
        return list(state.indexes.values())
    own = next((state.indexes[code] for code in (place, place[:3]) if code in state.indexes), None)
    parts = [index for code, index in state.indexes.items() if code.startswith(f"{place[:3]}-")]
    return [own] if own is not None else parts or [state.indexes[code] for code in (FALLBACK,) if code in state.indexes]


def _facts(state: State, request: Request, found: Sequence[Passage]) -> Facts:
    shares = (index.known_share(request.words, request.spoken) for index in _asked(state, request))
    return observed(found, max(shares, default=0.0), matters_in(request.words))


def _alone(folder: Path, texts: tuple[Text, ...], others: Mapping[Path, tuple[Text, ...]]) -> tuple[Text, ...]:
    """The texts, unless another folder's pack has their names, which distinguish passages. Raises CorpusError."""
    pack = {text.pack for text in texts}
    first = next((f for f, known in others.items() if f != folder and pack & {text.pack for text in known}), None)
    if first is not None:
        raise CorpusError(f"{folder / 'manifest.json'}: id: {', '.join(pack)} is already the pack in {first}")
    return texts


def _by_jurisdiction(packs: Mapping[Path, tuple[Text, ...]]) -> dict[str, list[Text]]:
    """Texts by country, and by part of one with those of its country that the part's do not replace.

    A later pack's text replaces one of the same name and language of an earlier one.
    """
    found: dict[str, dict[tuple[str, str], Text]] = {}
    for texts in packs.values():
        for text in texts:
            found.setdefault(text.jurisdiction, {})[(text.name, text.language)] = text
    return {place: [*_inherited(found, place), *texts.values()] for place, texts in found.items()}


def _inherited(found: Mapping[str, Mapping[tuple[str, str], Text]], place: str) -> list[Text]:
    own = found[place]
    gone = {name for text in own.values() for name in (text.name, *text.replaces)}
    above = found.get(place[:3], {}) if place[:3] != place else {}
    return [text for text in above.values() if text.name not in gone]


def _embedded(
    encoder: Encoder, packs: Mapping[Path, tuple[Text, ...]], indexes: Mapping[str, Index], known: Mapping[str, Vectors]
) -> dict[str, Index]:
    """The indexes with a row for every text: known by its words, stored with its pack, or made now."""
    rows: dict[str, Vectors] = {}
    for folder, texts in packs.items():
        missing = tuple(text for text in texts if text.indexed not in known)
        stored = read_stored(folder, encoder.name, texts) if missing else None
        found = known
        if stored is None and missing:
            made = embed(encoder, missing)
            found = {**known, **{text.indexed: row for text, row in zip(missing, made, strict=True)}}
        for at, text in enumerate(texts):
            rows[text.passage_id] = found[text.indexed] if stored is None else stored[at]
    return {j: index.with_rows(_stack(rows, index)) for j, index in indexes.items()}


def _stack(rows: dict[str, Vectors], index: Index) -> Vectors:
    import numpy as np

    return np.stack([rows[text.passage_id] for text in index.texts])
