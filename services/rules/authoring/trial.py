"""A pack's cases, asked one after the other."""

from collections.abc import Callable
from pathlib import Path

import msgspec

from services.rules.authoring.cases import failures
from services.rules.book import load_book
from services.rules.errors import PackError


class Trial(msgspec.Struct, frozen=True, kw_only=True):
    """What came of it."""

    pack: str
    cases: int
    failed: int
    lines: tuple[str, ...]
    """Every expectation that does not hold."""


def tried(folder: Path, progress: Callable[[int, int], None] = lambda done, cases: None) -> Trial:
    """Ask every case of the pack alone, with what it extends. Raises PackError where it cannot be used."""
    book, refused = load_book([folder])
    if refused:
        raise PackError(refused[0])
    (pack,) = book.packs.values()
    lines: list[str] = []
    failed = 0
    for done, case in enumerate(pack.cases, start=1):
        try:
            found = failures(book, case)
        except PackError as error:
            found = [str(error)]
        lines += found
        failed += bool(found)
        progress(done, len(pack.cases))
    return Trial(pack=pack.version, cases=len(pack.cases), failed=failed, lines=tuple(lines))
