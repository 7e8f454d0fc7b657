"""Letters from font files, as variety for training: looked for on this computer, never shipped, some held out.

The drive itself needs no font: signs are drawn with strokes of our own.
"""

from functools import lru_cache
from pathlib import Path

import cv2
import numpy as np
from PIL import Image, ImageDraw, ImageFont

from services.simulator.signart.glyphs import ALTERNATES
from services.simulator.signart.lettering import STYLES, Box, Lettering, StrokeLettering, StrokeStyle
from services.simulator.signart.painter import Colour, Painter
from services.simulator.signart.painter import Image as Picture

_CAP_PX = 80
# File stems worth learning from: upright, medium to bold, the kind of letters that stand on signs.
TRAIN_STEMS = (
    "OSP-DIN",
    "RG2014B",
    "RG2014C",
    "RG2014D",
    "RG2014EEM",
    "RG2014EM",
    "Roboto-Bold",
    "RobotoCondensed-Bold",
    "Roboto-Medium",
    "Lato-Bold",
    "Lato-Black",
    "OpenSans-Bold",
    "OpenSans-CondBold",
    "DejaVuSans-Bold",
    "DejaVuSansCondensed-Bold",
    "DejaVuSansMono-Bold",
)
TEST_STEMS = ("RG2014E", "B612-Bold", "OpenSans-Semibold", "Lato-Heavy", "RobotoCondensed-Medium", "DejaVuSans")
TEST_STYLES = (3, 7, 10)
"""Stroke styles of our own that training never sees."""
TUNE_STEMS = (
    "LiberationSans-Bold", "RG2014F", "Lato-Medium", "Roboto-Black", "RobotoCondensed-Regular", "OpenSans-ExtraBold",
)  # fmt: skip
"""Neither trained on nor tested with: thresholds are chosen on these."""
_STEMS = {"train": TRAIN_STEMS, "tune": TUNE_STEMS, "test": TEST_STEMS}
_INVENTED, _REWORKED = 120, 6


class TypeLettering:
    """Letters of one font file, perhaps made bolder (pixels more at 80 px cap height) or finer, wider or narrower."""

    def __init__(self, path: Path, bolder_px: int = 0, wider: float = 1.0) -> None:
        self.path, self._bolder_px, self._wider = path, bolder_px, wider
        self._font = ImageFont.truetype(str(path), _CAP_PX, layout_engine=ImageFont.Layout.BASIC)

    def aspect(self, text: str) -> float:
        """Width over height of the text's ink."""
        mask = self._mask(text)
        return float(self._wider * mask.shape[1] / mask.shape[0])

    def write(self, painter: Painter, text: str, box: Box, colour: Colour) -> None:
        """Stamp the text's ink into the box."""
        painter.stamp(self._mask(text), box.x, box.y, box.width, box.height, colour)

    @lru_cache(maxsize=256)  # noqa: B019  (a handful of fonts live as long as the process)
    def _mask(self, text: str) -> Picture:
        left, top, right, bottom = self._font.getbbox(text)
        edge = abs(self._bolder_px)
        picture = Image.new("L", (max(1, round(right - left)) + 2 * edge, max(1, round(bottom - top)) + 2 * edge))
        ImageDraw.Draw(picture).text((edge - left, edge - top), text, fill=255, font=self._font)
        ink = np.asarray(picture, np.uint8)
        if not edge:
            return ink
        kernel = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (2 * edge + 1, 2 * edge + 1))
        return np.asarray((cv2.dilate if self._bolder_px > 0 else cv2.erode)(ink, kernel), np.uint8)


def letterings(split: str, font_folders: tuple[Path, ...], seed: int = 0) -> dict[str, Lettering]:
    """Letterings by name for ``train``, ``tune`` or ``test``; font files that are absent are left out.

    Training also gets invented stroke styles, and each font file in a few reworked weights and widths; tuning has font
    files alone, and without any it has none.
    """
    styles = {"train": [n for n in range(len(STYLES)) if n not in TEST_STYLES], "test": list(TEST_STYLES)}.get(
        split, []
    )
    found: dict[str, Lettering] = {f"stroke-{index}": StrokeLettering(STYLES[index]) for index in styles}
    files = {path.stem: path for folder in font_folders for path in sorted(folder.rglob("*.[ot]tf"))}
    for stem in _STEMS[split]:
        if stem in files:
            found[stem] = TypeLettering(files[stem])
    return {**found, **_variety(files, np.random.default_rng([seed, 31]))} if split == "train" else found


def _variety(files: dict[str, Path], chance: np.random.Generator) -> dict[str, Lettering]:
    more: dict[str, Lettering] = {f"invented-{index}": StrokeLettering(_invented(chance)) for index in range(_INVENTED)}
    for stem in TRAIN_STEMS:
        for index in range(_REWORKED if stem in files else 0):
            weight, wider = int(chance.integers(-2, 4)), float(chance.uniform(0.75, 1.3))
            more[f"{stem}~{index}"] = TypeLettering(files[stem], weight, wider)
    return more


def _invented(chance: np.random.Generator) -> StrokeStyle:
    others = "".join(char for char in ALTERNATES if chance.random() < 0.4)
    return StrokeStyle(
        weight=float(chance.uniform(0.11, 0.24)),
        width=float(chance.uniform(0.7, 1.25)),
        gap=float(chance.uniform(0.35, 1.3)),
        slant=float(chance.choice([0.0, 0.0, 0.05, -0.03])),
        alternates=others,
    )
