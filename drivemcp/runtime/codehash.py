"""What code decided: a digest of the sources of some packages, for the trace. A replay by other code can then say so."""

import hashlib
from collections.abc import Sequence
from functools import cache
from importlib.util import find_spec
from pathlib import Path


@cache
def code_hash(*packages: str) -> str:
    """The first 12 hex digits of the SHA-256 over all `.py`, `.toml` and `.json` files of the packages, by name and content.

    Raises ModuleNotFoundError for a package that is not there.
    """
    digest = hashlib.sha256()
    for package in sorted(packages):
        for root in _roots(package):
            for path in sorted(Path(root).rglob("*")):
                if path.suffix in (".py", ".toml", ".json"):
                    digest.update(f"{package}/{path.relative_to(root)}".encode() + b"\0" + path.read_bytes())
    return digest.hexdigest()[:12]


def _roots(package: str) -> Sequence[str]:
    """Where its files lie."""
    spec = find_spec(package)
    if spec is None or not spec.submodule_search_locations:
        raise ModuleNotFoundError(f"{package!r} is no package, so there is no code of it to digest", name=package)
    return spec.submodule_search_locations
