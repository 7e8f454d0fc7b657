"""Which record is the first that is not as the chain lists it, and what happened to it. Pure."""

from collections.abc import Sequence
from typing import Literal

import msgspec

from services.logger.format import chain

What = Literal["changed", "dropped", "inserted", "reordered", "damaged", "unsealed"]
"""What is wrong; `unsealed`: nothing is seen to be, but no chain record vouches for any of it."""


class Found(msgspec.Struct, frozen=True, kw_only=True):
    """A record as it stands in the file: in the chunk at byte `start`, at `place` of its uncompressed bytes."""

    entry: chain.Entry
    start: int
    place: int


class Difference(msgspec.Struct, frozen=True, kw_only=True):
    """The first bad record; `found` is None where the file ends before it."""

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
