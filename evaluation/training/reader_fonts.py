"""Letters from font files, as variety for training: looked for on this computer, never shipped, some held out.

The drive itself needs no font: signs are drawn with strokes of our own.
"""

from functools import lru_cache
from pathlib import Path

import numpy as np
from PIL import Image, ImageDraw, ImageFont

from services.simulator.signart.lettering import STYLES, Box, Lettering, StrokeLettering
from services.simulator.signart.painter import Colour, Painter
from services.simulator.signart.painter import Image as Picture

_CAP_PX = 80
# File stems worth learning from: upright, medium to bold, the kind of letters that stand on signs.
TRAIN_STEMS = (
    "OSP-DIN", "RG2014C", "RG2014D", "RG2014EM", "Roboto-Bold", "RobotoCondensed-Bold", "Lato-Bold", "OpenSans-Bold",
    "OpenSans-CondBold", "DejaVuSans-Bold", "DejaVuSansCondensed-Bold", "Roboto-Medium",
)  # fmt: skip
TEST_STEMS = ("RG2014E", "B612-Bold", "OpenSans-Semibold", "Lato-Heavy", "RobotoCondensed-Medium", "DejaVuSans")
TEST_STYLES = (3, 7, 10)
"""Stroke styles of our own that training never sees."""


class TypeLettering:
    """Letters of one font file."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self._font = ImageFont.truetype(str(path), _CAP_PX, layout_engine=ImageFont.Layout.BASIC)

    def aspect(self, text: str) -> float:
        """Width over height of the text's ink."""
        mask = self._mask(text)
        return mask.shape[1] / mask.shape[0]

    def write(self, painter: Painter, text: str, box: Box, colour: Colour) -> None:
        """Stamp the text's ink into the box."""
        painter.stamp(self._mask(text), box.x, box.y, box.width, box.height, colour)

    @lru_cache(maxsize=256)  # noqa: B019  (a handful of fonts live as long as the process)
    def _mask(self, text: str) -> Picture:
        left, top, right, bottom = self._font.getbbox(text)
        picture = Image.new("L", (max(1, round(right - left)), max(1, round(bottom - top))))
        ImageDraw.Draw(picture).text((-left, -top), text, fill=255, font=self._font)
        return np.asarray(picture, np.uint8)


def letterings(split: str, font_folders: tuple[Path, ...]) -> dict[str, Lettering]:
    """Letterings by name for ``train`` or ``test``; font files that are absent are simply fewer."""
    held_out = split == "test"
    styles = [index for index in range(len(STYLES)) if (index in TEST_STYLES) == held_out]
    found: dict[str, Lettering] = {f"stroke-{index}": StrokeLettering(STYLES[index]) for index in styles}
    files = {path.stem: path for folder in font_folders for path in sorted(folder.rglob("*.[ot]tf"))}
    for stem in TEST_STEMS if held_out else TRAIN_STEMS:
        if stem in files:
            found[stem] = TypeLettering(files[stem])
    return found
