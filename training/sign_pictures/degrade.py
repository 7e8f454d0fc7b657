"""From a clean face to what a camera sees of it: pose, distance, weather, night, blur, noise, JPEG, sloppy boxes."""

from typing import NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

from services.drivelm.reading.crops import Picture, Region, crop
from training.sign_pictures.faces import Face

Chance = np.random.Generator
Floats = NDArray[np.float32]

BOX_JITTER = 0.07
"""How far off a detector's boxes are, as a share of their size (one sigma)."""
_SPREAD = 1.9  # the patch is this many times the face's longer side


class Conditions(NamedTuple):
    """The weather and camera of one drive; constant over the frames of a track."""

    gain: float
    gamma: float
    cast: tuple[float, float, float]
    fog: float
    fog_shade: float
    night: bool
    sign_gain: float
    rain: int
    noise: float
    blur_px: float
    motion_px: float
    jpeg_quality: int
    yaw_rad: float
    roll_rad: float
    hidden: float


def any_conditions(chance: Chance, hard: float = 1.0) -> Conditions:
    """Draw conditions; ``hard`` 0 is a fine day, 1 the full mixture."""
    night = chance.random() < 0.22 * hard
    return Conditions(
        gain=float(np.exp(chance.normal(0, 0.22))),
        gamma=float(np.exp(chance.normal(0, 0.14))),
        cast=_triple(np.exp(chance.normal(0, 0.05, 3))),
        fog=float(chance.uniform(0, 0.72)) if chance.random() < 0.45 * hard else 0.0,
        fog_shade=float(chance.uniform(25, 80) if night else chance.uniform(130, 225)),
        night=night,
        sign_gain=float(chance.uniform(0.55, 1.5) if night else chance.uniform(0.55, 1.05)),
        rain=int(chance.integers(1, 9)) if chance.random() < 0.35 * hard else 0,
        noise=float(chance.uniform(0.5, 3 + 8 * hard)),
        blur_px=float(chance.uniform(0, 1.1)) if chance.random() < 0.7 else 0.0,
        motion_px=float(chance.uniform(1, 3.2)) if chance.random() < 0.25 * hard else 0.0,
        jpeg_quality=int(chance.integers(60, 96)),
        yaw_rad=float(np.clip(chance.normal(0, 0.3), -0.9, 0.9)),
        roll_rad=float(chance.normal(0, 0.045)),
        hidden=float(chance.uniform(0.05, 0.25)) if chance.random() < 0.12 * hard else 0.0,
    )


def _triple(values: NDArray[np.float64]) -> tuple[float, float, float]:
    red, green, blue = (float(value) for value in values)
    return red, green, blue


class View(NamedTuple):
    """A patch of a camera picture and where the face lies in it."""

    picture: Picture
    region: Region


def view(
    face: Face, ground: Picture, size_px: float, now: Conditions, chance: Chance, glows: bool, below: Face | None = None
) -> View:
    """Put the face, ``size_px`` on its longer side, before the ground and take a picture of it.

    ``glows``: lamps, which keep their light at night. ``below``: another face hung under it (or over it, one in three).
    """
    scale = 2.0 if size_px < 40 else 1.0
    side = max(8, round(size_px * _SPREAD * scale))
    scene = cv2.resize(_window(ground, chance), (side, side), interpolation=cv2.INTER_LINEAR).astype(np.float32)
    scene *= chance.uniform(0.06, 0.3) if now.night else 1.0
    if chance.random() < 0.6:
        _post(scene, size_px * scale, chance)
    light = (chance.uniform(0.8, 1.1) if glows else now.sign_gain) * (1.0 if glows or not now.night else 0.9)
    centre = (side / 2 + chance.uniform(-0.1, 0.1) * side, side / 2 + chance.uniform(-0.1, 0.1) * side)
    corners = _corners(face.aspect, size_px * scale, centre, now)
    if below is not None:
        _paste(scene, below, _beside(corners, below.aspect, chance), light)
    _paste(scene, face, corners, light)
    if now.hidden:
        _hide(scene, corners, now.hidden, ground, chance)
    picture = camera(scene, side, scale, now, chance)
    low, high = corners.min(axis=0) / scale, corners.max(axis=0) / scale
    return View(picture, Region(float(low[0]), float(low[1]), float(high[0]), float(high[1])))


