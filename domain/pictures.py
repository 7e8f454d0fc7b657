"""What a compressed picture says of its size, read from its header alone: a bomb is refused before anything is unpacked."""

import struct

MOST_PIXELS = 50_000_000
"""No camera in a car takes a larger picture; the largest of ours has 1 million."""
MOST_BYTES = 32_000_000
_PNG = b"\x89PNG\r\n\x1a\n"
_SIZED = frozenset({0xC0, 0xC1, 0xC2, 0xC3, 0xC5, 0xC6, 0xC7, 0xC9, 0xCA, 0xCB, 0xCD, 0xCE, 0xCF})
"""JPEG's segments that begin a frame: precision, height, width."""
_ALONE = frozenset({0x01, *range(0xD0, 0xD8)})
"""Markers without a length."""


def size_px(data: bytes) -> tuple[int, int] | None:
    """Width and height of a JPEG or PNG; None for what is neither, or has no sound header."""
    if data.startswith(_PNG):
        return _positive(*struct.unpack_from(">II", data, 16)) if len(data) >= 24 else None
    return _jpeg_size(data) if data.startswith(b"\xff\xd8") else None


def may_be_unpacked(data: bytes) -> bool:
    """Whether it is a JPEG or PNG of a size that a camera may have."""
    if len(data) > MOST_BYTES:
        return False
    size = size_px(data)
    return size is not None and size[0] * size[1] <= MOST_PIXELS


def _jpeg_size(data: bytes) -> tuple[int, int] | None:
    at = 2
    while at + 4 <= len(data):
        if data[at] != 0xFF:
            return None
        marker = data[at + 1]
        if marker == 0xFF:  # fill bytes
            at += 1
        elif marker in _ALONE:
            at += 2
        elif marker in _SIZED:
            if at + 9 > len(data):
                return None
            height, width = struct.unpack_from(">HH", data, at + 5)
            return _positive(width, height)
        else:
            (length,) = struct.unpack_from(">H", data, at + 2)
            at += 2 + max(2, length)
    return None


def _positive(width: int, height: int) -> tuple[int, int] | None:
    return (width, height) if width > 0 and height > 0 else None
