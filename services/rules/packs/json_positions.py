"""Where in a JSON file a field stands: the line of a path such as `[3].sources[0].start`."""

import re
from collections import Counter
from collections.abc import Iterator
from functools import lru_cache

Path = tuple[str | int, ...]
_TOKEN = re.compile(r'"(?:[^"\\]|\\.)*"|[{}\[\]:,]|[^\s{}\[\]:,"]+', re.S)
_DEEPEST = 16
"""No field of a pack lies deeper; what does is not looked for."""
_PART = re.compile(r"\.([^.\[\]]+)|\[(\d+)\]")


def line_of(text: str, path: Path) -> int:
    """The line (from 1) of the value at a path, or of the deepest part of the path that is there."""
    found = _index(text)
    deepest = next(path[:depth] for depth in range(len(path), -1, -1) if path[:depth] in found)
    return text.count("\n", 0, found[deepest]) + 1


def repeated(text: str) -> tuple[Path, ...]:
    """Paths of names that stand twice in one object: the last one counts."""
    counts = Counter(path for path, _ in _places(text))
    return tuple(path for path, count in counts.items() if count > 1)


def written(path: Path) -> str:
    """`[3].sources[0]`, as people write it."""
    return "".join(f"[{part}]" if isinstance(part, int) else f".{part}" for part in path).lstrip(".")


def parsed(text: str) -> Path:
    """The path of msgspec's `$[3].sources[0].start`; what lies below `[...]`, a key that is not named, is left out."""
    named = text.removeprefix("$").partition("[...]")[0]
    return tuple(int(index) if index else name for name, index in _PART.findall(named))


@lru_cache(maxsize=4)
def _index(text: str) -> dict[Path, int]:
    """Where the value at each path begins; of a name that stands twice the first."""
    found: dict[Path, int] = {}
    for path, start in _places(text):
        found.setdefault(path, start)
    return found


def _places(text: str) -> Iterator[tuple[Path, int]]:
    """Every value's path and where it begins (a member's: where its name begins), in the file's order."""
    frames: list[str | int] = []
    naming = False
    yield (), 0
    for token in _TOKEN.finditer(text):
        word = token[0]
        if word in "}]":
            if frames:
                frames.pop()
            naming = False
            continue
        if word == ",":
            if frames and isinstance(frames[-1], int):
                frames[-1] += 1
            else:
                naming = True
            continue
        if word == ":":
            naming = False
            continue
        if naming:
            frames[-1:] = [word[1:-1]]
        if (naming or (frames and isinstance(frames[-1], int))) and len(frames) <= _DEEPEST:
            yield tuple(frames), token.start()
        if not naming and word in "{[":
            frames.append("" if word == "{" else 0)
            naming = word == "{"