def jittered(region: Region, chance: Chance, amount: float = BOX_JITTER) -> Region:
    """The box a detector might give for it: edges off by a share of its size and by about a pixel."""
    dx = chance.normal(0, amount * region.width_px + 0.4, 2)
    dy = chance.normal(0, amount * region.height_px + 0.4, 2)
    return Region(
        region.x0_px + float(dx[0]),
        region.y0_px + float(dy[0]),
        region.x1_px + float(dx[1]),
        region.y1_px + float(dy[1]),
    )


def seen_crop(taken: View, chance: Chance, amount: float = BOX_JITTER) -> Picture:
    """The crop a reader gets of the view, through a sloppy box."""
    cut = crop(taken.picture, jittered(taken.region, chance, amount))
    return cut if cut is not None else crop(taken.picture, Region(0, 0, *taken.picture.shape[1::-1]))  # type: ignore[return-value]


def _window(ground: Picture, chance: Chance) -> Picture:
    size = int(chance.integers(50, ground.shape[0]))
    y, x = (int(chance.integers(0, ground.shape[axis] - size + 1)) for axis in (0, 1))
    return ground[y : y + size, x : x + size]


def _post(scene: Floats, size: float, chance: Chance) -> None:
    side = scene.shape[0]
    shade = float(chance.uniform(90, 190))
    x = round(side / 2 + chance.normal(0, 0.04) * side)
    half = max(1, round(size * chance.uniform(0.03, 0.08)))
    scene[side // 2 :, max(0, x - half) : x + half] = shade


def _corners(aspect: float, size: float, centre: tuple[float, float], now: Conditions) -> Floats:
    """The face's corners in the patch: a turned plane seen from about fifteen face widths away."""
    width, height = (size, size / aspect) if aspect >= 1 else (size * aspect, size)
    x = np.array([-1, 1, 1, -1]) * width / 2
    y = np.array([-1, -1, 1, 1]) * height / 2
    depth = 1.0 + x * np.sin(now.yaw_rad) / (15 * size)
    x, y = x * np.cos(now.yaw_rad) / depth, y / depth
    sine, cosine = np.sin(now.roll_rad), np.cos(now.roll_rad)
    return np.stack([centre[0] + x * cosine - y * sine, centre[1] + x * sine + y * cosine], axis=1).astype(np.float32)


def _beside(corners: Floats, aspect: float, chance: Chance) -> Floats:
    low, high = corners.min(axis=0), corners.max(axis=0)
    width = float(high[0] - low[0]) * float(chance.uniform(0.8, 1.2))
    height, gap = width / aspect, float(chance.uniform(0.0, 0.12)) * width
    top = float(high[1]) + gap if chance.random() < 0.67 else float(low[1]) - gap - height
    left = float(low[0] + high[0]) / 2 - width / 2
    return np.array([(left, top), (left + width, top), (left + width, top + height), (left, top + height)], np.float32)


def _paste(scene: Floats, face: Face, corners: Floats, light: float) -> None:
    picture = face.picture
    length = max(float(np.ptp(corners[:, 0])), float(np.ptp(corners[:, 1])), 1.0)
    shrink = length / max(picture.shape[:2])
    if shrink < 0.7:  # average down first, so that the warp does not skip pixels
        size = (max(2, round(picture.shape[1] * shrink)), max(2, round(picture.shape[0] * shrink)))
        picture = np.asarray(cv2.resize(picture, size, interpolation=cv2.INTER_AREA), np.uint8)
    height, width = picture.shape[:2]
    source = np.array([(0, 0), (width, 0), (width, height), (0, height)], np.float32) - 0.5
    warp = cv2.getPerspectiveTransform(source, corners - 0.5)
    side = (scene.shape[1], scene.shape[0])
    cover = cv2.warpPerspective(picture[..., 3].astype(np.float32) / 255, warp, side)[..., None]
    paint = cv2.warpPerspective(picture[..., :3].astype(np.float32), warp, side, borderMode=cv2.BORDER_REPLICATE)
    scene[...] = scene * (1 - cover) + paint * light * cover


def _hide(scene: Floats, corners: Floats, share: float, ground: Picture, chance: Chance) -> None:
    low, high = corners.min(axis=0), corners.max(axis=0)
    size = high - low
    from_left = chance.random() < 0.5
    x0, x1 = (low[0], low[0] + share * size[0]) if from_left else (high[0] - share * size[0], high[0])
    x0, x1 = max(0, round(float(x0))), max(0, round(float(x1)))
    y0, y1 = max(0, round(float(low[1]))), max(0, round(float(high[1])))
    part = scene[y0:y1, x0:x1]
    if part.size:
        part[...] = cv2.resize(_window(ground, chance), (part.shape[1], part.shape[0])).astype(np.float32) * 0.8


def camera(scene: Floats, side: int, scale: float, now: Conditions, chance: Chance) -> Picture:
    """Fog, glare, rain, optics, sensor and JPEG, at the camera's own resolution."""
    if scale != 1.0:
        small = max(6, round(side / scale))
        scene = np.asarray(cv2.resize(scene, (small, small), interpolation=cv2.INTER_AREA), np.float32)
    if now.fog:
        scene = scene * (1 - now.fog) + now.fog_shade * now.fog
    if now.night:
        scene = scene + 0.35 * cv2.GaussianBlur(np.maximum(scene - 150, 0), (0, 0), max(1.0, scene.shape[0] / 14))
    if now.rain:
        _rain(scene, now, chance)
    if now.blur_px > 0.25:
        scene = np.asarray(cv2.GaussianBlur(scene, (0, 0), now.blur_px), np.float32)
    if now.motion_px:
        scene = _smear(scene, now.motion_px, chance)
    levels = np.clip(scene / 255, 0, 1.6) ** now.gamma * (255 * now.gain) * np.array(now.cast, np.float32)
    levels = levels + chance.normal(0, now.noise, levels.shape)
    picture = np.clip(levels, 0, 255).astype(np.uint8)
    coded = cv2.imencode(".jpg", picture[..., ::-1], [cv2.IMWRITE_JPEG_QUALITY, now.jpeg_quality])[1]
    return np.asarray(cv2.imdecode(coded, cv2.IMREAD_COLOR_RGB), np.uint8)


def _rain(scene: Floats, now: Conditions, chance: Chance) -> None:
    side = scene.shape[0]
    for _ in range(now.rain):
        x, y = chance.uniform(0, side, 2)
        length, lean = chance.uniform(0.15, 0.6) * side, chance.normal(0, 0.06) * side
        layer = np.zeros(scene.shape[:2], np.float32)
        ends = (round(float(x)), round(float(y))), (round(float(x + lean)), round(float(y + length)))
        cv2.line(layer, *ends, float(chance.uniform(0.1, 0.5)), 1, cv2.LINE_AA)
        scene += layer[..., None] * (chance.uniform(150, 235) - scene)


def _smear(scene: Floats, length_px: float, chance: Chance) -> Floats:
    size = int(np.ceil(length_px)) // 2 * 2 + 1
    kernel = np.zeros((size, size), np.float32)
    angle = chance.uniform(0, np.pi)
    reach = (size // 2) * np.array([np.cos(angle), np.sin(angle)])
    middle = size // 2
    start, end = (round(float(middle - reach[0])), round(float(middle - reach[1]))), (
        round(float(middle + reach[0])), round(float(middle + reach[1])))  # fmt: skip
    cv2.line(kernel, start, end, 1.0, 1)
    return np.asarray(cv2.filter2D(scene, -1, kernel / max(float(kernel.sum()), 1e-6)), np.float32)
