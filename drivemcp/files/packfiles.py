"""The files of a rulepack, where they lie, and the hash of what is in them: each service that uses a pack checks it by the same rule."""

import hashlib
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

import msgspec

from drivemcp.paths import data, has_data

FILES = ("manifest.json", "provisions.json", "signs.json", "cases.json")
SOURCES = "sources/"


def folder_of(name: str) -> Path:
    """The folder of a pack given by its name below `rulepacks/`, or by a path."""
    if "/" in name or not has_data(f"rulepacks/{name}"):
        return Path(name)
    return data(f"rulepacks/{name}")


def read_content(folder: Path, also: Iterable[str] = ()) -> dict[str, bytes]:
    """Every file of a pack, and those named beside, once: by its name below the folder. What cannot be read is absent."""
    paths = (*(folder / name for name in (*FILES, *also)), *sorted((folder / SOURCES).glob("*.md")))
    content: dict[str, bytes] = {}
    for path in paths:
        try:
            content[path.relative_to(folder).as_posix()] = path.read_bytes()
        except OSError:
            continue
    return content


def content_sha256(values: Mapping[str, Any], content: Mapping[str, bytes]) -> str:
    """Over the canonical content: every JSON file with sorted keys, every source document as it is.

    `values`: what the files of `FILES` hold. The manifest's own `content_sha256` is left out.
    """
    digest = hashlib.sha256()
    parts = [(name, _canonical(name, values[name])) for name in FILES]
    parts += [(name, content[name]) for name in sorted(content) if name.startswith(SOURCES)]
    for name, part in parts:
        digest.update(f"{name}\0{len(part)}\0".encode() + part)
    return digest.hexdigest()


def _canonical(name: str, value: Any) -> bytes:
    if name == "manifest.json" and isinstance(value, dict):
        value = {key: part for key, part in value.items() if key != "content_sha256"}
    return msgspec.json.encode(value, order="deterministic")
