"""What is said of a corruption: one record per encounter or window, on a topic of the evaluation's own and in a file."""

from collections import Counter
from pathlib import Path
from typing import Literal

import msgspec

from drivemcp.node import Node
from proto.topics import Topic

Kind = Literal["sign_miss", "limit_misread", "dropout", "blackout", "freeze", "lidar_loss"]
FILE = "corruption.jsonl"


class Corrupted(msgspec.Struct, frozen=True, kw_only=True):
    """One decision. Of signs the spared encounters are told too (`hit` false), so that a rate can be counted."""

    kind: Kind
    subject: str
    """`sign/<id>`, `actor/<id>` where truth tells which; else the first track; a camera; a LiDAR."""
    stamp_ns: int
    hit: bool = True
    until_ns: int = 0
    """The end of a window; 0: for the whole encounter."""
    before: str = ""
    after: str = ""


CORRUPTED: Topic[Corrupted] = Topic(
    name="evaluation/corruption/<id>",
    message=Corrupted,
    rate_hz=0,
    max_age_ms=0,
    publishers=("simulator", "player", "perception", "drivelm"),
    readers=("evaluation",),
    encoding="json",
    logged="never",
    private=True,
)


class CorruptionLog:
    """Writes what is told to `corruption.jsonl` in the drive's folder, and counts."""

    def __init__(self, folder: Path) -> None:
        self._file = folder / FILE
        self.hits: Counter[str] = Counter()
        self.judged: Counter[str] = Counter()

    def follow(self, node: Node) -> None:
        """Listen from now on."""
        node.subscribe(CORRUPTED, lambda message, _: self.add(message))

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
