"""The hashes of the packs that are shipped, beside the code and not beside the packs: `python scripts/pins.py` writes them."""

from collections.abc import Iterable
from functools import cache
from pathlib import Path

import msgspec

from drivemcp.paths import data, has_data
from services.rules.packs.format import Manifest

FILE = Path(__file__).with_name("pins.json")


@cache
def pins() -> dict[str, str]:
    """Content hash by id of a pack that is shipped."""
    return msgspec.json.decode(FILE.read_bytes(), type=dict[str, str])


def unlike_shipped(manifests: Iterable[Manifest]) -> tuple[str, ...]:
    """Those that bear the name of a shipped pack and hold something else: a line each. The hash of a loaded pack is its content's."""
    found = []
    for one in {manifest.id: manifest for manifest in manifests}.values():
        pinned = pins().get(one.id)
        if pinned is not None and one.content_sha256 != pinned:
            found.append(
                f"{one.id} is not as it was shipped: content {one.content_sha256[:12]}, shipped was {pinned[:12]}"
            )
    return tuple(found)


def missing() -> tuple[str, ...]:
    """Shipped packs that the installation does not hold any more: a line each."""
    return tuple(
        f"{name} was shipped and is not there"
        for name in sorted(pins())
        if not has_data(f"rulepacks/{name}") or not (data(f"rulepacks/{name}") / "manifest.json").is_file()
    )
