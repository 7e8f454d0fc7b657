"""Rulepacks from their folders: read, checked, merged with the pack they extend. Errors name file and field."""

import hashlib
import re
from collections.abc import Sequence
from datetime import date
from pathlib import Path
from typing import Any, TypeVar

import msgspec

from proto.rules import RulepackInfo
from services.rules.errors import PackError
from services.rules.format import Case, Manifest, Provision, Sign, Source

FILES = ("manifest.json", "provisions.json", "signs.json", "cases.json")
_VERSION = re.compile(r"(\d+)\.(\d+)\.(\d+)")
T = TypeVar("T")


class Pack(msgspec.Struct, frozen=True, kw_only=True):
    """A rulepack that was read and checked; provisions and signs of the packs it extends are part of it."""

    manifest: Manifest
    provisions: dict[str, Provision]
    signs: dict[str, Sign]
    cases: tuple[Case, ...]
    origin: dict[str, str]
    """Rulepack version by provision id and `sign:<code>`: an inherited text is cited under the pack it stands in."""

    @property
    def version(self) -> str:
        """`DEU-v1@1.0.0#<first 12 of the content hash>`."""
        return version_tag(self.manifest)

    def info(self) -> RulepackInfo:
        """What `list_rulepacks` says of it."""
        m = self.manifest
        return RulepackInfo(
            pack_id=m.id,
            version=m.version,
            content_sha256=m.content_sha256,
            jurisdiction=m.jurisdiction,
            units=m.units,
            traffic_side=m.traffic_side,
            effective_from=m.effective_from,
            provisions=len(self.provisions),
            signs=len(self.signs),
            languages=m.languages,
        )


def version_tag(manifest: Manifest) -> str:
    """The `rulepack_version` of answers."""
    return f"{manifest.id}@{manifest.version}#{manifest.content_sha256[:12]}"


def parse_version(text: str, where: str = "version") -> tuple[int, int, int]:
    """Semantic version as numbers. Raises PackError."""
    match = _VERSION.fullmatch(text)
    if not match:
        raise PackError(f"{where}: {text!r} is no version of the form 1.2.3")
    return int(match[1]), int(match[2]), int(match[3])


def load(folder: Path) -> Pack:
    """The pack in a folder, with what it extends (a sibling folder). Raises PackError."""
    return _load(folder, ())


def content_hash(folder: Path) -> str:
    """SHA-256 over the canonical content: every JSON file with sorted keys, every source document as it is.

    The manifest's own `content_sha256` is left out.
    """
    digest = hashlib.sha256()
    for name in FILES:
        content = _raw(folder / name)
        if name == "manifest.json" and isinstance(content, dict):
            content = {key: value for key, value in content.items() if key != "content_sha256"}
        _feed(digest, name, msgspec.json.encode(content, order="deterministic"))
    for path in sorted((folder / "sources").glob("*.md")):
        _feed(digest, f"sources/{path.name}", _bytes(path))
    return digest.hexdigest()


def _feed(digest: Any, name: str, content: bytes) -> None:
    digest.update(f"{name}\0{len(content)}\0".encode())
    digest.update(content)


def _load(folder: Path, seen: tuple[str, ...]) -> Pack:
    manifest = _decode(folder / "manifest.json", Manifest)
    _check_manifest(folder, manifest, seen)
    provisions = _unique(folder / "provisions.json", _decode(folder / "provisions.json", list[Provision]), "id")
    signs = _unique(folder / "signs.json", _decode(folder / "signs.json", list[Sign]), "code")
    cases = tuple(_decode(folder / "cases.json", list[Case]))
    tag = version_tag(manifest)
    pack = Pack(
        manifest=manifest,
        provisions=provisions,
        signs=signs,
        cases=cases,
        origin={**dict.fromkeys(provisions, tag), **{f"sign:{code}": tag for code in signs}},
    )
    _check_sources(folder, pack)
    if manifest.extends is not None:
        pack = _merged(folder, pack, _load(folder.parent / manifest.extends.id, (*seen, manifest.id)))
    _check_references(folder, pack)
    return pack


