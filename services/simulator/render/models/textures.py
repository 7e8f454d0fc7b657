"""Procedural surface textures, 256 x 256 RGBA, drawn once per process from fixed seeds. Values are sRGB bytes."""

from __future__ import annotations

from collections.abc import Callable
from enum import IntEnum

import cv2
import numpy as np
from numpy.typing import NDArray

SIZE = 256
Image = NDArray[np.float64]
Bytes = NDArray[np.uint8]


class Layer(IntEnum):
    """Index of each texture in the array."""

    WHITE = 0
    NOISE = 1
    ASPHALT = 2
    CONCRETE = 3
    PAVEMENT = 4
    GRASS = 5
    BRICK = 6
    PLASTER = 7
    WOOD = 8
    ROOF = 9
    BRICK_WINDOW = 10
    PLASTER_WINDOW = 11
    TOWER = 12
    LEAVES = 13
    NEEDLES = 14
    BARK = 15
    CAR_SIDE = 16
    CAR_REAR = 17
    CAR_FRONT = 18
    PAINT = 19
    WHEEL = 20
    CLOTH = 21
    TARPAULIN = 22
    PLATE_WHITE = 23
    PLATE_YELLOW = 24
    DOOR = 25
    STRIPES = 26
    VAN_SIDE = 27
    TOWER_2 = 28
    SHOP = 29


def noise(seed: int, power: float) -> Image:
    """Tileable noise (SIZE, SIZE) with spectrum 1 / f ** power, mean 0, deviation 1."""
    rng = np.random.default_rng(seed)
    spectrum = np.fft.fft2(rng.normal(size=(SIZE, SIZE)))
    fy, fx = np.meshgrid(np.fft.fftfreq(SIZE), np.fft.fftfreq(SIZE), indexing="ij")
    radius = np.hypot(fx, fy)
    radius[0, 0] = 1.0
    field = np.fft.ifft2(spectrum / radius**power).real
    field -= field.mean()
    out: Image = field / field.std()
    return out


def _smeared(seed: int, length: int) -> Image:
    """Fine noise drawn out along the rows' direction by ``length`` pixels."""
    return np.asarray(cv2.blur(noise(seed, 0.2), (3, length)), dtype=np.float64)


def _tinted(grey: Image, colour: tuple[float, float, float]) -> Image:
    out: Image = np.clip(grey[:, :, None] * np.asarray(colour) * 255.0, 0, 255)
    return out


def _opaque(rgb: Image) -> Bytes:
    return np.dstack([rgb, np.full((SIZE, SIZE), 255.0)]).clip(0, 255).astype(np.uint8)


def _white() -> Bytes:
    return np.full((SIZE, SIZE, 4), 255, dtype=np.uint8)


def _noise() -> Bytes:
    channels = [127 + 45 * noise(seed, power) for seed, power in ((1, 1.6), (2, 1.2), (3, 2.0), (4, 1.0))]
    return np.dstack(channels).clip(0, 255).astype(np.uint8)


def _asphalt() -> Bytes:
    grey = 0.47 + 0.045 * noise(5, 0.3) + 0.02 * noise(6, 1.4)
    rng = np.random.default_rng(7)
    image = _tinted(grey, (1.0, 0.99, 0.98))
    for _ in range(160):  # light stones
        cv2.circle(image, tuple(int(v) for v in rng.integers(0, SIZE, 2)), 1, [float(rng.uniform(90, 150))] * 3, -1)
    return _opaque(image)


def _concrete() -> Bytes:
    grey = 0.60 + 0.03 * noise(8, 0.4) + 0.03 * noise(9, 1.5)
    image = _tinted(grey, (1.0, 0.98, 0.94))
    cv2.line(image, (0, 0), (0, SIZE), (110, 108, 104), 3)
    return _opaque(image)


