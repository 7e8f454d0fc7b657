"""Embeddings of a pack's texts: those that travel with the pack where they fit, otherwise made anew."""

import io
import os
import threading
import zipfile
from pathlib import Path

import numpy as np

from drivemcp.files.packfiles import read_regular
from services.retrieval.corpus import Text, digest
from services.retrieval.encoding.encoders import Encoder, Vectors

BATCH = 16
FOLDER = "embeddings"
MAX_BYTES = 256 << 20
"""Of the stored rows of one pack."""


def stored_path(folder: Path, encoder: str) -> Path:
    """Where a pack keeps its embeddings by an encoder (name with version)."""
    return folder / FOLDER / f"{encoder}.npz"


def read_stored(folder: Path, encoder: str, texts: tuple[Text, ...]) -> Vectors | None:
    """The stored rows, or `None` where they are missing, were made of other texts, or hold numbers that are not finite."""
    try:
        content = read_regular(stored_path(folder, encoder), MAX_BYTES)
        with np.load(io.BytesIO(content), allow_pickle=False) as stored:
            if str(stored["digest"]) != digest(texts):
                return None
            rows = np.asarray(stored["rows"], dtype=np.float32)
    except (OSError, ValueError, KeyError, EOFError, zipfile.BadZipFile):
        return None
    fits = rows.ndim == 2 and len(rows) == len(texts) and np.isfinite(rows).all()
    return unit(rows) if fits else None


def store(folder: Path, encoder: str, texts: tuple[Text, ...], rows: Vectors) -> Path:
    """Keep rows (half precision) beside the pack."""
    path = stored_path(folder, encoder)
    path.parent.mkdir(exist_ok=True)
    np.savez_compressed(path, digest=np.array(digest(texts)), rows=rows.astype(np.float16))
    return path


def embed(encoder: Encoder, texts: tuple[Text, ...]) -> Vectors:
    """Rows for all texts, in small batches so that queries get their turn; at the lowest priority of this thread.

    Raises ValueError where the encoder gives what is no numbers.
    """
    _yield_to_others()
    batches = [
        encoder.passages([text.indexed for text in texts[start : start + BATCH]])
        for start in range(0, len(texts), BATCH)
    ]
    rows = np.concatenate(batches) if batches else np.zeros((0, 1), dtype=np.float32)
    if not np.isfinite(rows).all():
        raise ValueError(f"{encoder.name} gives vectors that are no numbers")
    return unit(rows)


def unit(rows: Vectors) -> Vectors:
    """Rows of length one."""
    lengths = np.linalg.norm(rows, axis=1, keepdims=True)
    return np.asarray(rows / np.maximum(lengths, 1e-9), dtype=np.float32)


def _yield_to_others() -> None:
    if threading.current_thread() is not threading.main_thread() and hasattr(os, "setpriority"):
        os.setpriority(os.PRIO_PROCESS, threading.get_native_id(), 15)
