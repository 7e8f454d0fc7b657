"""A small anti-aliased painter: shapes in the face's own units onto an RGBA picture."""

from collections.abc import Sequence

import cv2
import numpy as np
from numpy.typing import NDArray

Point = tuple[float, float]
Colour = tuple[int, int, int]
Image = NDArray[np.uint8]

_OVERSAMPLE = 4
_SHIFT = 4  # fractional bits of OpenCV's fixed-point coordinates


class Painter:
    """Draws on a face ``width`` x ``height`` in its own units (x right, y down, origin top left).

    The picture is drawn four times too large and averaged down, so edges are smooth at any size.
    Everything outside the drawn shapes stays transparent.
    """

    def __init__(self, width: float, height: float, size_px: int) -> None:
        self.width, self.height = width, height
        self._scale = size_px * _OVERSAMPLE / max(width, height)
        longer = max(width, height)
        self._shape_px = (max(1, round(size_px * height / longer)), max(1, round(size_px * width / longer)))
        self._rgb = np.zeros((self._shape_px[0] * _OVERSAMPLE, self._shape_px[1] * _OVERSAMPLE, 3), np.uint8)
        self._alpha = np.zeros(self._rgb.shape[:2], np.uint8)

    def polygon(self, points: Sequence[Point], colour: Colour) -> None:
        """Fill a closed polygon."""
        fixed = self._fixed(points)
        cv2.fillPoly(self._rgb, [fixed], colour, cv2.LINE_8, _SHIFT)
        cv2.fillPoly(self._alpha, [fixed], 255, cv2.LINE_8, _SHIFT)

    def disc(self, centre: Point, radius: float, colour: Colour) -> None:
        """Fill a circle."""
        self.ellipse(centre, radius, radius, colour)

    def ellipse(self, centre: Point, radius_x: float, radius_y: float, colour: Colour) -> None:
        """Fill an upright ellipse."""
        angles = np.linspace(0.0, 2 * np.pi, 96, endpoint=False)
        (x, y), turns = centre, [(float(np.cos(a)), float(np.sin(a))) for a in angles]
        self.polygon([(x + radius_x * c, y + radius_y * s) for c, s in turns], colour)

    def rounded(self, x: float, y: float, width: float, height: float, radius: float, colour: Colour) -> None:
        """Fill a rectangle with rounded corners."""
        radius = min(radius, width / 2, height / 2)
        corners = (
            (x + width - radius, y + radius, -90),
            (x + width - radius, y + height - radius, 0),
            (x + radius, y + height - radius, 90),
            (x + radius, y + radius, 180),
        )
        points = []
        for cx, cy, start in corners:
            for step in range(7):
                angle = np.radians(start + 15 * step)
                points.append((cx + radius * float(np.cos(angle)), cy + radius * float(np.sin(angle))))
        self.polygon(points, colour)

    def stroke(self, points: Sequence[Point], width: float, colour: Colour, *, flat: bool = False) -> None:
        """Draw a line through points, ``width`` thick; ends are round, or cut ``flat``."""
        if flat and len(points) == 2:
            self.polygon(_bar(points[0], points[1], width), colour)
            return
        thickness = max(1, round(width * self._scale))
        fixed = self._fixed(points)
        cv2.polylines(self._rgb, [fixed], False, colour, thickness, cv2.LINE_8, _SHIFT)
        cv2.polylines(self._alpha, [fixed], False, 255, thickness, cv2.LINE_8, _SHIFT)

    def stamp(self, mask: Image, x: float, y: float, width: float, height: float, colour: Colour) -> None:
        """Lay a coverage mask (uint8, H x W) over the box, in one colour: how text from a font file gets in."""
        x0, y0 = round(x * self._scale), round(y * self._scale)
        size = (max(1, round(width * self._scale)), max(1, round(height * self._scale)))
        scaled = cv2.resize(mask, size, interpolation=cv2.INTER_AREA if mask.shape[1] > size[0] else cv2.INTER_LINEAR)
        top, left = max(0, -y0), max(0, -x0)
        region = self._rgb[max(0, y0) : y0 + size[1], max(0, x0) : x0 + size[0]]
        scaled = scaled[top : top + region.shape[0], left : left + region.shape[1]]
        weight = scaled[..., None].astype(np.float32) / 255.0
        region[:] = (region * (1 - weight) + np.array(colour, np.float32) * weight).astype(np.uint8)
        alpha = self._alpha[max(0, y0) : y0 + size[1], max(0, x0) : x0 + size[0]]
        np.maximum(alpha, scaled, out=alpha)

    def picture(self) -> Image:
        """The finished face: uint8 RGBA, H x W x 4, colours not premultiplied."""
        weight = self._alpha[..., None].astype(np.float32) / 255.0
        height, width = self._shape_px
        small_alpha = cv2.resize(weight, (width, height), interpolation=cv2.INTER_AREA)
        small = cv2.resize(self._rgb * weight, (width, height), interpolation=cv2.INTER_AREA)
        colour = small / np.maximum(small_alpha, 1e-3)[..., None]
        return np.dstack([np.clip(colour, 0, 255), small_alpha * 255.0]).round().astype(np.uint8)

    def _fixed(self, points: Sequence[Point]) -> NDArray[np.int32]:
        # Pixel centres sit at integer coordinates in OpenCV: half a pixel back from our continuous ones.
        scaled = np.asarray(points, np.float64) * self._scale - 0.5
        return np.round(scaled * (1 << _SHIFT)).astype(np.int32).reshape(-1, 1, 2)


def _bar(a: Point, b: Point, width: float) -> list[Point]:
    along = np.array([b[0] - a[0], b[1] - a[1]], np.float64)
    length = float(np.hypot(*along)) or 1.0
    nx, ny = float(-along[1] / length * width / 2), float(along[0] / length * width / 2)
    return [(a[0] + nx, a[1] + ny), (b[0] + nx, b[1] + ny), (b[0] - nx, b[1] - ny), (a[0] - nx, a[1] - ny)]
