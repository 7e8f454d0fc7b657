"""The atlas of drawn sign and panel faces: square cells with hand-made mip levels, least recently used goes first."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import moderngl
import numpy as np
from numpy.typing import NDArray

from services.simulator.signart import draw_face

CELL, COLUMNS, ROWS, LEVELS = 256, 12, 10, 6


@dataclass(frozen=True, slots=True)
class FaceKey:
    """What decides a face's picture."""

    country: str
    code: str
    text: str = ""
    font: int = 0
    seed: int = 0


class FaceAtlas:
    """Face pictures in one texture."""

    def __init__(self, ctx: moderngl.Context) -> None:
        self.texture = ctx.texture((CELL * COLUMNS, CELL * ROWS), 4)
        self.texture.build_mipmaps(0, LEVELS - 1)
        self.texture.filter = (moderngl.LINEAR_MIPMAP_LINEAR, moderngl.LINEAR)
        self._cells: dict[FaceKey, int] = {}

    def box(self, key: FaceKey) -> tuple[float, float, float, float]:
        """Texture coordinates (u0, v0, u1, v1) of a face, drawn now if it is new; v0 is its lower rim."""
        if key in self._cells:
            self._cells[key] = self._cells.pop(key)  # most recently used goes last
        else:
            full = len(self._cells) >= COLUMNS * ROWS
            cell = self._cells.pop(next(iter(self._cells))) if full else len(self._cells)
            self._paint(
                cell, draw_face(key.country, key.code, text=key.text, font=key.font, size_px=CELL, seed=key.seed)
            )
            self._cells[key] = cell
        column, row = self._cells[key] % COLUMNS, self._cells[key] // COLUMNS
        return column / COLUMNS, row / ROWS, (column + 1) / COLUMNS, (row + 1) / ROWS

    def _paint(self, cell: int, picture: NDArray[np.uint8]) -> None:
        column, row = cell % COLUMNS, cell // COLUMNS
        shrink = picture.shape[0] > CELL or picture.shape[1] > CELL
        premultiplied = picture.astype(np.float32)
        premultiplied[:, :, :3] *= premultiplied[:, :, 3:] / 255.0
        image = cv2.resize(premultiplied, (CELL, CELL), interpolation=cv2.INTER_AREA if shrink else cv2.INTER_LINEAR)
        for level in range(LEVELS):
            size = CELL >> level
            part = cv2.resize(image, (size, size), interpolation=cv2.INTER_AREA)
            data = np.ascontiguousarray(part[::-1].round().clip(0, 255).astype(np.uint8))
            self.texture.write(data.tobytes(), viewport=(column * size, row * size, size, size), level=level)
