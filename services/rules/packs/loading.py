"""Rulepacks from their folders: read, checked, merged with the pack they extend. Errors name file, line and field."""

from collections.abc import Mapping
from pathlib import Path

import msgspec

from drivemcp.errors import MALFORMED
from drivemcp.files.packfiles import FILES, read_regular
from drivemcp.paths import data, has_data
from proto.rules import RulepackInfo
from services.rules.errors import PackError, Problem, refused
from services.rules.packs import checks
from services.rules.packs.files import Files, decoded, decoded_list, read_files
from services.rules.packs.format import Advisory, Case, Condition, Extends, Limit, Manifest, Minimum, Provision, Sign
from services.rules.packs.signature import Trust, check_signature

MAX_FAMILY = 8
"""More packs than this in a row do not extend each other."""


class _Extending(msgspec.Struct, frozen=True):
    """What of a manifest says which other folders matter."""

    extends: Extends | None = None


class Pack(msgspec.Struct, frozen=True, kw_only=True):
    """A rulepack that was read and checked; provisions and signs of the packs it extends are part of it."""

    manifest: Manifest
    provisions: dict[str, Provision]
    signs: dict[str, Sign]
    cases: tuple[Case, ...]
    origin: dict[str, str]
    """Rulepack version by provision id and `sign:<code>`: an inherited text is cited under the pack it stands in."""
    extended: tuple[Manifest, ...] = ()
    """Manifests of the packs it extends, the nearest first."""
    limits: tuple[tuple[Provision, Limit | Advisory], ...] = ()
    minimums: tuple[tuple[Provision, Minimum], ...] = ()
    """What of the provisions states a speed, in their order: looked through for every answer."""
    says_how: dict[str, tuple[str, ...]] = {}
    """Ids of the provisions that say how a sign is to be read, by what they say it of; the extending pack's own first."""

    @property
    def version(self) -> str:
        """`DEU-v1@1.0.0#<first 12 of the content hash>`."""
        return version_tag(self.manifest)

    @property
    def family(self) -> tuple[str, ...]:
        """Ids of this pack and of those it extends, itself first."""
        return tuple(manifest.id for manifest in self.line)

    @property
    def line(self) -> tuple[Manifest, ...]:
        """Its manifest, and those of the packs it extends."""
        return (self.manifest, *self.extended)

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
    found = checks.version_numbers(text)
    if found is None:
        raise PackError(f"{where}: {text!r} is no version of the form 1.2.3")
    return found


def load(folder: Path, trust: Trust | None = None) -> Pack:
    """The pack in a folder, with what it extends (a sibling folder). Raises PackError."""
    pack, problems = examine(folder, trust)
    if pack is None:
        raise refused(folder, problems)
    return pack


def content_hash(folder: Path) -> str:
    """SHA-256 over the canonical content of a folder. Raises PackError."""
    return read_files(folder).sha256()


def examine(
    folder: Path, trust: Trust | None = None, seen: tuple[str, ...] = ()
) -> tuple[Pack | None, tuple[Problem, ...]]:
    """The pack, or None and everything that is wrong with it. `seen`: ids of the packs that extend this one."""
    files = read_files(folder)
    manifest, found = decoded(files, "manifest.json", Manifest)
    provisions, wrong_provisions = decoded_list(files, "provisions.json", Provision)
    signs, wrong_signs = decoded_list(files, "signs.json", Sign)
    cases, wrong_cases = decoded_list(files, "cases.json", Case)
    unread = tuple(problem for problem in files.unread() if problem.file.name not in FILES)
    problems = [*unread, *found, *wrong_provisions, *wrong_signs, *wrong_cases]
    problems += checks.check_twice(files, "provisions.json", "id", provisions)
    problems += checks.check_twice(files, "signs.json", "code", signs)
    problems += checks.check_provisions(files, provisions, manifest)
    problems += checks.check_signs(files, signs, manifest)
    parent, wrong_parent = _parent(files, manifest, trust, seen)
    known = {entry.id for entry in provisions if entry is not None} | set(parent.provisions if parent else ())
    if not wrong_provisions and not wrong_parent:  # otherwise a reference may be right
        problems += checks.check_references(files, signs, known)
        problems += checks.check_replaced(files, provisions, set(parent.provisions if parent else ()))
    problems += wrong_parent
    if manifest is not None:
        problems += checks.check_manifest(files, manifest)
        if not (unread or found or wrong_provisions or wrong_signs or wrong_cases):
            problems += checks.check_hash(files, manifest)
        problems += check_signature(files, manifest, trust or Trust())
    if problems:
        return None, tuple(problems)
    own = _own(manifest, [p for p in provisions if p], [s for s in signs if s], [c for c in cases if c])
    return _indexed(own if parent is None else _merged(own, parent)), ()


