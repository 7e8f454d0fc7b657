"""A new pack: a copy of TEST-v1 under another name and country, all drafts, or an empty one that extends another."""

import json
import re
from pathlib import Path
from typing import Any

import msgspec

from drivemcp.files.packfiles import FILES
from drivemcp.files.place_names import installed
from drivemcp.paths import data
from services.rules.authoring.seal import seal
from services.rules.errors import PackError
from services.rules.packs.files import write_json
from services.rules.packs.loading import load, parent_folder

TEMPLATE = "rulepacks/TEST-v1"
_ID = re.compile(r"[A-Za-z0-9][A-Za-z0-9.-]{0,63}")
_PLACE = re.compile(r"[A-Z]{3}(-[A-Z0-9]{1,3})?")


def scaffold(folder: Path, jurisdiction: str | None = None, title: str = "", extends: str = "") -> None:
    """Write a pack: drafts, or nothing yet beside what it extends. Raises PackError where there is something already."""
    if not _ID.fullmatch(folder.name):
        raise PackError(f"{folder.name!r} is no name for a pack: letters, digits, dots and hyphens, as in DEU-v1")
    if folder.exists():
        raise PackError(f"{folder} exists already")
    parent = load(parent_folder(folder, extends)).manifest if extends else None
    place = jurisdiction or (parent.jurisdiction if parent else "ZZZ")
    if not _PLACE.fullmatch(place):
        raise PackError(f"{place!r} is no ISO 3166 alpha-3 code, as in DEU or USA-CA")
    manifest = _json(data(TEMPLATE) / "manifest.json")
    manifest |= {"id": folder.name, "jurisdiction": place, "title": title or folder.name, "version": "1.0.0"}
    manifest["names"] = {} if parent else names_of(place)
    (folder / "sources").mkdir(parents=True)
    if parent is None:
        _copied(folder, place)
    else:
        kept = ("units", "traffic_side", "languages", "precedence", "plausible_limits")
        manifest |= {key: msgspec.to_builtins(getattr(parent, key)) for key in kept}
        manifest["extends"] = {"id": parent.id, "version": parent.version}
        for name in FILES[1:]:
            write_json(folder / name, [])
    write_json(folder / "manifest.json", manifest)
    seal(folder)


def names_of(place: str) -> dict[str, Any]:
    """What an installed pack calls the country, for a new pack's manifest; nothing where none names it."""
    named = installed().get(place[:3])
    return {place[:3]: msgspec.to_builtins(named)} if named else {}


def _copied(folder: Path, place: str) -> None:
    """The template's content with its ids and its country renamed, as drafts: it is no country's law."""
    prefix = place[:3].lower()
    for path in (*(data(TEMPLATE) / name for name in FILES[1:]), *(data(TEMPLATE) / "sources").glob("*.md")):
        text = re.sub(r"\btest-(?=[a-z])", f"{prefix}-", path.read_text(encoding="utf-8"))
        text = (
            text.replace("/test-act/", "/act/")
            .replace(f"/{prefix}-act/", "/act/")
            .replace('"ZZZ"', f'"{place}"')
            .replace("ZZZ", place[:3])
        )
        target = folder / ("sources" if path.suffix == ".md" else "") / path.name
        target.write_text(text, encoding="utf-8")
    for name in ("provisions.json", "signs.json"):
        write_json(folder / name, [{**entry, "draft": True} for entry in _json(folder / name)])


def _json(path: Path) -> Any:
    return json.loads(path.read_text(encoding="utf-8"))
