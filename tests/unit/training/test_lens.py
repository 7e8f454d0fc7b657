"""Effects of lens and sensor keep shape, type and place, and are the same for the same seed."""

import numpy as np
import pytest

from training.lens import EFFECTS, through_lens

PICTURE = np.random.default_rng(0).integers(0, 255, (90, 160, 3)).astype(np.uint8)


@pytest.mark.parametrize("effect", EFFECTS)
def test_an_effect_changes_pixels_and_nothing_else(effect: object) -> None:
    after = effect(PICTURE, np.random.default_rng(1))  # type: ignore[operator]
    assert after.shape == PICTURE.shape
    assert after.dtype == np.uint8
    assert not np.array_equal(after, PICTURE)
    again = effect(PICTURE, np.random.default_rng(1))  # type: ignore[operator]
    assert np.array_equal(after, again)


def test_a_share_of_none_leaves_the_picture() -> None:
    assert through_lens(PICTURE, np.random.default_rng(2), share=0.0) is PICTURE


def test_a_mark_stays_where_it_was() -> None:
    dark = np.zeros((90, 160, 3), np.uint8)
    dark[40:50, 70:80] = 255
    for effect in EFFECTS:
        bright = effect(dark, np.random.default_rng(3)).astype(float).sum(axis=2)
        bright -= np.median(bright)
        rows, columns = np.nonzero(bright > 0.5 * bright.max())
        if effect.__name__ != "glare":
            assert abs(rows.mean() - 44.5) < 5
            assert abs(columns.mean() - 74.5) < 5