def parent_folder(folder: Path, name: str) -> Path:
    """Where the pack that is extended lies: beside this one, else among those that are installed."""
    beside = folder.absolute().parent / name
    return beside if beside.exists() or not has_data(f"rulepacks/{name}") else data(f"rulepacks/{name}")


def extended_folders(folder: Path) -> tuple[Path, ...]:
    """Folders of the packs that one extends, as far as its manifest, sound or not, tells."""
    found: list[Path] = []
    while len(found) < MAX_FAMILY:
        try:
            manifest = msgspec.json.decode(read_regular(folder / "manifest.json"), type=_Extending)
        except (OSError, *MALFORMED):
            break
        if manifest.extends is None or (above := parent_folder(folder, manifest.extends.id)) in found:
            break
        found.append(folder := above)
    return tuple(found)


def _own(manifest: Manifest, provisions: list[Provision], signs: list[Sign], cases: list[Case]) -> Pack:
    tag = version_tag(manifest)
    return Pack(
        manifest=manifest,
        provisions={provision.id: provision for provision in provisions},
        signs={sign.code: sign for sign in signs},
        cases=tuple(cases),
        origin={**{p.id: tag for p in provisions}, **{f"sign:{sign.code}": tag for sign in signs}},
    )


def _indexed(pack: Pack) -> Pack:
    effects = [(provision, effect) for provision in pack.provisions.values() for effect in provision.effects]
    says_how: dict[str, tuple[str, ...]] = {}
    for provision, effect in reversed(effects):
        if isinstance(effect, Condition) and provision.id not in says_how.get(effect.what, ()):
            says_how[effect.what] = (*says_how.get(effect.what, ()), provision.id)
    limits = tuple((provision, effect) for provision, effect in effects if isinstance(effect, Limit | Advisory))
    minimums = tuple((provision, effect) for provision, effect in effects if isinstance(effect, Minimum))
    return msgspec.structs.replace(pack, limits=limits, minimums=minimums, says_how=says_how)


def _parent(
    files: Files, manifest: Manifest | None, trust: Trust | None, seen: tuple[str, ...]
) -> tuple[Pack | None, list[Problem]]:
    if manifest is None or manifest.extends is None:
        return None, []
    line = (*seen, manifest.id)
    if manifest.extends.id in line:
        circle = " -> ".join((*line, manifest.extends.id))
        remedy = "let one of them extend no other"
        return None, [files.problem("manifest.json", ("extends",), f"{circle} goes in a circle", remedy)]
    parent, problems = examine(parent_folder(files.folder, manifest.extends.id), trust, line)
    if parent is None:
        return None, list(problems)
    return parent, list(checks.check_parent(files, manifest.extends, parent.manifest))


def _merged(child: Pack, parent: Pack) -> Pack:
    """What is replaced is not inherited, and signs that named it name what stands in its place."""
    instead = {old: provision.id for provision in child.provisions.values() for old in provision.replaces}
    inherited = {name: provision for name, provision in parent.provisions.items() if name not in instead}
    return msgspec.structs.replace(
        child,
        provisions={**inherited, **child.provisions},
        signs={**{code: _renamed(sign, instead) for code, sign in parent.signs.items()}, **child.signs},
        origin={**{name: tag for name, tag in parent.origin.items() if name not in instead}, **child.origin},
        extended=parent.line,
    )


def _renamed(sign: Sign, instead: Mapping[str, str]) -> Sign:
    named = tuple(dict.fromkeys(instead.get(name, name) for name in sign.provisions))
    return sign if named == sign.provisions else msgspec.structs.replace(sign, provisions=named)
