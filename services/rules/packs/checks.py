"""What must hold of a pack beyond the types of its fields. Each check yields what is wrong, with its place."""

from collections.abc import Iterator, Sequence
from datetime import date
from pathlib import PurePosixPath

from drivemcp.choices import nearest
from drivemcp.files.packfiles import SOURCES
from services.rules.errors import Problem
from services.rules.packs.files import Files
from services.rules.packs.format import Extends, Manifest, Provision, Sign, Source

_DRAFT = "is a draft, and no pack with a draft is loaded"
KINDS = ["guidance", "sign_table", "statute"]
_DATE = "write it as in 2025-01-31"


def version_numbers(text: str) -> tuple[int, int, int] | None:
    """`1.2.3` as numbers, None for what is no version."""
    parts = text.split(".")
    if len(parts) != 3 or not all(part.isascii() and part.isdigit() and len(part) < 10 for part in parts):
        return None
    return int(parts[0]), int(parts[1]), int(parts[2])


def check_manifest(files: Files, manifest: Manifest) -> Iterator[Problem]:
    """Version, dates, languages, order of precedence, plausible limits."""

    def wrong(field: str, message: str, remedy: str) -> Problem:
        return files.problem("manifest.json", (field,), message, remedy)

    if version_numbers(manifest.version) is None:
        yield wrong("version", f"{manifest.version!r} is no version", "write it as in 1.2.3")
    begin, until = _day(manifest.effective_from), _day(manifest.effective_until or "9999-12-31")
    if begin is None:
        yield wrong("effective_from", f"{manifest.effective_from!r} is no date", _DATE)
    if until is None:
        yield wrong("effective_until", f"{manifest.effective_until!r} is no date", _DATE)
    elif begin is not None and until < begin:
        message = f"{manifest.effective_until} lies before effective_from"
        yield wrong("effective_until", message, "give a later day, or null where no end is known")
    if not manifest.languages:
        yield wrong("languages", "is empty", "name the languages of the texts, the law's own first")
    yield from _check_names(files, manifest)
    if sorted(manifest.precedence) != KINDS:
        message = "does not order statute, sign_table and guidance, each once"
        yield wrong("precedence", message, "write all three, the one that counts most first")
    if not manifest.plausible_limits:
        yield wrong("plausible_limits", "is empty", "give each type of road its lowest and highest limit")
    for road, (low, high) in manifest.plausible_limits.items():
        if low > high:
            message = f"{low:g} lies above {high:g}"
            yield files.problem("manifest.json", ("plausible_limits", road), message, "write the lower limit first")


FALLBACK = "XXX"
"""Jurisdiction of the pack for where the country is unknown, or none is loaded for it: a code that ISO gives to no country."""
ALWAYS = "en"
"""The language that stands in for one that a text has not."""


def _check_names(files: Files, manifest: Manifest) -> Iterator[Problem]:
    """The pack's own country and its parts, each in English too; the fallback may name countries that have no pack."""
    own = manifest.jurisdiction[:3]

    def wrong(path: tuple[str, ...], message: str, remedy: str) -> Problem:
        return files.problem("manifest.json", ("names", *path), message, remedy)

    if manifest.names and own not in manifest.names:
        yield wrong((), f"{own} itself is not named", f"name {own} as well")
    for place, by_language in manifest.names.items():
        if place[:3] != own and manifest.jurisdiction != FALLBACK:
            yield wrong((place,), f"{place} is no part of {own}", f"name {own} and its parts alone")
        if ALWAYS not in by_language:
            yield wrong((place,), f"has no name in English ({ALWAYS})", "add one: other languages fall back to it")
        for language, name in by_language.items():
            if "-" not in place and not (name.inside and name.out_of):
                yield wrong(
                    (place, language), "lacks inside or out_of", "write both, as in `in Germany` and `from Germany`"
                )


def check_twice(files: Files, name: str, key: str, entries: Sequence[object]) -> Iterator[Problem]:
    """No id or code stands in a file twice."""
    seen: set[str] = set()
    for index, entry in enumerate(entries):
        if (found := getattr(entry, key, None)) is not None:
            if found in seen:
                remedy = f"remove one of them, or give it another {key}"
                yield files.problem(name, (index, key), f"{found!r} stands there twice", remedy)
            seen.add(found)


def check_provisions(files: Files, entries: Sequence[Provision | None], manifest: Manifest | None) -> Iterator[Problem]:
    """Texts at their offsets, no drafts, parts of the own country, its unit."""
    for index, entry in enumerate(entries):
        if entry is None:
            continue
        if entry.draft:
            remedy = "restate your country's law in your own words, give it effects, then remove this line; or remove the entry"
            yield files.problem("provisions.json", (index, "draft"), _DRAFT, remedy, entry.id)
        elif not entry.effects:
            remedy = "give at least one: what the text demands"
            yield files.problem("provisions.json", (index, "effects"), "is empty", remedy, entry.id)
        yield from check_sources(files, "provisions.json", index, entry.id, entry.sources)
        for at, effect in enumerate(entry.effects):
            part = getattr(getattr(effect, "when", None), "subdivision", None)
            if part is not None and manifest is not None and part[:3] != manifest.jurisdiction[:3]:
                path = (index, "effects", at, "when", "subdivision")
                message = f"{part} is no part of {manifest.jurisdiction}"
                remedy = f"write it as in {manifest.jurisdiction[:3]}-XX"
                yield files.problem("provisions.json", path, message, remedy, entry.id)
            if manifest is not None and (unit := getattr(effect, "unit", manifest.units)) != manifest.units:
                field = (index, "effects", at, "unit")
                yield files.problem("provisions.json", field, *_unit(unit, manifest), entry.id)


