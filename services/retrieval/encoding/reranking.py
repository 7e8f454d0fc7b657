"""A second look at the best passages by a cross-encoder, in bounded time: what it cannot judge soon stays in the order it had."""

import threading
from collections.abc import Sequence
from concurrent.futures import CancelledError, Future, ThreadPoolExecutor
from concurrent.futures import TimeoutError as LateError
from importlib import import_module
from pathlib import Path
from typing import Any, Protocol

from proto.rules import Passage
from services.retrieval.encoding.encoders import local_folder

CANDIDATES = 20
LATE_RERANKER = "reranker late"


class Reranker(Protocol):
    """Judges how well passages answer a question."""

    name: str

    def scores(self, question: str, passages: Sequence[str]) -> list[float]:
        """One for each passage, the higher the better."""


class CrossEncoder:
    """A sentence-transformers cross-encoder in a local folder; nothing is fetched. Needs torch (extra `retrieval-torch`)."""

    def __init__(self, folder: Path, threads: int) -> None:
        local_folder(folder, "config.json", "a sentence-transformers cross-encoder")
        transformers, torch = map(import_module, ("sentence_transformers", "torch"))
        torch.set_num_threads(threads)
        self.name = folder.name
        self._model: Any = transformers.CrossEncoder(str(folder), device="cpu", local_files_only=True)

    def scores(self, question: str, passages: Sequence[str]) -> list[float]:
        """One for each passage."""
        found = self._model.predict([(question, passage) for passage in passages], show_progress_bar=False)
        return [float(score) for score in found]


class Reranking:
    """One reranker behind one thread."""

    def __init__(self, reranker: Reranker, budget_s: float | None) -> None:
        """`budget_s`: how long an answer waits; None: as long as it takes."""
        self._reranker = reranker
        self._budget_s = budget_s
        self._busy = threading.Lock()
        self._pool = ThreadPoolExecutor(1, thread_name_prefix="reranker")

    def reranked(self, question: str, found: list[Passage]) -> tuple[list[Passage], str]:
        """The first ones in the reranker's order, and by whom, or as they were, and why. Scores stay those of the ranking."""
        if not found:
            return found, ""
        first, rest = found[:CANDIDATES], found[CANDIDATES:]
        if not self._busy.acquire(blocking=self._budget_s is None):
            return found, LATE_RERANKER
        try:
            judged = self._pool.submit(
                self._reranker.scores, question, [f"{passage.section}: {passage.excerpt}" for passage in first]
            )
        except RuntimeError:  # closed
            self._busy.release()
            return found, LATE_RERANKER
        judged.add_done_callback(self._free)
        try:
            scores = judged.result(self._budget_s)
        except (LateError, CancelledError):
            return found, LATE_RERANKER
        order = sorted(range(len(first)), key=lambda at: (-scores[at], at))
        return [first[at] for at in order] + rest, self._reranker.name

    def close(self) -> None:
        """Take no more questions."""
        self._pool.shutdown(wait=False, cancel_futures=True)

    def _free(self, _: Future[list[float]]) -> None:
        self._busy.release()
