"""Names on town signs, by character recognition (`ocr`): optional, off the hot path, and silent rather than wrong.

Only text of at least 30 px is tried, so at the usual camera
sizes a name is read rarely; what is read is cleaned, is data, and decides nothing.
"""

from concurrent.futures import Executor, Future

from services.drivelm.ocr.engine import Recognise, one_thread
from services.drivelm.reading.crops import Picture
from services.drivelm.vocabulary.text import cleaned

MIN_TEXT_PX = 30.0
TEXT_SHARE = 0.26
"""Height of the name on a town sign over the height of the sign."""
MIN_SCORE = 0.85
_MAX_CHARS = 40
Key = tuple[str, int]


class TownNames:
    """Asks for a name at most once per track, in a thread of its own; answers come when they come."""

    def __init__(self, recognise: Recognise, thread: Executor | None = None) -> None:
        """`recognise` gives the largest line of text on a board, and is called on `thread` (none: one of its own)."""
        self._recognise = recognise
        self._pool = thread or one_thread()
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
        text, score = self._recognise(board)
        return plausible(text) if score >= MIN_SCORE else ""


def plausible(text: str) -> str:
    """A cleaned name of letters, or nothing."""
    name = cleaned(text, _MAX_CHARS)
    letters = sum(char.isalpha() for char in name)
    return name if letters >= 3 and all(char.isalpha() or char in " -.()'/" for char in name) else ""