def check_signs(files: Files, entries: Sequence[Sign | None], manifest: Manifest | None) -> Iterator[Problem]:
    """Texts at their offsets, at least one meaning, the country's unit, whom a plate about vehicles names."""
    for index, entry in enumerate(entries):
        if entry is None:
            continue
        if entry.draft:
            remedy = "make it your country's sign, then remove this line; or remove the entry"
            yield files.problem("signs.json", (index, "draft"), _DRAFT, remedy, entry.code)
        if not entry.meaning:
            remedy = "say in at least one language what the sign means"
            yield files.problem("signs.json", (index, "meaning"), "is empty", remedy, entry.code)
        if manifest is not None and entry.unit not in (None, manifest.units):
            yield files.problem("signs.json", (index, "unit"), *_unit(entry.unit, manifest), entry.code)
        if entry.plate is not None and entry.plate.type == "vehicle" and not entry.plate.classes:
            message = "a plate about vehicles does not say which"
            path = (index, "plate", "classes")
            yield files.problem("signs.json", path, message, "list the classes of vehicle", entry.code)
        yield from check_sources(files, "signs.json", index, entry.code, entry.sources)


def check_sources(files: Files, name: str, index: int, shown: str, sources: tuple[Source, ...]) -> Iterator[Problem]:
    """What is cited stands at its offsets in a document of this pack."""
    if not sources:
        remedy = "give at least one: the document in which the text stands"
        yield files.problem(name, (index, "sources"), "is empty", remedy, shown)
    for at, source in enumerate(sources):
        path = (index, "sources", at)
        inside = PurePosixPath(source.document)
        if ".." in inside.parts or inside.is_absolute():
            message = f"document {source.document!r} lies outside the pack"
            yield files.problem(name, path, message, "put it into sources/ and name it so", shown)
        elif source.document not in files.content or not source.document.startswith(SOURCES):
            known = [document for document in files.content if document.startswith(SOURCES)]
            message = f"there is no document {source.document!r}"
            remedy = nearest(source.document, known) or f"write it, or name one of {', '.join(known) or 'sources/*.md'}"
            yield files.problem(name, path, message, remedy, shown)
        elif not source.excerpt or files.text(source.document)[source.start : source.end] != source.excerpt:
            where = f"characters {source.start} to {source.end} of {source.document}"
            message = f"{where} are not the excerpt"
            yield files.problem(name, path, message, f"after an edit run: drivemcp rulepack seal {files.folder}", shown)


def check_references(files: Files, entries: Sequence[Sign | None], known: set[str]) -> Iterator[Problem]:
    """Signs name provisions that are there, the pack's own or inherited."""
    for index, entry in enumerate(entries):
        for at, name in enumerate(entry.provisions if entry is not None else ()):
            if name not in known:
                shown = entry.code if entry is not None else ""
                remedy = nearest(name, known) or "name one of provisions.json, or remove it"
                yield files.problem("signs.json", (index, "provisions", at), f"no provision {name!r}", remedy, shown)


def check_replaced(files: Files, entries: Sequence[Provision | None], inherited: set[str]) -> Iterator[Problem]:
    """What is replaced is there to be replaced, and by one provision alone."""
    by: dict[str, str] = {}
    for index, entry in enumerate(entries):
        for at, name in enumerate(entry.replaces if entry is not None else ()):
            shown, path = entry.id if entry is not None else "", (index, "replaces", at)
            if name not in inherited:
                remedy = nearest(name, inherited) or "name a provision of the pack that is extended, or remove it"
                yield files.problem("provisions.json", path, f"no inherited provision {name!r}", remedy, shown)
            elif name in by:
                message = f"{name!r} is replaced by {by[name]!r} already"
                yield files.problem("provisions.json", path, message, "remove it from one of the two", shown)
            by[name] = shown


def check_parent(files: Files, wanted: Extends, parent: Manifest) -> Iterator[Problem]:
    """The pack that is extended is the one it was written against, or a later one of the same major version."""
    have, need = version_numbers(parent.version), version_numbers(wanted.version)
    if have is None or need is None or have[0] != need[0] or have < need:
        message = f"needs {wanted.id} {wanted.version}, found {parent.version}"
        remedy = "name the version that is there, and look whether this pack still fits to it"
        yield files.problem("manifest.json", ("extends",), message, remedy)
    if parent.id != wanted.id:
        remedy = "name that, or give the folder its own pack's name"
        yield files.problem("manifest.json", ("extends", "id"), f"that folder holds {parent.id}", remedy)


def check_hash(files: Files, manifest: Manifest) -> Iterator[Problem]:
    """The manifest names the content's hash."""
    found = files.sha256()
    if found != manifest.content_sha256:
        message = f"says {manifest.content_sha256[:12]}, the content has {found[:12]}"
        remedy = f"after an intended change run: drivemcp rulepack seal {files.folder}"
        yield files.problem("manifest.json", ("content_sha256",), message, remedy)


def _unit(unit: str | None, manifest: Manifest) -> tuple[str, str]:
    message = f"{unit} is not the unit of {manifest.jurisdiction}, {manifest.units}"
    return message, f"write {manifest.units}, or the unit of the country in manifest.json"


def _day(text: str) -> date | None:
    try:
        return date.fromisoformat(text)
    except ValueError:
        return None
