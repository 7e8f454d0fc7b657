"""What must hold of a pack beyond the types of its fields. Each check yields what is wrong, with its place."""

from collections.abc import Iterator, Sequence
from datetime import date
from pathlib import PurePosixPath

from services.rules.errors import Problem
from services.rules.packs.files import Files
from services.rules.packs.format import Extends, Manifest, Provision, Sign, Source

KINDS = ["guidance", "sign_table", "statute"]
_DAY = "is no date of the form 2025-01-31"


def version_numbers(text: str) -> tuple[int, int, int] | None:
    """`1.2.3` as numbers, None for what is no version."""
    parts = text.split(".")
    if len(parts) != 3 or not all(part.isascii() and part.isdigit() and len(part) < 10 for part in parts):
        return None
    return int(parts[0]), int(parts[1]), int(parts[2])


def check_manifest(files: Files, manifest: Manifest) -> Iterator[Problem]:
    """Version, dates, languages, order of precedence, plausible limits."""

    def wrong(field: str, message: str) -> Problem:
        return files.problem("manifest.json", (field,), message)

    if version_numbers(manifest.version) is None:
        yield wrong("version", f"{manifest.version!r} is no version of the form 1.2.3")
    begin, until = _day(manifest.effective_from), _day(manifest.effective_until or "9999-12-31")
    if begin is None:
        yield wrong("effective_from", f"{manifest.effective_from!r} {_DAY}")
    if until is None:
        yield wrong("effective_until", f"{manifest.effective_until!r} {_DAY}")
    elif begin is not None and until < begin:
        yield wrong("effective_until", f"{manifest.effective_until} lies before effective_from")
    if not manifest.languages:
        yield wrong("languages", "must not be empty")
    if sorted(manifest.precedence) != KINDS:
        yield wrong("precedence", "must order statute, sign_table and guidance, each once")
    if not manifest.plausible_limits:
        yield wrong("plausible_limits", "must not be empty")
    for road, (low, high) in manifest.plausible_limits.items():
        if low > high:
            yield files.problem("manifest.json", ("plausible_limits", road), f"{low:g} lies above {high:g}")


def check_twice(files: Files, name: str, key: str, entries: Sequence[object]) -> Iterator[Problem]:
    """No id or code stands in a file twice."""
    seen: set[str] = set()
    for index, entry in enumerate(entries):
        if (found := getattr(entry, key, None)) is not None:
            if found in seen:
                yield files.problem(name, (index, key), f"{found!r} stands there twice")
            seen.add(found)


def check_provisions(files: Files, entries: Sequence[Provision | None], manifest: Manifest | None) -> Iterator[Problem]:
    """Texts at their offsets, no drafts, parts of the own country, its unit."""
    for index, entry in enumerate(entries):
        if entry is None:
            continue
        if entry.draft:
            message = "is a draft: restate the text in your own words, give it effects, then remove this line"
            yield files.problem("provisions.json", (index, "draft"), message, entry.id)
        elif not entry.effects:
            yield files.problem("provisions.json", (index, "effects"), "at least one is needed", entry.id)
        yield from check_sources(files, "provisions.json", index, entry.id, entry.sources)
        for at, effect in enumerate(entry.effects):
            part = getattr(getattr(effect, "when", None), "subdivision", None)
            if part is not None and manifest is not None and part[:3] != manifest.jurisdiction[:3]:
                path = (index, "effects", at, "when", "subdivision")
                yield files.problem("provisions.json", path, f"{part} is no part of {manifest.jurisdiction}", entry.id)
            if manifest is not None and (unit := getattr(effect, "unit", manifest.units)) != manifest.units:
                yield files.problem("provisions.json", (index, "effects", at, "unit"), _unit(unit, manifest), entry.id)


def check_signs(files: Files, entries: Sequence[Sign | None], manifest: Manifest | None) -> Iterator[Problem]:
    """Texts at their offsets, at least one meaning, the country's unit, whom a plate about vehicles names."""
    for index, entry in enumerate(entries):
        if entry is None:
            continue
        if not entry.meaning:
            yield files.problem("signs.json", (index, "meaning"), "at least one language is needed", entry.code)
        if manifest is not None and entry.unit not in (None, manifest.units):
            yield files.problem("signs.json", (index, "unit"), _unit(entry.unit, manifest), entry.code)
        if entry.plate is not None and entry.plate.type == "vehicle" and not entry.plate.classes:
            message = "a plate about vehicles must say which"
            yield files.problem("signs.json", (index, "plate", "classes"), message, entry.code)
        yield from check_sources(files, "signs.json", index, entry.code, entry.sources)


def check_sources(files: Files, name: str, index: int, shown: str, sources: tuple[Source, ...]) -> Iterator[Problem]:
    """What is cited stands at its offsets in a document of this pack."""
    if not sources:
        yield files.problem(name, (index, "sources"), "at least one is needed", shown)
    for at, source in enumerate(sources):
        path = (index, "sources", at)
        inside = PurePosixPath(source.document)
        if ".." in inside.parts or inside.is_absolute():
            yield files.problem(name, path, f"document {source.document!r} lies outside the pack", shown)
        elif source.document not in files.content or not source.document.startswith("sources/"):
            yield files.problem(name, path, f"there is no document {source.document!r} (sources/*.md)", shown)
        elif not source.excerpt or files.text(source.document)[source.start : source.end] != source.excerpt:
            where = f"characters {source.start} to {source.end} of {source.document}"
            yield files.problem(
                name, path, f"{where} are not the excerpt (after an edit: drivemcp rulepack seal)", shown
            )


def check_references(files: Files, entries: Sequence[Sign | None], known: set[str]) -> Iterator[Problem]:
    """Signs name provisions that are there, the pack's own or inherited."""
    for index, entry in enumerate(entries):
        for at, name in enumerate(entry.provisions if entry is not None else ()):
            if name not in known:
                shown = entry.code if entry is not None else ""
                yield files.problem("signs.json", (index, "provisions", at), f"no provision {name!r}", shown)


def check_parent(files: Files, wanted: Extends, parent: Manifest) -> Iterator[Problem]:
    """The pack that is extended is the one it was written against, or a later one of the same major version."""
    have, need = version_numbers(parent.version), version_numbers(wanted.version)
    if have is None or need is None or have[0] != need[0] or have < need:
        message = f"needs {wanted.id} {wanted.version}, found {parent.version}"
        yield files.problem("manifest.json", ("extends",), message)
    if parent.id != wanted.id:
        yield files.problem("manifest.json", ("extends", "id"), f"that folder holds {parent.id}")


def check_hash(files: Files, manifest: Manifest) -> Iterator[Problem]:
    """The manifest names the content's hash."""
    found = files.sha256()
    if found != manifest.content_sha256:
        said = f"says {manifest.content_sha256[:12]}, the content has {found[:12]}"
        message = f"{said}; after an intended change run: drivemcp rulepack seal {files.folder}"
        yield files.problem("manifest.json", ("content_sha256",), message)


def _unit(unit: str | None, manifest: Manifest) -> str:
    return f"{unit} is not the unit of {manifest.jurisdiction}, {manifest.units}"


def _day(text: str) -> date | None:
    try:
        return date.fromisoformat(text)
    except ValueError:
        return None
