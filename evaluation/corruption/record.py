"""What is said of a corruption, one record per encounter or window: counted, and kept in a file beside the drive."""

from collections import Counter
from pathlib import Path

import msgspec

from drivemcp.node import Node
from proto import topics
from proto.truth import Corrupted

FILE = "corruption.jsonl"


class CorruptionLog:
    """Writes what is told to `corruption.jsonl` in the drive's folder, and counts."""

    def __init__(self, folder: Path) -> None:
        self._file = folder / FILE
        self.hits: Counter[str] = Counter()
        self.judged: Counter[str] = Counter()

    def follow(self, node: Node) -> None:
        """Listen from now on."""
        node.subscribe(topics.CORRUPTED, lambda message, _: self.add(message))

    def add(self, record: Corrupted) -> None:
        """One more."""
        self.judged[record.kind] += 1
        self.hits[record.kind] += record.hit
        with self._file.open("ab") as file:
            file.write(msgspec.json.encode(record) + b"\n")

    def line(self) -> str:
        """The counts in words."""
        counts = [
            f"{kind} {self.hits[kind]} of {self.judged[kind]}"
            if kind in ("sign_miss", "limit_misread")
            else f"{kind} {self.hits[kind]}"
            for kind in sorted(self.judged)
        ]
        return f"{'corrupted':21} {', '.join(counts) or 'nothing came to be corrupted'}"


def read_records(folder: Path) -> tuple[Corrupted, ...]:
    """The records of a drive's folder, in the order in which they came; none where nothing was corrupted."""
    file = folder / FILE
    lines = file.read_bytes().splitlines() if file.exists() else []
    return tuple(msgspec.json.decode(line, type=Corrupted) for line in lines)
