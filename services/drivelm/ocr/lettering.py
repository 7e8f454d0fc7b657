"""What character recognition adds to what signs say: names on town signs, numbers on plates; each only where it is wanted."""

import math
from collections.abc import Callable

import msgspec
import numpy as np

from proto.scene import Fact
from services.drivelm.ocr.engine import Engine, available, one_thread
from services.drivelm.ocr.plate_numbers import PLATES_WITH_NUMBERS
from services.drivelm.ocr.plate_reading import PlateNumbers
from services.drivelm.ocr.town_names import MIN_TEXT_PX, TownNames
from services.drivelm.reading.crops import Picture, Region
from services.drivelm.reading.sign_tracks import SignTrack

PLATE_MARGIN = 0.1
"""Share of a plate's box added on each side: boxes are never exact."""
Key = tuple[str, int]


def load_lettering(*, names: bool, plates: bool) -> "Lettering":
    """With names of towns, numbers on plates, both or neither; neither where the recogniser is not installed."""
    if not ((names or plates) and available()):
        return Lettering()
    engine, thread = Engine(), one_thread()
    return Lettering(
        TownNames(lambda board: engine.largest_line(board, MIN_TEXT_PX), thread) if names else None,
        PlateNumbers(engine.line, thread) if plates else None,
        lambda: thread.shutdown(wait=False, cancel_futures=True),
    )


class Lettering:
    """Shows recognition what is large enough, and writes into facts what it has read by then."""

    def __init__(
        self,
        names: TownNames | None = None,
        numbers: PlateNumbers | None = None,
        close: Callable[[], None] = lambda: None,
    ) -> None:
        """`close` lets go what names and numbers are read on."""
        self._names, self._numbers, self.close = names, numbers, close

    def look(self, key: Key, track: SignTrack, picture: Picture) -> None:
        """Have the name on a believed town sign read; returns at once."""
        if self._names is None or not self._names.wants(key, track.region.height_px):
            return
        best = track.belief()
        if best.reading.startswith("town_") and track.believed(best):
            board = cut(picture, track.region, 0.0)
            if board is not None:
                self._names.ask(key, board)

    def look_at_plate(self, key: Key, track: SignTrack, picture: Picture, region: Region, stamp_ns: int) -> None:
        """Have the number on a believed plate read; returns at once."""
        if self._numbers is None:
            return
        for plate in PLATES_WITH_NUMBERS.intersection(track.plates()):
            image = cut(picture, region, PLATE_MARGIN)
            if image is not None:
                self._numbers.look(key, plate, image, stamp_ns)

    def on(self, key: Key, fact: Fact) -> Fact:
        """The fact with what was read of its sign and plates by now."""
        if self._names is not None and fact.reading.startswith("town_"):
            fact = msgspec.structs.replace(fact, text=self._names.name(key))
        if self._numbers is not None and fact.plates:
            fact = msgspec.structs.replace(fact, plates=tuple(self._numbered(key, plate) for plate in fact.plates))
        return fact

    def forget(self, key: Key) -> None:
        """A track is gone."""
        if self._numbers is not None:
            self._numbers.forget(key)

    def _numbered(self, key: Key, plate: str) -> str:
        number = self._numbers.number(key, plate) if self._numbers is not None else ""
        return f"{plate}:{number}" if number else plate


def cut(picture: Picture, region: Region, margin: float) -> Picture | None:
    """A region of a picture at its own size, with a share of it added on each side; None where it is not in the picture."""
    if not all(map(math.isfinite, region)):
        return None
    dx, dy = margin * region.width_px, margin * region.height_px
    height, width = picture.shape[:2]
    x0, x1 = (int(np.clip(round(x), 0, width)) for x in (region.x0_px - dx, region.x1_px + dx))
    y0, y1 = (int(np.clip(round(y), 0, height)) for y in (region.y0_px - dy, region.y1_px + dy))
    return picture[y0:y1, x0:x1] if x1 > x0 and y1 > y0 else None