def _pavement() -> Bytes:
    image = _tinted(0.60 + 0.035 * noise(10, 0.5) + 0.03 * noise(11, 1.6), (1.0, 0.985, 0.96))
    rng = np.random.default_rng(12)
    for row in range(4):
        for column in range(-1, 4):
            x, y = column * 64 + 32 * (row % 2), row * 64
            image[y : y + 64, max(x, 0) : x + 64] *= rng.uniform(0.93, 1.05)
            cv2.rectangle(image, (x, y), (x + 64, y + 64), (105, 103, 100), 1)
    return _opaque(image)


def _grass() -> Bytes:
    base = 0.36 + 0.07 * noise(13, 0.6) + 0.05 * noise(14, 1.5)
    image = _tinted(base, (0.78, 1.0, 0.42))
    rng = np.random.default_rng(15)
    for _ in range(2600):
        x, y = rng.integers(0, SIZE, 2)
        shade = rng.uniform(0.55, 1.35)
        tip = (int(x + rng.integers(-3, 4)), int(y - rng.integers(3, 9)))
        cv2.line(image, (int(x), int(y)), tip, (66 * shade, 92 * shade, 34 * shade), 1)
    return _opaque(image)


def _brick_rgb() -> Image:
    rng = np.random.default_rng(16)
    image = np.full((SIZE, SIZE, 3), 168.0)
    for row in range(16):
        for column in range(-1, 8):
            x, y = column * 32 + 16 * (row % 2), row * 16
            tone = rng.uniform(0.75, 1.12)
            cv2.rectangle(image, (x + 1, y + 1), (x + 30, y + 14), (150 * tone, 82 * tone, 62 * tone), -1)
    image *= (1 + 0.06 * noise(17, 0.5))[:, :, None]
    return image


def _plaster_rgb() -> Image:
    streak = _smeared(19, 61)
    return _tinted(0.84 + 0.02 * noise(18, 0.6) + 0.025 * noise(20, 1.7) + 0.02 * streak, (1.0, 0.98, 0.94))


def _wood() -> Bytes:
    rng = np.random.default_rng(21)
    grain = _smeared(22, 41)
    image = _tinted(0.45 + 0.06 * grain, (1.0, 0.68, 0.45))
    for column in range(8):
        image[:, column * 32 : column * 32 + 32] *= rng.uniform(0.75, 1.15)
        cv2.line(image, (column * 32, 0), (column * 32, SIZE), (40, 26, 18), 2)
    return _opaque(image)


def _roof() -> Bytes:
    rng = np.random.default_rng(23)
    image = np.zeros((SIZE, SIZE, 3))
    for row in range(12):
        for column in range(-1, 13):
            x, y = int(column * 21.4 + 10 * (row % 2)), int(row * 21.4)
            tone = rng.uniform(0.7, 1.1)
            cv2.rectangle(image, (x, y), (x + 21, y + 21), (200 * tone, 200 * tone, 200 * tone), -1)
            cv2.line(image, (x, y + 21), (x + 21, y + 21), (70, 70, 70), 3)
            cv2.line(image, (x, y), (x, y + 21), (110, 110, 110), 1)
    image *= (1 + 0.08 * noise(24, 1.2))[:, :, None]
    return _opaque(image)


