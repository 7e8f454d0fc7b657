"""What the installed rulepacks call their countries and parts, for services that load none."""

from collections.abc import Mapping
from functools import cache

import msgspec

from drivemcp.errors import MALFORMED
from drivemcp.paths import data, has_data
from proto.rules import PlaceName

Names = Mapping[str, PlaceName]
"""By language."""


class _Naming(msgspec.Struct, frozen=True):
    """What of a manifest names places."""

    names: dict[str, dict[str, PlaceName]] = {}


@cache
def installed() -> Mapping[str, Names]:
    """By place, ISO 3166 alpha-3 and its parts, what the packs that are shipped call it. A manifest that cannot be read names none."""
    found = dict[str, Names]()
    for path in sorted(data("rulepacks").glob("*/manifest.json")) if has_data("rulepacks") else ():
        try:
            found |= msgspec.json.decode(path.read_bytes(), type=_Naming).names
        except (OSError, *MALFORMED):
            continue
    return found


def named(names: Names, language: str) -> PlaceName | None:
    """In that language, else in English."""
    return names.get(language) or names.get("en")
