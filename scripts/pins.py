"""Writes the hashes of the rulepacks that are shipped: `python scripts/pins.py`, after a pack was sealed. A test keeps them in step."""

import sys
from pathlib import Path

import msgspec

ROOT = Path(__file__).parents[1]
if __name__ == "__main__":
    sys.path.insert(0, str(ROOT))

from services.rules.packs.loading import content_hash  # noqa: E402
from services.rules.packs.pins import FILE  # noqa: E402


def of_packs() -> bytes:
    """The file's content."""
    folders = sorted(path.parent for path in (ROOT / "rulepacks").glob("*/manifest.json"))
    return msgspec.json.format(msgspec.json.encode({folder.name: content_hash(folder) for folder in folders})) + b"\n"


def main() -> int:
    """Write it."""
    FILE.write_bytes(of_packs())
    sys.stdout.write(f"{FILE}\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
