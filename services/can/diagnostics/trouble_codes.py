"""Trouble codes: two bytes to a code, a code to words. What the table does not know is explained by the code's
structure; a maker's own code is named as such.
"""

import re
import tomllib
from collections.abc import Iterator
from itertools import product
from pathlib import Path
from typing import Literal

import msgspec

from proto.vehicle import DtcText

Severity = Literal["note", "service", "careful", "stop_soon", "stop_now"]
SEVERITIES: tuple[Severity, ...] = ("note", "service", "careful", "stop_soon", "stop_now")

_CODE = re.compile(r"[PCBU][0-3][0-9A-F]{3}")
_LETTERS = "PCBU"

# SAE J2012: letter, then who defined the code, then (powertrain) the group of systems.
_SYSTEMS: dict[str, tuple[str, str, str]] = {
    "P": ("powertrain", "powertrain", "Antrieb"),
    "C": ("chassis", "chassis (brakes, steering, suspension)", "Fahrwerk (Bremse, Lenkung, Aufhängung)"),
    "B": ("body", "body and comfort", "Karosserie und Komfort"),
    "U": ("network", "network between control units", "Netzwerk der Steuergeräte"),
}
_FUEL_AIR = ("fuel, air and emissions", "Kraftstoff, Luft und Abgas")
# P0: by its third character; P2 and P3 number other groups.
_GROUPS: dict[str, tuple[str, str]] = {
    "0": _FUEL_AIR,
    "1": ("fuel and air metering", "Gemischbildung"),
    "2": ("injectors", "Einspritzung"),
    "3": ("ignition and misfire", "Zündung und Aussetzer"),
    "4": ("emission control", "Abgasreinigung"),
    "5": ("speed, idle and auxiliary inputs", "Geschwindigkeit, Leerlauf und Nebeneingänge"),
    "6": ("control unit and its outputs", "Steuergerät und Ausgänge"),
    **dict.fromkeys("789", ("transmission", "Getriebe")),
    **dict.fromkeys("ABC", ("hybrid drive", "Hybridantrieb")),
}
_GROUPS_P2: dict[str, tuple[str, str]] = _GROUPS | dict.fromkeys("12ABC", _FUEL_AIR)
_GROUPS_P3: dict[str, tuple[str, str]] = {"4": ("cylinder deactivation", "Zylinderabschaltung")}
_GROUPS_OF: dict[str, dict[str, tuple[str, str]]] = {"P0": _GROUPS, "P2": _GROUPS_P2, "P3": _GROUPS_P3}
# Unknown chassis and network codes are taken more seriously than unknown comfort ones.
_UNKNOWN_SEVERITY: dict[str, Severity] = {"P": "careful", "C": "careful", "B": "service", "U": "careful"}


