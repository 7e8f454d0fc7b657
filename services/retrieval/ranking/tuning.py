"""lambda of S(q, d) = (1 - lambda) BM25 + lambda cos, per corpus and encoder, and the line below which nothing is answered.

Tuned by `python -m training retrieval.tune`, stored.
"""

from pathlib import Path

import msgspec

PATH = Path(__file__).parent / "lambda.json"
FALLBACK = 0.5
BM25_ALONE = "bm25-only"
BM25_HALF = 6.0
"""A BM25 score of this size counts as one half: b / (b + BM25_HALF) is in [0, 1) and comparable between queries."""


class Tuning(msgspec.Struct, frozen=True, kw_only=True):
    """By encoder (without version; `bm25-only`) and corpus."""

    lambdas: dict[str, dict[str, float]]
    refuse_below: dict[str, float] = {}
    """Score of the best passage from which on a question is taken to be about traffic law."""
    measured: dict[str, dict[str, float]] = {}
    """Mean reciprocal rank on the development questions, for the record."""
    packs: dict[str, str] = {}
    """The versions, with content hashes, of the packs that all this was tuned on."""

    def lambda_for(self, encoder: str, corpus: str) -> float:
        """The weight of the cosine."""
        return self.lambdas.get(encoder.partition("-")[0], {}).get(corpus, FALLBACK)

    def line_for(self, encoder: str) -> float:
        """What the best passage must score for an answer; 0 for an encoder that nobody tuned."""
        name = BM25_ALONE if encoder.startswith(BM25_ALONE) else encoder.partition("-")[0]
        return self.refuse_below.get(name, 0.0)


def read_tuning(path: Path = PATH) -> Tuning:
    """The stored tuning. Raises OSError or msgspec.MsgspecError: it is part of the program."""
    return msgspec.json.decode(path.read_bytes(), type=Tuning)
