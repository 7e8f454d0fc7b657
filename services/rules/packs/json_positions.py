"""Where in a JSON file a field stands: the line of a path such as `[3].sources[0].start`."""

import re
from collections.abc import Iterator

Path = tuple[str | int, ...]
_TOKEN = re.compile(r'"(?:[^"\\]|\\.)*"|[{}\[\]:,]|[^\s{}\[\]:,"]+', re.S)
_PART = re.compile(r"\.([^.\[\]]+)|\[(\d+)\]")


def line_of(text: str, path: Path) -> int:
    """The line (from 1) of the value at a path, or of the deepest part of the path that is there."""
    best, offset = -1, 0
    for found, start in _places(text):
        if len(found) > best and found == path[: len(found)]:
            best, offset = len(found), start
            if best == len(path):
                break
    return text.count("\n", 0, offset) + 1


def written(path: Path) -> str:
    """`[3].sources[0]`, as people write it."""
    return "".join(f"[{part}]" if isinstance(part, int) else f".{part}" for part in path).lstrip(".")


def parsed(text: str) -> Path:
    """The path of msgspec's `$[3].sources[0].start`; what lies below `[...]`, a key that is not named, is left out."""
    named = text.removeprefix("$").partition("[...]")[0]
    return tuple(int(index) if index else name for name, index in _PART.findall(named))


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
            yield tuple(frames), token.start()
            continue
        if frames and isinstance(frames[-1], int):
            yield tuple(frames), token.start()
        if word in "{[":
            frames.append("" if word == "{" else 0)
            naming = word == "{"
