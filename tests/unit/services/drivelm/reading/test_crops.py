"""Crops are cut the same way whatever the size, and never fail on boxes at or beyond the rim."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from services.drivelm.reading.crops import CROP_PX, Region, crop

PICTURE = np.random.default_rng(0).integers(0, 255, (90, 160, 3)).astype(np.uint8)


@given(st.floats(-200, 300), st.floats(-200, 300), st.floats(-10, 200), st.floats(-10, 200))
def test_any_box_gives_a_crop_of_the_fixed_size_or_nothing(x: float, y: float, width: float, height: float) -> None:
    cut = crop(PICTURE, Region(x, y, x + width, y + height))
    assert cut is None or (cut.shape == (CROP_PX, CROP_PX, 3) and cut.dtype == np.uint8)


def test_the_crop_shows_the_box_with_its_margin() -> None:
    picture = np.zeros((100, 100, 3), np.uint8)
    picture[40:60, 40:60] = 255
    cut = crop(picture, Region(40, 40, 60, 60))
    assert cut is not None
    assert cut[24, 24].min() == 255
    assert cut[0, 0].max() == 0
    lit = float((cut > 127).mean())
    assert abs(lit - (1 / 1.2) ** 2) < 0.06


def test_a_large_box_is_averaged_down_not_sampled() -> None:
    picture = np.zeros((400, 400, 3), np.uint8)
    picture[:, ::2] = 255
    cut = crop(picture, Region(20, 20, 380, 380))
    assert cut is not None
    assert 90 < int(cut.mean()) < 165
    assert int(cut.std()) < 45


def test_absurd_boxes_give_nothing() -> None:
    for edge in (float("nan"), float("inf"), -float("inf"), 1e12):
        assert crop(PICTURE, Region(0, 0, edge, 20)) is None
        assert crop(PICTURE, Region(edge, 0, 30, 20)) is None
