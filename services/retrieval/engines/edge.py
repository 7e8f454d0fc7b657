"""Qdrant inside the process, in a folder (package qdrant-edge-py): the same engine without a server, for one vehicle."""

import shutil
import threading
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from importlib import import_module
from itertools import islice
from pathlib import Path
from typing import Any

from services.retrieval.engines.stores import KEYWORDS, MEANING, NUMBERS, WORDS, Ask, Point, StoreError, conditions

BATCH = 2000


class QdrantEdge:
    """A shard for each country and state of its packs; what another state of that country left is removed."""

    def __init__(self, folder: Path) -> None:
        self._models: Any = import_module("qdrant_edge")
        self._folder = folder
        self._open: dict[str, Any] = {}
        self._lock = threading.Lock()

    def holds(self, name: str, count: int) -> bool:
        """Whether a finished shard is there, with that many points."""
        if not (self._folder / name).is_dir():
            return False
        with self._told():
            return int(self._shard(name).info().points_count) == count

    def fill(self, name: str, size: int, points: Iterable[Point]) -> None:
        """Make a shard under another name, and give it its own when it is whole."""
        models, rest, making = self._models, iter(points), self._folder / f"{name}.making"
        with self._told():
            self._remove(name)
            making.mkdir(parents=True)
            shard = models.EdgeShard.create(
                str(making),
                models.EdgeConfig(
                    vectors={MEANING: models.EdgeVectorParams(size=size, distance=models.Distance.Dot)},
                    sparse_vectors={WORDS: models.EdgeSparseVectorParams()},
                ),
            )
            for field in (*KEYWORDS, *NUMBERS):
                schema = models.PayloadSchemaType.Keyword if field in KEYWORDS else models.PayloadSchemaType.Integer
                shard.update(models.UpdateOperation.create_field_index(field, schema))
            while batch := [self._point(point) for point in islice(rest, BATCH)]:
                shard.update(models.UpdateOperation.upsert_points(batch))
            shard.optimize()
            shard.flush()
            shard.close()
            making.rename(self._folder / name)
            self._shard(name)

    def ask(self, name: str, asks: Sequence[Ask]) -> list[list[tuple[int, float]]]:
        """One batch for all."""
        with self._told():
            answers = self._shard(name).query_batch(
                self._models.QueryBatchRequest([self._request(ask) for ask in asks])
            )
        return [[(int(hit.id), float(hit.score)) for hit in answer] for answer in answers]

    def close(self) -> None:
        """Close all shards."""
        with self._lock:
            for shard in self._open.values():
                shard.close()
            self._open.clear()

    def _shard(self, name: str) -> Any:
        with self._lock:
            if name not in self._open:
                self._open[name] = self._models.EdgeShard.load(str(self._folder / name))
            return self._open[name]

    def _remove(self, name: str) -> None:
        country = name.rpartition("-")[0]
        for other in self._folder.glob(f"{country}-*"):
            with self._lock:
                if (shard := self._open.pop(other.name, None)) is not None:
                    shard.close()
            shutil.rmtree(other)

    def _point(self, point: Point) -> Any:
        indices, values = point.words
        sparse = self._models.SparseVector(indices.tolist(), values.tolist())
        return self._models.Point(point.number, {MEANING: point.meaning.tolist(), WORDS: sparse}, point.fields)

    def _request(self, ask: Ask) -> Any:
        models, must = self._models, conditions(self._models, self._models.RangeFloat, ask)
        if ask.among is not None:
            must.append(models.HasIdCondition(set(ask.among)))
        if isinstance(ask.vector, tuple):
            indices, values = ask.vector
            query: Any = models.SparseVector(indices.tolist(), values.tolist())
        else:
            query = ask.vector.tolist()
        return models.QueryRequest(
            limit=ask.limit,
            query=models.Query.Nearest(query, using=ask.using),
            filter=models.Filter(must=must),
            with_payload=False,
        )

    @contextmanager
    def _told(self) -> Iterator[None]:
        try:
            yield
        except Exception as error:  # the engine raises nothing narrower
            raise StoreError(f"Qdrant: {str(error).strip() or type(error).__name__}".splitlines()[0]) from error
