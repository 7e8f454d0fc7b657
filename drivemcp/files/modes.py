"""Modes of what is written: a drive's files are for their owner and group, not for every user of the machine."""

import os
from collections.abc import Iterator
from contextlib import contextmanager

OTHERS = 0o027
"""What files (0640) and folders (0750) are denied."""


def deny_others() -> int:
    """From now on this process and those that it starts deny it, whatever they were denied before; the mask that was in force."""
    before = os.umask(OTHERS)
    if before & ~OTHERS:
        os.umask(before | OTHERS)
    return before


@contextmanager
def others_denied() -> Iterator[None]:
    """As `deny_others`, until the end."""
    before = deny_others()
    try:
        yield
    finally:
        os.umask(before)
