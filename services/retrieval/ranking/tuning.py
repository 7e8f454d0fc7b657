"""lambda of S(q, d) = (1 - lambda) BM25 + lambda cos, per corpus and encoder, and who judges the answers of an encoder.

Tuned by `python -m training retrieval.tune`, stored.
"""

from pathlib import Path
from typing import Any

import msgspec

from services.retrieval.ranking.judging import Judge

PATH = Path(__file__).parent / "lambda.json"
JUDGES = Path(__file__).parent / "judges.json"
FALLBACK = 0.5
BM25_ALONE = "bm25-only"
BM25_HALF = 6.0
"""A BM25 score of this size counts as one half: b / (b + BM25_HALF) is in [0, 1) and comparable between queries."""


class Tuning(msgspec.Struct, frozen=True, kw_only=True):
    """By encoder (without version; `bm25-only`) and corpus."""

    lambdas: dict[str, dict[str, float]]
    judges: dict[str, Judge] = {}
    """By encoder; an encoder that was not tuned has no judge, and answers every question."""
    measured: dict[str, dict[str, float]] = {}
    """Mean reciprocal rank on the development questions, for the record."""
    packs: dict[str, str] = {}
    """The versions, with content hashes, of the packs that all this was tuned on."""

    def lambda_for(self, encoder: str, corpus: str) -> float:
        """The weight of the cosine."""
        return self.lambdas.get(encoder.partition("-")[0], {}).get(corpus, FALLBACK)

    def judge_for(self, encoder: str) -> Judge | None:
        """By the name in an answer; None for an encoder that was not tuned."""
        return self.judges.get(BM25_ALONE if encoder.startswith(BM25_ALONE) else encoder.partition("-")[0])


def read_tuning() -> Tuning:
    """The stored tuning. Raises OSError or msgspec.MsgspecError: it is part of the program."""
    judges = msgspec.json.decode(JUDGES.read_bytes(), type=dict[str, Judge])
    return msgspec.structs.replace(msgspec.json.decode(PATH.read_bytes(), type=Tuning), judges=judges)


def write_tuning(tuning: Tuning) -> None:
    """Store it: the judges in a file of their own, as they are long."""
    alone = msgspec.to_builtins(tuning)
    JUDGES.write_bytes(_laid_out(alone.pop("judges")))
    PATH.write_bytes(msgspec.json.format(msgspec.json.encode(alone), indent=1) + b"\n")


def _laid_out(judges: dict[str, Any]) -> bytes:
    """One line a model."""
    lines = [f'"{name}": {msgspec.json.encode(judge).decode()}' for name, judge in judges.items()]
    return (
        "{\n" + ",\n".join(lines).replace('"right"', '\n"right"').replace('"scope"', '\n"scope"') + "\n}\n"
    ).encode()
