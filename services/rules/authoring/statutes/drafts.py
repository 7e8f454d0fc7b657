"""A statute as drafts of a pack: a source document and provisions that `validate` asks to be restated and given effects."""

import json
import re
import unicodedata
from pathlib import Path
from typing import Any

import msgspec

from drivemcp.files.packfiles import FILES, read_regular
from drivemcp.paths import data
from services.rules.authoring.scaffold import TEMPLATE, names_of
from services.rules.authoring.seal import seal
from services.rules.authoring.statutes import akomantoso, clml, gii
from services.rules.authoring.statutes.leftovers import kept
from services.rules.authoring.statutes.marks import formulas
from services.rules.authoring.statutes.marks.lists import number_lists
from services.rules.authoring.statutes.statute import Section, Statute, local, parse
from services.rules.errors import PackError
from services.rules.packs.files import write_json

_NOTE = "> Draft: the publisher's own text, to be restated in our own words. Only the official version is binding."
_ID = 90


def import_statute(file: Path, folder: Path, prefix: str = "", jurisdiction: str = "") -> Statute:
    """Add a statute to a pack; a pack that does not exist is begun. Raises PackError."""
    statute = read_statute(file)
    place = jurisdiction or statute.jurisdiction or "ZZZ"
    if not (folder / "manifest.json").exists():
        _begin(folder, statute, place)
    provisions: list[dict[str, Any]] = _json(folder / "provisions.json")
    taken = {entry.get("id") for entry in provisions}
    start = prefix or f"{place[:3].lower()}-{slug(statute.short)}"
    document = f"sources/{slug(statute.short) or 'statute'}.{statute.language}.md"
    if (folder / document).exists():
        raise PackError(f"{folder / document} exists already; a statute is imported once")
    parts = [f"# {_line(statute.title)}", _NOTE]
    for section in statute.sections:
        name = _free(f"{start}-{slug(section.key)}"[:_ID].strip("-"), taken)
        taken.add(name)
        parts.append(f"## {_line(section.cited)} [{name}]\n\n{_line(section.text)}")
        provisions.append(_provision(name, section, document, statute.language))
    (folder / "sources").mkdir(exist_ok=True)
    (folder / document).write_text("\n\n".join(parts) + "\n", encoding="utf-8")
    write_json(folder / "provisions.json", provisions)
    seal(folder)
    return statute


def read_statute(path: Path) -> Statute:
    """A statute from a file. Raises PackError, naming the file and what is not right."""
    root = parse(path)
    for reader in (gii, clml, akomantoso):
        if local(root) in reader.ROOTS:
            number_lists(root)
            lines = formulas.write_formulas(root)
            found: Statute = kept(reader.read(root))
            if not found.sections:
                told = "".join(f"; {each}" for each in found.left)
                raise PackError(f"{path}: no section with text was found{told}")
            return msgspec.structs.replace(found, left=found.left + formulas.told(lines, found.sections))
    raise PackError(
        f"{path}: <{local(root)}> is not gesetze-im-internet's XML, legislation.gov.uk's CLML or Akoma Ntoso"
    )


def slug(text: str) -> str:
    """Lower-case ASCII letters and digits with hyphens between: `StVO 2013` → `stvo-2013`."""
    plain = unicodedata.normalize("NFKD", text.replace("ß", "ss")).encode("ascii", "ignore").decode().lower()
    return re.sub(r"[^a-z0-9]+", "-", plain).strip("-")


def _provision(name: str, section: Section, document: str, language: str) -> dict[str, Any]:
    made: dict[str, Any] = {
        "id": name,
        "section": section.cited,
        "kind": "statute",
        "sources": [{"language": language, "document": document, "start": 0, "end": 0, "excerpt": ""}],
        "effects": [],
        "draft": True,
    }
    return (
        made
        | ({"url": section.url} if section.url else {})
        | ({"topics": {language: section.heading}} if section.heading else {})
    )


def _begin(folder: Path, statute: Statute, place: str) -> None:
    manifest = _json(data(TEMPLATE) / "manifest.json")
    manifest |= {"id": folder.name, "title": statute.title, "jurisdiction": place, "version": "0.1.0"}
    manifest["names"] = names_of(place)
    manifest |= {"languages": [statute.language], "disclaimer": _NOTE.removeprefix("> ")}
    (folder / "sources").mkdir(parents=True, exist_ok=True)
    for name in FILES[1:]:
        write_json(folder / name, [])
    write_json(folder / "manifest.json", manifest)


def _free(name: str, taken: set[Any]) -> str:
    at = 2
    found = name
    while found in taken:
        found, at = f"{name}-{at}", at + 1
    return found


def _line(text: str) -> str:
    """One line without square brackets, which end a heading."""
    return " ".join(text.replace("[", "(").replace("]", ")").split())


def _json(path: Path) -> Any:
    try:
        return json.loads(read_regular(path).decode("utf-8-sig"))
    except (OSError, ValueError) as error:
        raise PackError(f"{path}: {error}") from None
