"""Qdrant as a server, by its client (extra `retrieval-qdrant`); `:memory:` is the client's own stand-in inside the process."""

import re
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from importlib import import_module
from itertools import islice
from pathlib import Path
from typing import Any

from services.retrieval.engines.edge import QdrantEdge
from services.retrieval.engines.stores import (
    KEYWORDS,
    MEANING,
    NUMBERS,
    WORDS,
    Ask,
    Point,
    Store,
    StoreError,
    conditions,
)

BATCH = 500
IN_PROCESS = ":memory:"
TIMEOUT_S = 10
"""For filling; a question has a budget of its own."""


class QdrantServer:
    """One collection for each country and state of its packs."""

    def __init__(self, url: str, key: str | None = None) -> None:
        package = import_module("qdrant_client")
        self._models: Any = package.models
        self._refused = import_module("qdrant_client.http.exceptions").ApiException
        self._client: Any = (
            package.QdrantClient(IN_PROCESS)
            if url == IN_PROCESS
            else package.QdrantClient(
                url=url, api_key=key, timeout=TIMEOUT_S, check_compatibility=False, trust_env=False
            )
        )
        self._indexed = url != IN_PROCESS  # fields have no index inside the process, and the client warns of it

    def holds(self, name: str, count: int) -> bool:
        """Whether a collection is there, with that many points."""
        with self._told():
            return bool(self._client.collection_exists(name)) and self._client.count(name, exact=True).count == count

    def fill(self, name: str, size: int, points: Iterable[Point]) -> None:
        """Make a collection of points."""
        models, rest = self._models, iter(points)
        with self._told():
            if self._client.collection_exists(name):
                self._client.delete_collection(name)
            self._client.create_collection(
                name,
                vectors_config={MEANING: models.VectorParams(size=size, distance=models.Distance.DOT)},
                sparse_vectors_config={WORDS: models.SparseVectorParams()},
            )
            for field in (*KEYWORDS, *NUMBERS) if self._indexed else ():
                self._client.create_payload_index(name, field, "keyword" if field in KEYWORDS else "integer")
            while batch := [self._point(point) for point in islice(rest, BATCH)]:
                self._client.upsert(name, batch, wait=True)

    def ask(self, name: str, asks: Sequence[Ask]) -> list[list[tuple[int, float]]]:
        """One request for all."""
        with self._told():
            answers = self._client.query_batch_points(name, [self._request(ask) for ask in asks])
        return [[(int(hit.id), float(hit.score)) for hit in answer.points] for answer in answers]

    def close(self) -> None:
        """Close the connection."""
        self._client.close()

    def _point(self, point: Point) -> Any:
        indices, values = point.words
        sparse = self._models.SparseVector(indices=indices.tolist(), values=values.tolist())
        return self._models.PointStruct(
            id=point.number, vector={MEANING: point.meaning.tolist(), WORDS: sparse}, payload=point.fields
        )

    def _request(self, ask: Ask) -> Any:
        models, must = self._models, conditions(self._models, self._models.Range, ask)
        if ask.among is not None:
            must.append(models.HasIdCondition(has_id=sorted(ask.among)))
        if isinstance(ask.vector, tuple):
            indices, values = ask.vector
            query: Any = models.SparseVector(indices=indices.tolist(), values=values.tolist())
        else:
            query = ask.vector.tolist()
        return models.QueryRequest(
            query=query, using=ask.using, filter=models.Filter(must=must), limit=ask.limit, with_payload=False
        )

    @contextmanager
    def _told(self) -> Iterator[None]:
        try:
            yield
        except (self._refused, OSError, RuntimeError, ValueError) as error:
            raise StoreError(f"Qdrant: {str(error).strip() or type(error).__name__}".splitlines()[0]) from error


def connect(url: str, key_file: str = "") -> Store:
    """A server's (`host:port`, http://, https://), or a folder's. Raises ImportError where the packages are absent, OSError for the key."""
    if re.fullmatch(r"[\w.-]+:\d+", url):
        url = f"http://{url}"
    if url == IN_PROCESS or url.startswith(("http://", "https://")):
        return QdrantServer(url, Path(key_file).read_text(encoding="utf-8-sig").strip() if key_file else None)
    return QdrantEdge(Path(url))
