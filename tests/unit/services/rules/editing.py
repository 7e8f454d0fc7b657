"""How tests change a pack's files."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

from services.rules.authoring.scaffold import scaffold
from services.rules.authoring.seal import seal
from services.rules.packs.loading import content_hash


def edit(path: Path, change: Callable[[Any], Any]) -> None:
    """Change what a JSON file holds, in place or by what `change` returns."""
    content = json.loads(path.read_text(encoding="utf-8"))
    changed = change(content)
    path.write_text(json.dumps(content if changed is None else changed, ensure_ascii=False, indent=1), encoding="utf-8")


def adopted(folder: Path, jurisdiction: str | None = None, extends: str = "") -> None:
    """A new pack whose drafts are taken for law as they stand."""
    scaffold(folder, jurisdiction, extends=extends)
    for name in ("provisions.json", "signs.json"):
        edit(folder / name, lambda entries: [{k: v for k, v in e.items() if k != "draft"} for e in entries])
    seal(folder)


def rehash(folder: Path) -> None:
    """As sealing does, without looking for offsets."""
    edit(folder / "manifest.json", lambda m: m.update(content_sha256=content_hash(folder)))


def set_limit(folder: Path, provision: str, value: float, *, sealed: bool = True) -> None:
    """Give a provision's first effect another value."""

    def change(provisions: list[dict[str, Any]]) -> None:
        next(p for p in provisions if p["id"] == provision)["effects"][0]["value"] = value

    edit(folder / "provisions.json", change)
    if sealed:
        rehash(folder)
