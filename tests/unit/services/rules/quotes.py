"""Whether every citation of an answer is what stands at its offsets in its document."""

import json
from collections.abc import Iterable, Iterator
from contextlib import contextmanager, suppress
from functools import cache
from pathlib import Path
from typing import Any

import pytest

from drivemcp.paths import data
from proto.rules import Citation
from services.rules import citing
from services.rules.errors import PackError
from services.rules.packs import loading
from services.rules.packs.files import Files, read_files
from services.rules.packs.format import Source
from services.rules.packs.loading import Pack

Texts = dict[tuple[str, str], Files]
"""Files by pack id and the first 12 of its content hash: what a version tag names."""


def misquoted(citations: Iterable[Citation]) -> list[str]:
    """Citations that name no document of a shipped pack, or no provision, or not the text at their offsets."""
    return [f"{c.document}[{c.start}:{c.end}]" for c in citations if not _stands(c)]


def _stands(citation: Citation) -> bool:
    at = _text(data("rulepacks") / citation.document)[citation.start : citation.end]
    return bool(citation.excerpt and citation.section and citation.provision) and at == citation.excerpt


@cache
def _text(path: Path) -> str:
    return path.read_text(encoding="utf-8")


@contextmanager
def every_quotation_checked() -> Iterator[None]:
    """Whatever is cited meanwhile, from shipped packs or from edited copies, must be the text at its offsets."""
    read: Texts = {}
    make = citing._citation

    def noted(folder: Path) -> Files:
        files = read_files(folder)
        manifest = _manifest(files)
        with suppress(PackError):  # by content: an edited copy may state another's hash, or be no pack at all
            read[str(manifest.get("id")), files.sha256()[:12]] = files
        return files

    def checked(pack: Pack, name: str, section: str, kind: str, source: Source) -> Citation:
        made = make(pack, name, section, kind, source)
        home, _, document = made.document.partition("/")
        tag = pack.origin[name].partition("#")[2]
        if (home, tag) not in read:  # loaded before this began
            noted(data(f"rulepacks/{home}"))
        files = read.get((home, tag))  # none: the pack was changed on the disk since
        assert files is None or files.text(document)[made.start : made.end] == made.excerpt != "", made
        return made

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(loading, "read_files", noted)
        patch.setattr(citing, "_citation", checked)
        yield


def _manifest(files: Files) -> dict[str, Any]:
    try:
        found: Any = json.loads(files.content.get("manifest.json", b"{}"))
    except ValueError:
        return {}
    return found if isinstance(found, dict) else {}
