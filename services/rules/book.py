"""The rule book: the loaded packs, and which of them answers for a jurisdiction."""

import re
from collections.abc import Mapping, Sequence
from datetime import date
from pathlib import Path

import msgspec

from domain.languages import spoken_language
from drivemcp.files.place_names import installed, named
from proto.rules import PlaceName, RulepackInfo
from services.rules.errors import PackError
from services.rules.packs.checks import FALLBACK
from services.rules.packs.format import Manifest
from services.rules.packs.loading import Pack, load, parse_version
from services.rules.packs.signature import Trust

STALE = 0.5
"""Factor on the confidence under a pack older than the vehicle's configuration expects, or not in force today."""
UNKNOWN_COUNTRY = 0.3
FOREIGN_LAW = 0.3
UNKNOWN_PART = 0.6
"""Factor where the country is known and only the law of some of its parts is loaded."""
_ALPHA2 = {
    "DE": "DEU", "GB": "GBR", "UK": "GBR", "FR": "FRA", "NL": "NLD", "AT": "AUT", "PL": "POL", "CH": "CHE", "BE": "BEL",
    "IE": "IRL", "IT": "ITA", "ES": "ESP", "US": "USA",
}  # fmt: skip
_CODE = re.compile(r"[A-Za-z]{2,3}(?:-[A-Za-z0-9]{1,3})?")


class RuleBook(msgspec.Struct, frozen=True, kw_only=True):
    """Packs by id, in the order of the configuration, and what the configuration expects of them."""

    packs: dict[str, Pack]
    expected: Mapping[str, str] = {}
    """Version by pack id that the vehicle's configuration was made for."""
    today: str = ""
    """ISO date; empty: packs are not checked against their dates."""

    def for_jurisdiction(self, jurisdiction: str | None) -> tuple[Pack, ...]:
        """The packs that answer: those of the place, its country and its parts; for a part without one all of its country. All, if it
        is unknown.

        One that another extends is left out where the other surely applies: not where a part's law may not be the one here.
        A base comes before the packs of the parts that stand on it.
        """
        fitting = [pack for pack in self.packs.values() if _may_apply(pack, jurisdiction)]
        if not fitting and jurisdiction is not None:
            country = jurisdiction.partition("-")[0]
            fitting = [pack for pack in self.packs.values() if _may_apply(pack, country)]
        replaced = {name for pack in fitting for name in pack.family[1:] if self._replaces(pack, name, jurisdiction)}
        left = (pack for pack in fitting if pack.manifest.id not in replaced)
        return tuple(sorted(left, key=lambda pack: not pack.manifest.base))

    def covers(self, jurisdiction: str | None) -> bool:
        """Whether one of the packs is surely that of the place: its country's, or its part's."""
        return any(_applies(pack, jurisdiction) for pack in self.packs.values())

    def weaknesses(self, pack: Pack) -> tuple[str, ...]:
        """Of `stale` and `out_of_date`, those that hold for a pack or one it extends."""
        stale = any(self._older(manifest) for manifest in pack.line)
        past = any(self._not_in_force(manifest) for manifest in pack.line)
        return (("stale",) if stale else ()) + (("out_of_date",) if past else ())

    def expected_of(self, pack: Pack) -> str:
        """The version the configuration expects of the first pack of the family that is older."""
        return next((self.expected[m.id] for m in pack.line if self._older(m)), "")

    def name_of(self, place: str, language: str) -> PlaceName | None:
        """What a country or a part of one is called: by its own packs, by another that is loaded, by one that is installed."""
        loaded = [manifest for pack in self.packs.values() for manifest in pack.line if place in manifest.names]
        loaded.sort(key=lambda manifest: manifest.jurisdiction[:3] != place[:3])
        names = loaded[0].names[place] if loaded else installed().get(place, {})
        return named(names, spoken_language(language))

    def infos(self) -> tuple[RulepackInfo, ...]:
        """What is loaded."""
        return tuple(pack.info() for pack in self.packs.values())

    def _replaces(self, pack: Pack, name: str, jurisdiction: str | None) -> bool:
        parent = self.packs.get(name)
        same = parent is not None and parent.manifest.jurisdiction == pack.manifest.jurisdiction
        return same or _applies(pack, jurisdiction)

    def _older(self, manifest: Manifest) -> bool:
        if manifest.id not in self.expected:
            return False
        want = parse_version(self.expected[manifest.id], f"expected_packs.{manifest.id}")
        return parse_version(manifest.version) < want

    def _not_in_force(self, manifest: Manifest) -> bool:
        if not self.today:
            return False
        return not manifest.effective_from <= self.today <= (manifest.effective_until or self.today)


def is_fallback(pack: Pack) -> bool:
    """Whether a pack is not the law of a country, but what is careful everywhere."""
    return pack.manifest.jurisdiction == FALLBACK


def _applies(pack: Pack, jurisdiction: str | None) -> bool:
    law = pack.manifest.jurisdiction
    return (
        jurisdiction is not None
        and not pack.manifest.base
        and (jurisdiction == law or jurisdiction.startswith(f"{law}-"))
    )


def _may_apply(pack: Pack, jurisdiction: str | None) -> bool:
    law = pack.manifest.jurisdiction
    return not jurisdiction or jurisdiction == law or _applies(pack, jurisdiction) or law.startswith(f"{jurisdiction}-")


def load_book(
    folders: Sequence[Path],
    *,
    expected: Mapping[str, str] | None = None,
    today: str = "",
    trust: Trust | None = None,
) -> tuple[RuleBook, tuple[str, ...]]:
    """The book of all packs that can be used, and why the others are refused. Raises PackError if the expectations are malformed."""
    packs: dict[Path, Pack] = {}
    refused: list[str] = []
    for folder in folders:
        try:
            packs[folder] = load_beside(folder, packs, trust)
        except PackError as error:
            refused.append(str(error))
    for name, version in (expected or {}).items():
        parse_version(version, f"expected_packs.{name}")
    by_id = {pack.manifest.id: pack for pack in packs.values()}
    return RuleBook(packs=by_id, expected=expected or {}, today=_day(today)), tuple(refused)


def load_beside(folder: Path, others: Mapping[Path, Pack], trust: Trust | None = None) -> Pack:
    """The pack in a folder. Raises PackError where it cannot be used, or another folder's pack has its id already."""
    pack = load(folder, trust)
    first = next((f for f, other in others.items() if f != folder and other.manifest.id == pack.manifest.id), None)
    if first is not None:
        raise PackError(f"{folder / 'manifest.json'}: id: {pack.manifest.id!r} is already the pack in {first}")
    return pack


def normal_jurisdiction(text: str | None) -> str | None:
    """ISO 3166 alpha-3, with a subdivision behind a hyphen where one is given: `de` → DEU, `GB-WLS` → GBR-WLS.

    None, an unknown country, for what has not the form of a code.
    """
    if text is None or not _CODE.fullmatch(text.strip()):
        return None
    country, hyphen, part = text.strip().upper().partition("-")
    return _ALPHA2.get(country, country) + hyphen + part


def _day(text: str) -> str:
    """A date as manifests write it, so that it can be compared with theirs; empty stays empty. Raises PackError."""
    try:
        return date.fromisoformat(text).isoformat() if text else ""
    except ValueError:
        raise PackError(f"today: {text!r} is no date of the form 2025-01-31") from None
