"""lambda of S(q, d) = (1 - lambda) BM25 + lambda cos, per corpus and encoder; tuned by `python -m services.retrieval.tune`, stored."""

from pathlib import Path

import msgspec

PATH = Path(__file__).parent / "lambda.json"
FALLBACK = 0.5
BM25_HALF = 6.0
"""A BM25 score of this size counts as one half: b / (b + BM25_HALF) is in [0, 1) and comparable between queries."""


class Tuning(msgspec.Struct, frozen=True, kw_only=True):
    """lambda by encoder (without version) and corpus."""

    lambdas: dict[str, dict[str, float]]
    measured: dict[str, dict[str, float]] = {}
    """Mean reciprocal rank on the development queries, for the record."""

    def lambda_for(self, encoder: str, corpus: str) -> float:
        """The weight of the cosine."""
        return self.lambdas.get(encoder.partition("-")[0], {}).get(corpus, FALLBACK)


def read_tuning(path: Path = PATH) -> Tuning:
    """The stored tuning. Raises OSError or msgspec.MsgspecError: it is part of the program."""
    return msgspec.json.decode(path.read_bytes(), type=Tuning)
