"""Reading the numbers on plates by character recognition: off the hot path, of large letters, and only what two pictures agree on."""

from concurrent.futures import Executor, Future
from typing import NamedTuple

from services.drivelm.ocr.engine import Recognise
from services.drivelm.ocr.plate_numbers import LENGTH, number_of
from services.drivelm.ocr.plate_text import Line, only_line
from services.drivelm.reading.crops import Picture

MIN_TEXT_PX = 10.0
"""Height of the letters from which a reading counts; measured, see `docs/explanation/front-end.md`."""
MIN_SCORE = 0.9
AGREEING = 2
"""Pictures that must be read the same, and none otherwise."""
MOST_ASKED = 8
"""Pictures of one plate that are tried."""
PAUSE_NS = 150_000_000
_MOST_KEPT = 64
_TEXT_SHARE = 0.3
"""Height of the letters over that of a plate, at least; a plate that is lower cannot be read."""
Key = tuple[str, int]


class Read(NamedTuple):
    """What one picture of a plate was read as (empty: nothing), and how high its letters are in it."""

    number: str = ""
    text_px: float = 0.0


def line_on(plate: str, picture: Picture) -> Line | None:
    """The line of letters on a picture of a plate of the class `plate`."""
    return only_line(picture, between_arrows=plate == LENGTH)


def read(plate: str, picture: Picture, recognise: Recognise) -> Read:
    """One picture (uint8 H x W x 3 RGB) of a plate of the class `plate`."""
    line = line_on(plate, picture)
    if line is None or line.height_px < MIN_TEXT_PX:
        return Read("", line.height_px if line is not None else 0.0)
    text, score = recognise(line.picture)
    return Read(number_of(plate, text) if score >= MIN_SCORE else "", line.height_px)


def agreed(reads: list[Read]) -> str:
    """The number that enough pictures show, if none shows another one; else nothing."""
    numbers = [each.number for each in reads if each.number]
    return numbers[0] if len(numbers) >= AGREEING and len(set(numbers)) == 1 else ""


class _Asked(NamedTuple):
    plate: str
    stamp_ns: int
    job: Future[Read]


class PlateNumbers:
    """Has plates read on a thread of their own; answers come when they come, and a tick never waits for one."""

    def __init__(self, recognise: Recognise, thread: Executor) -> None:
        self._recognise, self._thread = recognise, thread
        self._asked: dict[Key, tuple[_Asked, ...]] = {}

    def look(self, key: Key, plate: str, picture: Picture, stamp_ns: int) -> None:
        """Have a picture of a track's plate read, if that is worth it; returns at once."""
        asked = self._asked.get(key, ())
        if picture.shape[0] * _TEXT_SHARE < MIN_TEXT_PX / 2 or not _may_ask(asked, stamp_ns):
            return
        job = self._thread.submit(read, plate, picture.copy(), self._recognise)
        self._asked[key] = (*asked, _Asked(plate, stamp_ns, job))
        while len(self._asked) > _MOST_KEPT:
            del self._asked[next(iter(self._asked))]

    def number(self, key: Key, plate: str) -> str:
        """What is agreed to stand on a track's plate of this class, by now; empty: it is unread."""
        done = [each.job for each in self._asked.get(key, ()) if each.plate == plate and each.job.done()]
        return agreed([job.result() for job in done if not job.cancelled() and job.exception() is None])

    def forget(self, key: Key) -> None:
        """A track is gone."""
        for each in self._asked.pop(key, ()):
            each.job.cancel()


def _may_ask(asked: tuple[_Asked, ...], stamp_ns: int) -> bool:
    if not asked:
        return True
    last = asked[-1]
    return last.job.done() and stamp_ns - last.stamp_ns >= PAUSE_NS and len(asked) < MOST_ASKED
