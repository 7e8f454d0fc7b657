"""For editors of a pack: finds the offsets of every text again and writes the content hash.

In a source document each text is the paragraph below a heading that ends in its id: `## StVO § 3 Abs. 1 [deu-speed-adapt]`.
"""

import re
from pathlib import Path
from typing import Any

from services.rules.errors import PackError
from services.rules.packs.files import SIGNATURE, Files, decoded, read_files, write_json
from services.rules.packs.loading import content_hash

_HEADING = re.compile(r"^## (?P<section>[^\n]*) \[(?P<id>[^\]\n]+)\]\n\n(?P<text>[^\n]+(?:\n[^\n]+)*)", re.M)


def paragraphs(text: str) -> dict[str, tuple[str, int, int]]:
    """Section, start and end of the text below each heading, by id."""
    return {m["id"]: (m["section"], m.start("text"), m.end("text")) for m in _HEADING.finditer(text)}


def seal(folder: Path) -> str:
    """Rewrite offsets, excerpts and the hash of a pack in place; the new hash. Raises PackError."""
    files = read_files(folder)
    for problem in files.unread():
        raise PackError(str(problem))
    for file, key, prefix in (("provisions.json", "id", ""), ("signs.json", "code", "sign:")):
        entries = _content(files, file, list[dict[str, Any]])
        for index, entry in enumerate(entries):
            if not isinstance(entry.get(key), str) or not isinstance(entry.get("sources"), list):
                problem = files.problem(file, (index,), f"has no {key} or no sources", "add both")
                raise PackError(str(problem))
            _relocate(files, entry, prefix + entry[key])
        write_json(folder / file, entries)
    manifest = _content(files, "manifest.json", dict[str, Any])
    before, manifest["content_sha256"] = manifest.get("content_sha256"), content_hash(folder)
    if manifest["content_sha256"] != before:
        (folder / SIGNATURE).unlink(missing_ok=True)  # it signed another content
    write_json(folder / "manifest.json", manifest)
    return str(manifest["content_sha256"])


def _content(files: Files, name: str, kind: Any) -> Any:
    found, problems = decoded(files, name, kind)
    if problems:
        raise PackError(str(problems[0]))
    return found


def _relocate(files: Files, entry: dict[str, Any], name: str) -> None:
    section = ""
    for source in entry["sources"]:
        document = source.get("document") if isinstance(source, dict) else None
        if document not in files.content:
            raise PackError(
                f"{files.folder}: [{name}] cites {document!r}, which is no document of this pack; name one of sources/"
            )
        text = files.text(document)
        if name not in (found := paragraphs(text)):
            raise PackError(
                f"{files.folder / document}: no heading ends in [{name}]; write one above its text: ## SECTION [{name}]"
            )
        section, source["start"], source["end"] = found[name]
        source["excerpt"] = text[source["start"] : source["end"]]
    entry["section"] = section
