"""The size of a picture is read from its header; bombs are refused before anything is unpacked."""

import struct
import time
import tracemalloc
import zlib

import cv2
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from domain.pictures import may_be_unpacked, size_px
from proto.sensors import CameraFrame
from services.perception.checks.decoding import Malformed, open_picture


def jpeg(width: int, height: int, *options: int) -> bytes:
    return bytes(cv2.imencode(".jpg", np.zeros((height, width, 3), np.uint8), list(options))[1])


def jpeg_that_says(width: int, height: int) -> bytes:
    """A small JPEG whose header says another size."""
    small = jpeg(16, 16)
    at = small.index(b"\xff\xc0")
    return small[: at + 5] + struct.pack(">HH", height, width) + small[at + 9 :]


def png_that_says(width: int, height: int) -> bytes:
    head = b"IHDR" + struct.pack(">IIBBBBB", width, height, 8, 0, 0, 0, 0)
    return b"\x89PNG\r\n\x1a\n" + struct.pack(">I", 13) + head + struct.pack(">I", zlib.crc32(head))


@pytest.mark.parametrize(("width", "height"), [(1, 1), (640, 360), (1280, 720), (17, 999)])
def test_the_size_is_the_pictures(width: int, height: int) -> None:
    for options in ((), (cv2.IMWRITE_JPEG_PROGRESSIVE, 1), (cv2.IMWRITE_JPEG_RST_INTERVAL, 2)):
        assert size_px(jpeg(width, height, *options)) == (width, height)
    whole = bytes(cv2.imencode(".png", np.zeros((height, width), np.uint8))[1])
    assert size_px(whole) == (width, height)
    assert may_be_unpacked(whole)


@pytest.mark.parametrize("bomb", [jpeg_that_says(50_000, 50_000), png_that_says(50_000, 50_000)])
def test_a_bomb_is_refused_at_once_and_with_little_memory(bomb: bytes) -> None:
    assert size_px(bomb) == (50_000, 50_000)
    tracemalloc.start()
    started_s = time.monotonic()
    try:
        assert not may_be_unpacked(bomb)
        for said in ((50_000, 50_000), (1280, 720)):
            with pytest.raises(Malformed):
                open_picture(CameraFrame(jpeg=bomb, width_px=said[0], height_px=said[1]))
        _, most_bytes = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()
    assert time.monotonic() - started_s < 0.2
    assert most_bytes < 1_000_000


@given(st.binary(max_size=300), st.sampled_from([b"", b"\xff\xd8", b"\xff\xd8\xff\xe0", b"\x89PNG\r\n\x1a\n"]))
def test_whatever_stands_in_a_picture_its_size_is_positive_or_unknown(rest: bytes, start: bytes) -> None:
    size = size_px(start + rest)
    assert size is None or min(size) > 0


@given(st.integers(0, 400))
def test_a_picture_that_was_cut_says_its_size_or_none(cut: int) -> None:
    assert size_px(jpeg(64, 48)[:cut]) in (None, (64, 48))
