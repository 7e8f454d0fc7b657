"""What verification of a log comes to."""

from collections.abc import Sequence
from typing import Literal

import msgspec

from services.logger.format import chain
from services.logger.writing.log_file import Origin

What = Literal["changed", "dropped", "inserted", "reordered", "damaged", "unsealed"]
"""What is wrong; `unsealed`: nothing is seen to be, but no chain record vouches for any of it."""


class Found(msgspec.Struct, frozen=True, kw_only=True):
    """A record as it stands in the file: in the chunk at byte `start`, at `place` of its uncompressed bytes."""

    entry: chain.Entry
    start: int
    place: int


class Difference(msgspec.Struct, frozen=True, kw_only=True):
    """The first bad record; `found` is `None` where the file ends before it."""

    what: What
    entry: chain.Entry
    found: Found | None


def first_difference(listed: Sequence[chain.Entry], found: Sequence[Found], *, unreadable: bool) -> Difference | None:
    """Compares the list in a chain record with the records before it. `unreadable`: they could not be read to the end."""
    i = next(
        (i for i, (entry, other) in enumerate(zip(listed, found, strict=False)) if entry != other.entry),
        min(len(listed), len(found)),
    )
    if i == len(listed) == len(found):
        return None
    if i == len(found):
        return Difference(what="changed" if unreadable else "dropped", entry=listed[i], found=None)
    here = found[i]
    if i == len(listed):
        return Difference(what="inserted", entry=here.entry, found=here)
    expected_later = here.entry in listed[i:]
    stands_later = any(listed[i] == other.entry for other in found[i:])
    table: dict[tuple[bool, bool], tuple[What, chain.Entry]] = {
        (True, True): ("reordered", listed[i]),
        (True, False): ("changed" if unreadable else "dropped", listed[i]),
        (False, True): ("inserted", here.entry),
        (False, False): ("changed", listed[i]),
    }
    what, entry = table[expected_later, stands_later]
    return Difference(what=what, entry=entry, found=here)


class Place(msgspec.Struct, frozen=True, kw_only=True):
    """The first bad record. Where it has no name (framing, summary), the byte alone says where."""

    what: What
    detail: str
    offset: int
    """Byte in the file: of the chunk that holds the record, or of the first bytes that are wrong."""
    topic: str = ""
    sequence: int | None = None
    log_time_ns: int | None = None

    def __str__(self) -> str:
        name = f" {self.topic}" if self.topic else ""
        if self.sequence is not None:
            name += f" sequence {self.sequence}"
        if self.log_time_ns is not None:
            name += f" log time {self.log_time_ns} ns"
        return f"{self.what}:{name} at byte {self.offset}: {self.detail}"


UNSEALED = Place(what="unsealed", offset=0, detail="no chain record stands in it, so nothing verifies")
"""An empty file, or one that was cut before its first flush was whole."""


class Report(msgspec.Struct, frozen=True, kw_only=True):
    """What verification came to."""

    file: str
    size: int
    messages: int = 0
    """Messages that verify, chain records not counted."""
    chained: int = 0
    """Chain records that verify."""
    head: str = chain.ZERO
    origin: Origin | None = None
    key_id: str = ""
    closed: bool = False
    tail_bytes: int = 0
    """Bytes behind the last chain record of an unclosed file: a flush that was cut, vouched for by nothing."""
    first_bad: Place | None = None
    expected_head_missing: bool = False
    stamped: dict[str, int] = {}
    """By imprint, how many messages lie before a head that a time stamp was sought for."""
    lost: int = 0
    """Messages that the logger itself says never came into the file."""
    lost_why: str = ""
    """The first reason that it gives."""

    @property
    def intact(self) -> bool:
        """Whether something verifies, all before the tail is as it was written, and nothing expected is missing."""
        return self.first_bad is None and not self.expected_head_missing
