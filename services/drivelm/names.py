"""Names on town signs, by character recognition: optional, off the hot path, and silent rather than wrong.

Uses the PyPI package ``rapidocr`` where it is installed. Only text of at least 30 px is tried, so at the usual camera
sizes a name is read rarely; what is read is cleaned, is data, and decides nothing.
"""

from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
from importlib.util import find_spec
from typing import Any

from services.drivelm.crops import Picture
from services.drivelm.text import cleaned

MIN_TEXT_PX = 30.0
TEXT_SHARE = 0.26
"""Height of the name on a town sign over the height of the sign."""
MIN_SCORE = 0.85
_MAX_CHARS = 40
Recognise = Callable[[Picture], tuple[str, float]]
Key = tuple[str, int]


def available() -> bool:
    """Whether the recogniser is installed."""
    return find_spec("rapidocr") is not None


class TownNames:
    """Asks for a name at most once per track, in a thread of its own; answers come when they come."""

    def __init__(self, recognise: Recognise | None = None) -> None:
        self._recognise = recognise
        self._pool = ThreadPoolExecutor(max_workers=1, thread_name_prefix="names")
        self._asked: dict[Key, Future[str]] = {}

    def wants(self, key: Key, height_px: float) -> bool:
        """Whether this sign is large enough and not asked for yet."""
        return height_px * TEXT_SHARE >= MIN_TEXT_PX and key not in self._asked

    def ask(self, key: Key, board: Picture) -> None:
        """Start reading a board."""
        if len(self._asked) > 64:
            self._asked = {old: job for old, job in self._asked.items() if not job.done()}
        self._asked[key] = self._pool.submit(self._read, board.copy())

    def name(self, key: Key) -> str:
        """The name read, or nothing: not asked, not ready, or not sure."""
        job = self._asked.get(key)
        return job.result() if job is not None and job.done() and job.exception() is None else ""

    def close(self) -> None:
        """Let the thread go."""
        self._pool.shutdown(wait=False, cancel_futures=True)

    def _read(self, board: Picture) -> str:
        if self._recognise is None:
            self._recognise = _rapidocr()
        text, score = self._recognise(board)
        return plausible(text) if score >= MIN_SCORE else ""


def plausible(text: str) -> str:
    """A cleaned name of letters, or nothing."""
    name = cleaned(text, _MAX_CHARS)
    letters = sum(char.isalpha() for char in name)
    return name if letters >= 3 and all(char.isalpha() or char in " -.()'/" for char in name) else ""


def _rapidocr() -> Recognise:
    from rapidocr import RapidOCR

    engine: Any = RapidOCR(params={"EngineConfig.onnxruntime.intra_op_num_threads": 1})

    def recognise(board: Picture) -> tuple[str, float]:
        """The largest line that is found on the board."""
        found = engine(board[..., ::-1])
        if found.txts is None or found.boxes is None:
            return "", 0.0
        heights = [float(box[:, 1].max() - box[:, 1].min()) for box in found.boxes]
        best = max(range(len(heights)), key=lambda index: heights[index])
        return (found.txts[best], float(found.scores[best])) if heights[best] >= MIN_TEXT_PX else ("", 0.0)

    return recognise
