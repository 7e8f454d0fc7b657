"""Writes the JSON Schemas of a pack's files: `python -m services.rules.schemas`. A test keeps `schemas/` in step."""

import sys
from pathlib import Path
from typing import Any

import msgspec

from services.rules.packs.format import Case, Manifest, Provision, Sign
from services.rules.packs.signature import Signature

FOLDER = Path(__file__).parent / "schemas"
KINDS: dict[str, Any] = {
    "manifest": Manifest,
    "provisions": list[Provision],
    "signs": list[Sign],
    "cases": list[Case],
    "signature": Signature,
}


def schemas() -> dict[str, bytes]:
    """File name to content, one per file of a pack."""
    return {
        f"{name}.schema.json": msgspec.json.format(
            msgspec.json.encode(
                {
                    "$schema": "https://json-schema.org/draft/2020-12/schema",
                    "title": f"{name}.json of a rulepack",
                    **msgspec.json.schema(kind),
                },
                order="sorted",
            )
        )
        + b"\n"
        for name, kind in KINDS.items()
    }


def main() -> int:
    """Write them."""
    FOLDER.mkdir(exist_ok=True)
    for name, content in schemas().items():
        (FOLDER / name).write_bytes(content)
    sys.stdout.write(f"{len(KINDS)} schemas in {FOLDER}\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
