"""Writes the JSON Schemas of all messages: `python -m proto.generate`. A test keeps `proto/schemas/` in step."""

import sys
from pathlib import Path
from typing import Any

import msgspec

from proto.topics import TOPICS

FOLDER = Path(__file__).parent / "schemas"


def schemas() -> dict[str, bytes]:
    """File name to content, one per message type of the topic table."""
    kinds: dict[str, Any] = {topic.message.__name__: topic.message for topic in TOPICS}
    return {
        f"{name}.json": msgspec.json.format(msgspec.json.encode(msgspec.json.schema(kind), order="sorted")) + b"\n"
        for name, kind in sorted(kinds.items())
    }


def main() -> int:
    """Write them, and remove those of messages that are no more."""
    FOLDER.mkdir(exist_ok=True)
    wanted = schemas()
    for stale in {path.name for path in FOLDER.glob("*.json")} - set(wanted):
        (FOLDER / stale).unlink()
    for name, content in wanted.items():
        (FOLDER / name).write_bytes(content)
    sys.stdout.write(f"{len(wanted)} schemas in {FOLDER}\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
