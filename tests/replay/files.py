"""The lock's files: gzipped lines of JSON with no clock in them, and the table of digests."""

import gzip
import hashlib
from collections.abc import Iterable
from pathlib import Path
from typing import Any, TypeVar

import msgspec

HERE = Path(__file__).parent
LOCK, LOGS, DRIVES = HERE / "lock.json", HERE / "logs", HERE / "drives"
Parts = dict[str, Any]
"""What one tick came to, by part: JSON data."""
PARTS = ("events", "calls", "decision", "advisory")
T = TypeVar("T")


class Lock(msgspec.Struct, frozen=True, kw_only=True):
    """Name -> one row of digests a tick; of drives one digest a message, by topic."""

    logs: dict[str, tuple[str, ...]] = {}
    drives: dict[str, dict[str, tuple[str, ...]]] = {}
    processor: str = ""
    """The processor and the renderer of the drives: on another one pixels, and what is read from them, may differ."""


def read_lock() -> Lock:
    """The lock as committed; an empty one where there is no file."""
    return msgspec.json.decode(LOCK.read_bytes(), type=Lock) if LOCK.exists() else Lock()


def write_lock(lock: Lock) -> None:
    """One digest row a line, so that a review shows where behaviour begins to differ."""
    LOCK.write_bytes(msgspec.json.format(msgspec.json.encode(lock, order="sorted"), indent=1) + b"\n")


def read_lines(file: Path, kind: type[T]) -> list[T]:
    """The values of a gzipped file, a line each."""
    return [msgspec.json.decode(line, type=kind) for line in gzip.decompress(file.read_bytes()).splitlines()]


def write_lines(file: Path, values: Iterable[Any]) -> None:
    """The same values give the same bytes."""
    file.parent.mkdir(parents=True, exist_ok=True)
    whole = b"".join(msgspec.json.encode(value, order="sorted") + b"\n" for value in values)
    file.write_bytes(gzip.compress(whole, mtime=0))


def stated(value: Any) -> Any:
    """A message as JSON data without fields that have their default: a field that is added changes no digest."""
    if isinstance(value, msgspec.Struct):
        fields = ((field, getattr(value, field.name)) for field in msgspec.structs.fields(value))
        return {field.encode_name: stated(each) for field, each in fields if each != field.default}
    if isinstance(value, list | tuple):
        return [stated(each) for each in value]
    return (
        {name: stated(each) for name, each in value.items()} if isinstance(value, dict) else msgspec.to_builtins(value)
    )


def digest(value: Any) -> str:
    """The first 8 hex digits of the SHA-256 of the value as canonical JSON."""
    return hashlib.sha256(msgspec.json.encode(value, order="sorted")).hexdigest()[:8]


def digests(parts: Parts) -> str:
    """A row of the lock: one digest for each of `PARTS`."""
    return " ".join(digest(parts[name]) for name in PARTS)
