"""Folders whose files may change while a service runs: noticed by a cheap look, told once the writer has paused."""

from collections.abc import Iterable, Sequence
from pathlib import Path

Stamp = tuple[tuple[str, int, int, int, int], ...]


def stamp(folder: Path, patterns: Sequence[str]) -> Stamp:
    """Names, sizes and times of the files that match: no file is opened."""
    found = []
    for path in sorted(path for pattern in patterns for path in folder.glob(pattern)):
        try:
            at = path.stat()
        except OSError:
            continue
        found.append((path.name, at.st_size, at.st_mtime_ns, at.st_ctime_ns, at.st_ino))
    return tuple(found)


class Watch:
    """Remembers how folders looked."""

    def __init__(self, patterns: Sequence[str]) -> None:
        self._patterns = tuple(patterns)
        self._known: dict[Path, Stamp] = {}
        self._seen: dict[Path, Stamp] = {}

    def remember(self, folders: Iterable[Path]) -> None:
        """They are about to be read as they are now; one that is known already stays as it was read."""
        for folder in folders:
            self._known.setdefault(folder, stamp(folder, self._patterns))

    def changed(self, folders: Iterable[Path]) -> frozenset[Path]:
        """Those that differ from what was remembered and look as at the last call; they are remembered as they are."""
        now = {folder: stamp(folder, self._patterns) for folder in folders}
        steady = {f for f, look in now.items() if look != self._known.get(f) and look == self._seen.get(f)}
        self._seen = now
        self._known |= {folder: now[folder] for folder in steady}
        return frozenset(steady)
