"""Writes the JSON Schemas of all messages and of a rulepack's files: `python scripts/schemas.py`. A test keeps them in step."""

import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import msgspec

ROOT = Path(__file__).parents[1]
if __name__ == "__main__":
    sys.path.insert(0, str(ROOT))

from proto.topics import TOPICS  # noqa: E402
from services.rules.packs.format import Case, Manifest, Provision, Sign  # noqa: E402
from services.rules.packs.signature import Signature  # noqa: E402

MESSAGES, PACKS = ROOT / "proto/schemas", ROOT / "services/rules/schemas"
FILES: Mapping[str, Any] = {
    "manifest": Manifest,
    "provisions": list[Provision],
    "signs": list[Sign],
    "cases": list[Case],
    "signature": Signature,
}


def of_messages() -> dict[str, bytes]:
    """File name to content, one for each message type of the topic table."""
    kinds: dict[str, Any] = {topic.message.__name__: topic.message for topic in TOPICS}
    return {f"{name}.json": _file(msgspec.json.schema(kind)) for name, kind in sorted(kinds.items())}


def of_packs() -> dict[str, bytes]:
    """File name to content, one for each file of a pack."""
    head = {"$schema": "https://json-schema.org/draft/2020-12/schema"}
    return {
        f"{name}.schema.json": _file({**head, "title": f"{name}.json of a rulepack", **msgspec.json.schema(kind)})
        for name, kind in FILES.items()
    }


def _file(schema: Mapping[str, Any]) -> bytes:
    return msgspec.json.format(msgspec.json.encode(schema, order="sorted")) + b"\n"


def main() -> int:
    """Write them, and remove those of what is no more."""
    for folder, wanted in ((MESSAGES, of_messages()), (PACKS, of_packs())):
        folder.mkdir(exist_ok=True)
        for stale in {path.name for path in folder.glob("*.json")} - set(wanted):
            (folder / stale).unlink()
        for name, content in wanted.items():
            (folder / name).write_bytes(content)
        sys.stdout.write(f"{len(wanted)} schemas in {folder}\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
