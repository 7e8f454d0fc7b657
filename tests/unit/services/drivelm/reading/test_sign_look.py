"""A warning of America is a diamond that is yellow up to its edge, and no European sign looks like one."""

import cv2
import numpy as np
import pytest

from services.drivelm.reading.crops import Picture, Region, crop
from services.drivelm.reading.sign_look import is_yellow_diamond
from services.simulator.signart import draw_face
from services.simulator.signart.catalogue import FACES

GROUNDS = [(135, 170, 205), (70, 95, 50), (128, 128, 128)]
"""Sky, leaves, concrete."""


def seen(
    country: str, code: str, ground: tuple[int, int, int], *, seed: int = 0, size_px: int = 24, off: int = 0
) -> bool:
    face = draw_face(country, code, size_px=96, seed=seed)
    small = cv2.resize(face, None, fx=size_px / 96, fy=size_px / 96, interpolation=cv2.INTER_AREA).astype(float)
    height, width = small.shape[:2]
    picture: Picture = np.full((height + 40, width + 40, 3), ground, np.uint8)
    alpha = small[..., 3:] / 255.0
    inside = picture[20 : 20 + height, 20 : 20 + width]
    inside[:] = (alpha * small[..., :3] + (1 - alpha) * inside).astype(np.uint8)
    image = crop(picture, Region(20 + off, 20, 20 + width + off, 20 + height))
    assert image is not None
    return is_yellow_diamond(image)


@pytest.mark.parametrize("ground", GROUNDS)
@pytest.mark.parametrize("code", ["crossing", "children", "roadworks", "slippery", "roundabout"])
def test_warnings_of_america_are_yellow_diamonds(code: str, ground: tuple[int, int, int]) -> None:
    looks = [
        seen("USA", code, ground, seed=seed, size_px=size, off=off)
        for seed in (0, 3)
        for size in (14, 30)
        for off in (0, 1)
    ]
    assert sum(looks) >= 6


@pytest.mark.parametrize("country", sorted(set(FACES) - {"USA"}))
def test_no_european_sign_looks_like_one(country: str) -> None:
    found = [
        code
        for code in FACES[country]
        for ground in GROUNDS
        for seed in (0, 3)
        if seen(country, code, ground, seed=seed)
    ]
    assert not found


def test_other_signs_of_america_do_not_look_like_one() -> None:
    others = set(FACES["USA"]) - {"crossing", "children", "roadworks", "slippery", "roundabout"}
    assert not [code for code in sorted(others) for ground in GROUNDS if seen("USA", code, ground)]


def test_where_nothing_was_cut_out_as_with_modelled_sensors_there_is_no_diamond() -> None:
    assert not is_yellow_diamond(np.zeros((1, 1, 3), np.uint8))
