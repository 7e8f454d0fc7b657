"""Trouble codes: two bytes to a code, a code to words. What the table does not know is explained by the code's
structure.
"""

import re
import tomllib
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
_GROUPS: dict[str, tuple[str, str]] = {
    "0": ("fuel, air and emissions", "Kraftstoff, Luft und Abgas"),
    "1": ("fuel and air metering", "Gemischbildung"),
    "2": ("injectors", "Einspritzung"),
    "3": ("ignition and misfire", "Zündung und Aussetzer"),
    "4": ("emission control", "Abgasreinigung"),
    "5": ("speed, idle and auxiliary inputs", "Geschwindigkeit, Leerlauf und Nebeneingänge"),
    "6": ("control unit and its outputs", "Steuergerät und Ausgänge"),
    "7": ("transmission", "Getriebe"),
    "8": ("transmission", "Getriebe"),
    "9": ("transmission", "Getriebe"),
    "A": ("hybrid drive", "Hybridantrieb"),
    "B": ("hybrid drive", "Hybridantrieb"),
    "C": ("hybrid drive", "Hybridantrieb"),
}
# Unknown chassis and network codes are taken more seriously than unknown comfort ones.
_UNKNOWN_SEVERITY: dict[str, Severity] = {"P": "careful", "C": "careful", "B": "service", "U": "careful"}


class _Words(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    en: str
    de: str


class _Row(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    system: str
    severity: Severity
    en: str
    de: str
    step: str = ""


class _Table(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    steps: dict[str, _Words]
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
        self._steps, self._codes = table.steps, table.codes

    @classmethod
    def load(cls, path: Path) -> "DtcBook":
        """Read the table; raises ValueError where a row names a step that is not there."""
        table = msgspec.convert(tomllib.loads(path.read_text(encoding="utf-8")), _Table)
        missing = {row.step for row in table.codes.values() if row.step} | set(SEVERITIES)
        if missing - table.steps.keys():
            raise ValueError(f"{path.name}: steps not defined: {sorted(missing - table.steps.keys())}")
        return cls(table)

    def __len__(self) -> int:
        return len(self._codes)

    def severity(self, code: str) -> Severity:
        """How grave a code is; an unknown one by its letter."""
        row = self._codes.get(code)
        return row.severity if row is not None else _UNKNOWN_SEVERITY.get(code[:1], "careful")

    def step(self, key: str, language: str) -> str:
        """The text of a next step."""
        words = self._steps[key]
        return words.de if language == "de" else words.en

    def explain(self, code: str, language: str = "en") -> DtcText:
        """A code in words. Raises ValueError where `code` is none."""
        code = code.strip().upper()
        if not is_code(code):
            raise ValueError(
                f"{code[:20]!r} is no trouble code: one of P C B U, a digit 0 to 3, three hex digits, as in P0300"
            )
        row = self._codes.get(code)
        language = "de" if language == "de" else "en"
        if row is None:
            return self._by_structure(code, language)
        return DtcText(
            code=code,
            system=row.system,
            severity=row.severity,
            summary=row.de if language == "de" else row.en,
            next_step=self.step(row.step or row.severity, language),
            language=language,
            generic=_generic(code),
        )

    def _by_structure(self, code: str, language: str) -> DtcText:
        system, english, german = _SYSTEMS[code[0]]
        group = _GROUPS.get(code[2]) if code[0] == "P" and _generic(code) else None
        if language == "de":
            whose = "genormter" if _generic(code) else "herstellereigener"
            summary = f"{german}: {whose} Fehlercode, nicht in der Tabelle" + (
                f" (Gruppe: {group[1]})" if group else ""
            )
        else:
            whose = "standard" if _generic(code) else "manufacturer's own"
            summary = f"{english}: {whose} code, not in the table" + (f" (group: {group[0]})" if group else "")
        severity = _UNKNOWN_SEVERITY[code[0]]
        return DtcText(
            code=code,
            system=system,
            severity=severity,
            summary=summary,
            next_step=self.step(severity, language),
            language=language,
            generic=_generic(code),
        )


def _generic(code: str) -> bool:
    """0 is generic everywhere; 2 in P codes, 3 in U codes and P34xx upward too (SAE J2012)."""
    return (
        code[1] == "0"
        or (code[0] == "P" and (code[1] == "2" or (code[1] == "3" and code[2] >= "4")))
        or (code[0] == "U" and code[1] == "3")
    )
