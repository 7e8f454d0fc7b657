"""What character recognition adds to what signs say: names on town signs, where that is wanted."""

import math
from collections.abc import Callable

import msgspec
import numpy as np

from proto.scene import Fact
from services.drivelm.crops import Picture, Region
from services.drivelm.names import MIN_TEXT_PX, TownNames
from services.drivelm.ocr import Engine, available, one_thread
from services.drivelm.tracks import SignTrack

Key = tuple[str, int]


def load_lettering(*, names: bool) -> "Lettering":
    """With names of towns, where the recogniser is installed."""
    if not (names and available()):
        return Lettering()
    engine, thread = Engine(), one_thread()
    return Lettering(
        TownNames(lambda board: engine.largest_line(board, MIN_TEXT_PX), thread),
        lambda: thread.shutdown(wait=False, cancel_futures=True),
    )


class Lettering:
    """Shows recognition what is large enough, and writes into facts what it has read by then."""

    def __init__(
        self,
        names: TownNames | None = None,
        close: Callable[[], None] = lambda: None,
    ) -> None:
        """`close` lets go what names are read on."""
        self._names, self.close = names, close

    def look(self, key: Key, track: SignTrack, picture: Picture) -> None:
        """Have the name on a believed town sign read; returns at once."""
        if self._names is None or not self._names.wants(key, track.region.height_px):
            return
        best = track.belief()
        if best.reading.startswith("town_") and track.believed(best):
            board = cut(picture, track.region)
            if board is not None:
                self._names.ask(key, board)

    def on(self, key: Key, fact: Fact) -> Fact:
        """The fact with what was read of its sign and plates by now."""
        if self._names is not None and fact.reading.startswith("town_"):
            fact = msgspec.structs.replace(fact, text=self._names.name(key))
        return fact


def cut(picture: Picture, region: Region) -> Picture | None:
    """A region of a picture at its own size; None where it is not in the picture."""
    if not all(map(math.isfinite, region)):
        return None
    height, width = picture.shape[:2]
    x0, x1 = (int(np.clip(round(x), 0, width)) for x in (region.x0_px, region.x1_px))
    y0, y1 = (int(np.clip(round(y), 0, height)) for y in (region.y0_px, region.y1_px))
    return picture[y0:y1, x0:x1] if x1 > x0 and y1 > y0 else None