def _windowed(wall: Image, box: tuple[int, int, int, int], bars: int, frame: float, sill: bool = True) -> Bytes:
    """A wall with one window; alpha 0 marks the panes, which the shader lets shine at night."""
    image, alpha = wall.copy(), np.full((SIZE, SIZE), 255.0)
    left, top, right, bottom = box
    cv2.rectangle(image, (left - 9, top - 9), (right + 9, bottom + 9), (frame * 0.8,) * 3, -1)
    cv2.rectangle(image, (left - 6, top - 6), (right + 6, bottom + 6), (frame,) * 3, -1)
    rows = np.linspace(105, 45, bottom - top)[:, None]
    columns = 18 * np.sin(np.linspace(0, 5, right - left))[None, :]
    image[top:bottom, left:right] = (rows + columns)[:, :, None] * np.array([0.85, 0.95, 1.05])
    cv2.rectangle(image, (left, top), (left + 14, bottom), (170, 166, 155), -1)  # curtain
    cv2.rectangle(image, (right - 12, top), (right, bottom), (160, 156, 146), -1)
    cv2.rectangle(alpha, (left, top), (right, bottom), 0.0, -1)
    for bar in range(1, bars):
        x = left + (right - left) * bar // bars
        cv2.line(image, (x, top), (x, bottom), (frame,) * 3, 6)
        cv2.line(alpha, (x, top), (x, bottom), 255.0, 6)
    cv2.line(image, (left, (top + bottom) // 2 - 20), (right, (top + bottom) // 2 - 20), (frame,) * 3, 5)
    if sill:
        cv2.rectangle(image, (left - 14, bottom + 7), (right + 14, bottom + 16), (196, 194, 188), -1)
        image[bottom + 17 : bottom + 24, left - 12 : right + 12] *= 0.7
    return np.dstack([image, alpha]).clip(0, 255).astype(np.uint8)


def _tower(seed: int, wall_colour: tuple[float, float, float]) -> Bytes:
    wall = _tinted(0.62 + 0.02 * noise(seed, 1.0), wall_colour)
    image = _windowed(wall, (24, 70, 232, 190), 3, 90.0, sill=False)
    image[:12, :, :3] = (image[:12, :, :3] * 0.6).astype(np.uint8)
    return image


def _shop() -> Bytes:
    image = _windowed(_plaster_rgb(), (20, 80, 236, 228), 2, 60.0, sill=False)
    cv2.rectangle(image, (10, 26), (246, 62), (120, 40, 44, 255), -1)
    rng = np.random.default_rng(28)
    for x in range(36, 220, 15):
        cv2.rectangle(image, (x, 36), (x + int(rng.integers(6, 12)), 52), (230, 224, 210, 255), -1)
    return image


def _leafy(seed: int, count: int, long: tuple[int, int], thin: float, colour: tuple[int, int, int]) -> Bytes:
    rng = np.random.default_rng(seed)
    image = np.zeros((SIZE, SIZE, 4))
    image[:, :, :3] = np.asarray(colour) * 0.8
    for _ in range(count):
        radius = SIZE * 0.43 * rng.uniform(0, 1) ** 0.6
        angle = rng.uniform(0, 2 * np.pi)
        x, y = int(SIZE / 2 + radius * np.cos(angle)), int(SIZE / 2 + radius * np.sin(angle))
        size = int(rng.integers(*long))
        tone = rng.uniform(0.5, 1.35) * (1.1 - 0.35 * y / SIZE)
        paint = (colour[0] * tone, colour[1] * tone, colour[2] * tone, 255)
        cv2.ellipse(image, (x, y), (size, max(1, int(size * thin))), float(rng.uniform(0, 180)), 0, 360, paint, -1)
    return image.clip(0, 255).astype(np.uint8)


def _needles() -> Bytes:
    rng = np.random.default_rng(31)
    image = np.zeros((SIZE, SIZE, 4))
    image[:, :, :3] = (48, 74, 50)
    for _ in range(900):  # twigs hang from a branch along the upper half
        x = rng.uniform(8, SIZE - 8)
        reach = 1 - abs(x / SIZE - 0.5) * 1.5
        y, tone = rng.uniform(0.05, 0.55) * SIZE, rng.uniform(0.55, 1.4)
        end = (int(x + rng.normal(0, 12)), int(y + rng.uniform(10, 100) * max(reach, 0.2)))
        cv2.line(image, (int(x), int(y)), end, (58 * tone, 90 * tone, 58 * tone, 255), 3)
    return image.clip(0, 255).astype(np.uint8)


def _bark() -> Bytes:
    return _opaque(_tinted(0.42 + 0.1 * _smeared(32, 31), (1.0, 0.86, 0.72)))


def _dirt(rows_from: float, seed: int) -> Image:
    """1 at the top, darker and brown towards row 1.0 (texture rows run downwards)."""
    height = np.linspace(0, 1, SIZE)[:, None]
    level = np.clip((height - rows_from) / (1 - rows_from), 0, 1) ** 1.5 * (0.5 + 0.2 * noise(seed, 1.3))
    out: Image = 1 - np.clip(level, 0, 0.8)[:, :, None] * np.array([0.45, 0.5, 0.58])
    return out


def _car_side() -> Bytes:
    """Texture column 0 is the rear bumper, 255 the front; row 0 the roof, 255 the ground."""
    image = np.full((SIZE, SIZE, 3), 250.0) * _dirt(0.62, 33)
    for points in ([(92, 90), (92, 205)], [(138, 90), (138, 205)], [(180, 90), (184, 200)], [(92, 205), (184, 205)]):
        cv2.line(image, points[0], points[1], (70, 70, 70), 2)
    for x in (100, 146):
        cv2.rectangle(image, (x, 126), (x + 11, 131), (60, 60, 60), -1)
    cv2.line(image, (8, 146), (246, 142), (190, 190, 190), 2)
    cv2.line(image, (8, 150), (246, 146), (255, 255, 255), 2)
    cv2.rectangle(image, (0, 212), (SIZE, SIZE), (46, 46, 46), -1)
    return _opaque(image)


def _van_side() -> Bytes:
    image = np.full((SIZE, SIZE, 3), 250.0) * _dirt(0.55, 34)
    for x in (70, 128, 182):
        cv2.line(image, (x, 20), (x, 222), (80, 80, 80), 2)
    cv2.line(image, (70, 120), (182, 120), (90, 90, 90), 3)
    cv2.rectangle(image, (134, 112), (146, 117), (50, 50, 50), -1)
    cv2.rectangle(image, (188, 112), (200, 117), (50, 50, 50), -1)
    cv2.rectangle(image, (0, 226), (SIZE, SIZE), (46, 46, 46), -1)
    return _opaque(image)


def _car_end(front: bool) -> Bytes:
    """A car's end as seen from behind or before; row 0 its upper rim, 255 its lower."""
    image = np.full((SIZE, SIZE, 3), 250.0) * _dirt(0.45, 35 + front)
    if front:
        cv2.rectangle(image, (70, 40), (186, 110), (26, 26, 28), -1)
        for y in range(48, 108, 11):
            cv2.line(image, (72, y), (184, y), (120, 120, 124), 2)
        cv2.circle(image, (128, 72), 13, (190, 190, 196), -1)
        cv2.rectangle(image, (40, 178), (216, 226), (24, 24, 26), -1)
    else:
        cv2.line(image, (38, 18), (38, 128), (90, 90, 90), 2)
        cv2.line(image, (218, 18), (218, 128), (90, 90, 90), 2)
        cv2.line(image, (38, 128), (218, 128), (70, 70, 70), 3)
        cv2.circle(image, (128, 30), 9, (170, 170, 176), -1)
        cv2.rectangle(image, (10, 200), (246, 255), (40, 40, 42), -1)
        cv2.circle(image, (60, 232), 12, (15, 15, 15), -1)
    cv2.line(image, (0, 150), (SIZE, 150), (110, 110, 110), 3)
    return _opaque(image)


def _paint() -> Bytes:
    grey = 0.97 + 0.012 * noise(37, 1.4)
    return _opaque(_tinted(grey, (1.0, 1.0, 1.0)))


def _wheel() -> Bytes:
    image = np.full((SIZE, SIZE, 3), 22.0)
    cv2.circle(image, (128, 128), 126, (30, 30, 30), 10)
    cv2.circle(image, (128, 128), 84, (150, 152, 156), -1)
    cv2.circle(image, (128, 128), 78, (46, 46, 48), -1)
    for spoke in range(7):
        angle = spoke * 2 * np.pi / 7
        end = (int(128 + 80 * np.cos(angle)), int(128 + 80 * np.sin(angle)))
        cv2.line(image, (128, 128), end, (176, 178, 182), 17)
    cv2.circle(image, (128, 128), 22, (150, 152, 156), -1)
    return _opaque(image)


def _cloth() -> Bytes:
    return _opaque(_tinted(0.86 + 0.05 * noise(38, 1.3) + 0.03 * noise(39, 0.2), (1.0, 1.0, 1.0)))


def _tarpaulin() -> Bytes:
    fold = np.sin(np.linspace(0, 16 * np.pi, SIZE))[None, :] * 0.03
    image = _tinted(0.9 + fold + 0.02 * noise(40, 1.5), (1.0, 1.0, 1.0)) * _dirt(0.5, 41)
    for x in range(0, SIZE, 32):
        cv2.line(image, (x, 236), (x, SIZE), (60, 60, 60), 3)
    return _opaque(image)


def _plate(colour: tuple[int, int, int], text: str, band: bool) -> Bytes:
    image = np.zeros((SIZE, SIZE, 3))
    image[:] = colour
    if band:
        image[:, :24] = (20, 50, 150)
    cv2.rectangle(image, (2, 2), (253, 253), (20, 20, 20), 5)
    letters = np.full((48, 256, 3), colour, dtype=np.uint8)
    cv2.putText(letters, text, (28, 39), cv2.FONT_HERSHEY_DUPLEX, 1.25, (15, 15, 15), 3)
    image[24:232, 26:250] = cv2.resize(letters[:, 26:250], (224, 208))
    return _opaque(image)


def _door() -> Bytes:
    image = _plaster_rgb()
    cv2.rectangle(image, (88, 60), (168, 255), (84, 58, 40), -1)
    cv2.rectangle(image, (100, 76), (156, 140), (60, 70, 78), -1)
    cv2.rectangle(image, (80, 52), (176, 60), (200, 198, 190), -1)
    return _opaque(image)


def _stripes() -> Bytes:
    image = np.full((SIZE, SIZE, 3), 245.0)
    for x in range(-SIZE, SIZE, 64):
        cv2.line(image, (x, SIZE), (x + SIZE, 0), (200, 30, 30), 22)
    return _opaque(image)


PAINTERS: dict[Layer, Callable[[], Bytes]] = {
    Layer.WHITE: _white,
    Layer.NOISE: _noise,
    Layer.ASPHALT: _asphalt,
    Layer.CONCRETE: _concrete,
    Layer.PAVEMENT: _pavement,
    Layer.GRASS: _grass,
    Layer.BRICK: lambda: _opaque(_brick_rgb()),
    Layer.PLASTER: lambda: _opaque(_plaster_rgb()),
    Layer.WOOD: _wood,
    Layer.ROOF: _roof,
    Layer.BRICK_WINDOW: lambda: _windowed(_brick_rgb(), (88, 72, 168, 190), 2, 225.0),
    Layer.PLASTER_WINDOW: lambda: _windowed(_plaster_rgb(), (80, 66, 176, 186), 2, 235.0),
    Layer.TOWER: lambda: _tower(25, (1.0, 0.98, 0.95)),
    Layer.TOWER_2: lambda: _tower(26, (0.8, 0.72, 0.66)),
    Layer.SHOP: _shop,
    Layer.LEAVES: lambda: _leafy(30, 700, (5, 12), 0.5, (92, 124, 56)),
    Layer.NEEDLES: _needles,
    Layer.BARK: _bark,
    Layer.CAR_SIDE: _car_side,
    Layer.VAN_SIDE: _van_side,
    Layer.CAR_REAR: lambda: _car_end(front=False),
    Layer.CAR_FRONT: lambda: _car_end(front=True),
    Layer.PAINT: _paint,
    Layer.WHEEL: _wheel,
    Layer.CLOTH: _cloth,
    Layer.TARPAULIN: _tarpaulin,
    Layer.PLATE_WHITE: lambda: _plate((235, 235, 232), "B XK 472", band=True),
    Layer.PLATE_YELLOW: lambda: _plate((240, 200, 40), "KX52 RTD", band=False),
    Layer.DOOR: _door,
    Layer.STRIPES: _stripes,
}


def all_layers() -> Bytes:
    """Every layer stacked: (layers, SIZE, SIZE, 4); row 0 is texture coordinate v = 1, so that pictures stand upright."""
    stack = np.stack([PAINTERS[layer]() for layer in sorted(PAINTERS)])
    return np.ascontiguousarray(stack[:, ::-1])
