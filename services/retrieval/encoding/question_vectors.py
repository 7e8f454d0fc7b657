"""Question vectors in bounded time: what the encoder cannot give soon is answered without it, and kept for the next time."""

import threading
from collections import OrderedDict
from concurrent.futures import CancelledError, Future, ThreadPoolExecutor
from concurrent.futures import TimeoutError as LateError

import numpy as np

from services.retrieval.encoding.encoders import Encoder, Vectors

MAX_ENCODED = 256
"""Characters of a question that the encoder sees: its time grows with them, and one long question must not hold up others."""
MAX_PENDING = 4
"""Questions that may wait for the encoder; a further one is answered without it at once."""


class QuestionVectors:
    """One encoder behind one thread, with a memory of vectors."""

    def __init__(self, encoder: Encoder, budget_s: float | None, size: int) -> None:
        self.encoder = encoder
        self._budget_s = budget_s
        self._size = size
        self._known: OrderedDict[str, Vectors] = OrderedDict()
        self._pending: dict[str, Future[Vectors | None]] = {}
        self._lock = threading.Lock()
        self._closed = False
        self._pool = ThreadPoolExecutor(1, thread_name_prefix="encoder")

    def get(self, words: str) -> Vectors | None:
        """The vector of a question; None where it is not there within the budget (without one: waited for), or no numbers."""
        text = words[:MAX_ENCODED]
        with self._lock:
            if (known := self._known.get(text)) is not None:
                self._known.move_to_end(text)
                return known
            future = self._pending.get(text)
            if future is None:
                full = self._budget_s is not None and len(self._pending) >= MAX_PENDING
                if full or self._closed:
                    return None
                future = self._pending[text] = self._pool.submit(self._encode, text)
        try:
            return future.result(self._budget_s)
        except (LateError, CancelledError):
            return None

    def close(self) -> None:
        """Take no more questions; those that wait get none."""
        with self._lock:
            self._closed = True
        self._pool.shutdown(wait=False, cancel_futures=True)

    def _encode(self, text: str) -> Vectors | None:
        try:
            vector = self.encoder.query(text)
            if not np.isfinite(vector).all():
                return None
            with self._lock:
                self._known[text] = vector
                while len(self._known) > self._size:
                    self._known.popitem(last=False)
            return vector
        finally:
            with self._lock:
                self._pending.pop(text, None)
