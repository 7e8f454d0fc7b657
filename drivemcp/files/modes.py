"""Modes of what is written: a drive's files are for their owner and group, not for every user of the machine."""

import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

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


def write_private(path: Path, text: str) -> None:
    """A file for its owner alone (0600, its folder 0700), as a whole: a reader sees the old content or the new."""
    path.parent.mkdir(parents=True, exist_ok=True, mode=0o700)
    scratch = path.with_name(f".{path.name}.{os.getpid()}")
    descriptor = os.open(scratch, os.O_WRONLY | os.O_CREAT | os.O_TRUNC, 0o600)
    with os.fdopen(descriptor, "w", encoding="ascii") as file:
        file.write(text)
    os.replace(scratch, path)