def _check_manifest(folder: Path, manifest: Manifest, seen: tuple[str, ...]) -> None:
    path = folder / "manifest.json"
    if manifest.id in seen:
        raise PackError(f"{path}: extends: {' -> '.join((*seen, manifest.id))} goes in a circle")
    parse_version(manifest.version, f"{path}: version")
    begin = _day(path, "effective_from", manifest.effective_from)
    if manifest.effective_until is not None and _day(path, "effective_until", manifest.effective_until) < begin:
        raise PackError(f"{path}: effective_until: {manifest.effective_until} lies before effective_from")
    if not manifest.languages or sorted(manifest.precedence) != ["guidance", "sign_table", "statute"]:
        raise PackError(f"{path}: languages must not be empty, precedence must order statute, sign_table, guidance")
    found = content_hash(folder)
    if found != manifest.content_sha256:
        raise PackError(
            f"{path}: content_sha256: says {manifest.content_sha256[:12]}, the content has {found[:12]}; "
            f"after an intended change run: python -m services.rules.packs seal {folder}"
        )


def _day(path: Path, field: str, text: str) -> date:
    try:
        return date.fromisoformat(text)
    except ValueError:
        raise PackError(f"{path}: {field}: {text!r} is no date of the form 2025-01-31") from None


def _unique(path: Path, items: Sequence[T], key: str) -> dict[str, T]:
    found: dict[str, T] = {}
    for index, item in enumerate(items):
        name: str = getattr(item, key)
        if name in found:
            raise PackError(f"{path}: [{index}].{key}: {name!r} stands there twice")
        found[name] = item
    return found


def _check_sources(folder: Path, pack: Pack) -> None:
    texts: dict[str, str] = {}
    for file, items in (("provisions.json", pack.provisions), ("signs.json", pack.signs)):
        for name, item in items.items():
            if not item.sources:
                raise PackError(f"{folder / file}: {name}: sources: at least one is needed")
            for source in item.sources:
                _check_source(folder, file, name, source, texts)


def _check_source(folder: Path, file: str, name: str, source: Source, texts: dict[str, str]) -> None:
    where = f"{folder / file}: {name}: sources"
    path = folder / source.document
    if ".." in Path(source.document).parts or Path(source.document).is_absolute():
        raise PackError(f"{where}: document {source.document!r} lies outside the pack")
    if source.document not in texts:
        texts[source.document] = _bytes(path).decode("utf-8", errors="replace")
    if texts[source.document][source.start : source.end] != source.excerpt or not source.excerpt:
        raise PackError(f"{where}: characters {source.start} to {source.end} of {source.document} are not the excerpt")


def _check_references(folder: Path, pack: Pack) -> None:
    for code, sign in pack.signs.items():
        for name in sign.provisions:
            if name not in pack.provisions:
                raise PackError(f"{folder / 'signs.json'}: {code}: provisions: no provision {name!r}")


def _merged(folder: Path, child: Pack, parent: Pack) -> Pack:
    wanted = child.manifest.extends
    assert wanted is not None
    have, need = parse_version(parent.manifest.version), parse_version(wanted.version, f"{folder}: extends.version")
    if have[0] != need[0] or have < need:
        raise PackError(
            f"{folder / 'manifest.json'}: extends: needs {wanted.id} {wanted.version}, found {parent.manifest.version}"
        )
    if parent.manifest.jurisdiction != child.manifest.jurisdiction:
        raise PackError(f"{folder / 'manifest.json'}: jurisdiction: {wanted.id} is of {parent.manifest.jurisdiction}")
    return msgspec.structs.replace(
        child,
        provisions={**parent.provisions, **child.provisions},
        signs={**parent.signs, **child.signs},
        origin={**parent.origin, **child.origin},
    )


def _bytes(path: Path) -> bytes:
    try:
        return path.read_bytes()
    except OSError as error:
        raise PackError(f"cannot read {path}: {error.strerror}") from None


def _raw(path: Path) -> Any:
    return _decode(path, Any)


def _decode(path: Path, kind: Any) -> Any:
    try:
        return msgspec.json.decode(_bytes(path), type=kind)
    except msgspec.MsgspecError as error:
        raise PackError(f"{path}: {error}") from None


if __name__ == "__main__":
    import sys

    from services.rules.seal import command

    sys.exit(command(sys.argv[1:]))