class _Words(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    en: str
    de: str


class _Step(_Words, frozen=True, kw_only=True, forbid_unknown_fields=True):
    fr: str
    nl: str
    pl: str
    it: str
    es: str


class _Row(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    system: str
    severity: Severity
    en: str
    de: str
    step: str = ""


class _Family(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Consecutive codes: what may be wrong with one part, or in turn with each of `times` alike parts."""

    system: str
    severity: Severity
    faults: str
    en: str
    de: str
    step: str = ""
    times: int = 1


class _Table(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    steps: dict[str, _Step]
    faults: dict[str, _Words]
    families: dict[str, _Family]
    codes: dict[str, _Row]


def code_of(high: int, low: int) -> str:
    """Two bytes as they stand on the bus, as a code: 0x03 0x00 is P0300 (ISO 15031-6)."""
    return f"{_LETTERS[high >> 6]}{high >> 4 & 0x3}{high & 0xF:X}{low:02X}"


def is_code(text: str) -> bool:
    """Whether `text` has the form of a trouble code."""
    return _CODE.fullmatch(text) is not None


class DtcBook:
    """The table of trouble codes in words."""

    def __init__(self, table: _Table) -> None:
        """Raises ValueError where a row names a step or a fault that is not there, or a code that is not a generic one."""
        self._steps, self._codes = table.steps, _expanded(table) | table.codes
        missing = ({row.step for row in self._codes.values() if row.step} | set(SEVERITIES)) - table.steps.keys()
        if missing:
            raise ValueError(f"steps not defined: {sorted(missing)}")
        if wrong := [code for code in self._codes if not (is_code(code) and is_generic(code))]:
            raise ValueError(f"no generic trouble codes: {sorted(wrong)}")

    @classmethod
    def load(cls, path: Path) -> "DtcBook":
        """Read the table. Raises ValueError, naming the file and what is wrong in it."""
        try:
            return cls(msgspec.convert(tomllib.loads(path.read_text(encoding="utf-8-sig")), _Table))
        except (ValueError, msgspec.ValidationError) as error:
            raise ValueError(f"{path.name}: {error}") from error

    def __len__(self) -> int:
        return len(self._codes)

    @property
    def codes(self) -> tuple[str, ...]:
        """Every code of the table."""
        return tuple(self._codes)

    def severity(self, code: str) -> Severity:
        """How grave a code is; an unknown one by its letter."""
        row = self._codes.get(code)
        return row.severity if row is not None else _UNKNOWN_SEVERITY.get(code[:1], "careful")

    def step(self, key: str, language: str) -> str:
        """The text of a next step."""
        words = self._steps[key]
        return str(getattr(words, language if language in _Step.__struct_fields__ else "en"))

    def explain(self, code: str, language: str = "en") -> DtcText:
        """A code in words. Raises ValueError where `code` is not a trouble code."""
        code = code.strip().upper()
        if not is_code(code):
            raise ValueError(
                f"{code[:20]!r} is no trouble code: one of P C B U, a digit 0 to 3, three hex digits, as in P0300"
            )
        german = language == "de"
        row = self._codes.get(code) or self._by_structure(code)
        return DtcText(
            code=code,
            system=row.system,
            severity=row.severity,
            summary=row.de if german else row.en,
            next_step=self.step(row.step or row.severity, language),
            language="de" if german else "en",
            generic=is_generic(code),
        )

    def _by_structure(self, code: str) -> _Row:
        """A row for a code that the table does not have."""
        system, english, german = _SYSTEMS[code[0]]
        group = _GROUPS_OF.get(code[:2], {}).get(code[2]) if is_generic(code) else None
        whose = ("standard", "genormter") if is_generic(code) else ("manufacturer's own", "herstellereigener")
        beside = [f" (group: {group[0]})", f" (Gruppe: {group[1]})"] if group else ["", ""]
        return _Row(
            system=system,
            severity=_UNKNOWN_SEVERITY[code[0]],
            en=f"{english}: {whose[0]} code, not in the table{beside[0]}",
            de=f"{german}: {whose[1]} Fehlercode, nicht in der Tabelle{beside[1]}",
        )


def is_generic(code: str) -> bool:
    """Whether the standard defines this code, not the maker (SAE J2012).

    0 is generic everywhere; 2 in P codes, 3 in U codes and P34xx upward too.
    """
    return (
        code[1] == "0"
        or (code[0] == "P" and (code[1] == "2" or (code[1] == "3" and code[2] >= "4")))
        or (code[0] == "U" and code[1] == "3")
    )


def _expanded(table: _Table) -> dict[str, _Row]:
    """The codes of all families. Raises ValueError where two families claim a code, or one names an unknown fault."""
    rows: dict[str, _Row] = {}
    for first, family in table.families.items():
        for code, row in _members(first, family, table.faults):
            if code in rows:
                raise ValueError(f"family {first}: {code} is in another family too")
            rows[code] = row
    return rows


def _members(first: str, family: _Family, faults: dict[str, _Words]) -> Iterator[tuple[str, _Row]]:
    names = family.faults.split()
    if unknown := set(names) - faults.keys():
        raise ValueError(f"family {first}: faults not defined: {sorted(unknown)}")
    for offset, (turn, name) in enumerate(product(range(family.times), names)):
        part = {"n": turn + 1, "a": chr(ord("A") + turn)}
        yield (
            f"{first[0]}{int(first[1:]) + offset:04d}",
            _Row(
                system=family.system,
                severity=family.severity,
                step=family.step,
                en=f"{family.en.format(**part)}: {faults[name].en}",
                de=f"{family.de.format(**part)}: {faults[name].de}",
            ),
        )
