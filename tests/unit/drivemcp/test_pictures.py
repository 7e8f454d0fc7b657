"""Pictures fit into the bytes that they are given."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from app.pictures import unpacked
from drivemcp.pictures import packed_within

SIDE = st.one_of(st.integers(1, 40), st.integers(800, 2200))


@given(SIDE, SIDE, st.integers(0, 2**32 - 1), st.booleans(), st.sampled_from([4_000, 200_000]))
def test_no_picture_is_larger_than_allowed_and_it_keeps_its_shape(
    width: int, height: int, seed: int, noisy: bool, most: int
) -> None:
    random = np.random.default_rng(seed)
    shape = (height, width, 3)
    picture = random.integers(0, 256, shape, np.uint8) if noisy else np.full(shape, seed % 256, np.uint8)
    jpeg = packed_within(picture, most)
    assert 0 < len(jpeg) <= most
    shown = unpacked(jpeg)
    assert shown is not None
    assert max(shown.shape[:2]) <= 960
    longest, shortest = max(width, height), min(width, height)
    assert abs(min(shown.shape[:2]) - shortest * max(shown.shape[:2]) / longest) <= 1.0


def test_where_nothing_fits_there_is_no_picture() -> None:
    assert packed_within(np.zeros((8, 8, 3), np.uint8), 10) == b""
