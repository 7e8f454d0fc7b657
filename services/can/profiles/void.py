"""Which raw values of a signal are no measurement: floats that are no number, J1939's top values, and what a value table names so."""

import re
from collections.abc import Callable
from typing import Any

Void = Callable[[int], bool]

FLOAT_EXPONENT = {16: 0x7C00, 32: 0x7F80_0000, 64: 0x7FF0_0000_0000_0000}
"""All bits of the exponent set: infinite or no number (IEEE 754)."""
PHRASES = (
    r"\w*sna\b", r"snv\b", r"(?:not|non?|nicht) ?(?:avail|valid|suppo|install|equipp|verfueg|gueltig|verbaut|unterst|dispo)\w*",
    r"(?:signal|data)notavailable", "unavail", "invalid", r"\w*ungueltig", "unknown", "unbekannt", "no ?data", "keine ?daten",
    "fehlerwert", "initwert", "(?:signal|data)invalid",
)  # fmt: skip
"""How value tables say that a raw value is no measurement: the beginnings of words, small, without umlauts and signs."""
PHRASES_OF_A_QUANTITY = (
    *PHRASES, "error", "fehler", "fault", "fail", "defe[ck]t", r"sensor(?:fault|error|def)", "undef", "(?:not|nicht) ?defin",
    r"(?:un|not ?|nicht ?)(?:used|benutzt|belegt|applicable)", r"n ?[av]\b", r"init(?:\b|ial)", "reserv(?:ed|iert)", "time ?out",
    "(?:no|kein) ?(?:value|wert|signal)", "kein gueltig", r"signal nicht", "unterspann", "ueberspann", r"(?:low|under|over) ?volt",
    "neutralwert",
)  # fmt: skip
"""The same for a signal with a unit. Of one without, a fault may be what it reports."""
_NOT_AHEAD = r"(?<!\bno )(?<!\bnot )(?<!\bkein )(?<!\bnicht )(?<!\bohne )(?<!\bwithout )"
"""`No error` names a measurement."""
_SPELLINGS = str.maketrans({"ä": "ae", "ö": "oe", "ü": "ue", "ß": "ss"})


def _any_of(phrases: tuple[str, ...]) -> re.Pattern[str]:
    return re.compile(rf"{_NOT_AHEAD}\b(?:{'|'.join(phrases)})")


_NAMES, _NAMES_OF_A_QUANTITY = _any_of(PHRASES), _any_of(PHRASES_OF_A_QUANTITY)


def void_of(signal: Any, *, j1939: bool) -> Void | None:
    """Whether a raw value of a signal (cantools) says that there is no measurement; None where each is one."""
    if signal.is_float:
        infinite = FLOAT_EXPONENT[signal.length]
        return lambda raw: raw & infinite == infinite
    mask = (1 << signal.length) - 1
    named = frozenset(
        raw & mask
        for raw, text in (signal.choices or {}).items()
        if -mask // 2 <= raw <= mask and (_says_so(str(text), bool(signal.unit)) or _beyond_the_range(signal, raw))
    )
    floor = _j1939_floor(signal) if j1939 else None
    if floor is not None:
        return lambda raw: raw >= floor or raw in named
    return (lambda raw: raw & mask in named) if named else None


def _says_so(text: str, quantity: bool) -> bool:
    words = _words(text)
    return bool((_NAMES_OF_A_QUANTITY if quantity else _NAMES).search(words)) or (quantity and bool(text) and not words)


def _words(text: str) -> str:
    """The words of a name, apart by blanks: of `NoDataExists`, `NO_DATA` and `no data!`."""
    apart = re.sub(r"(?<=[a-zäöü])(?=[A-ZÄÖÜ])", " ", text).lower().translate(_SPELLINGS)
    return re.sub(r"[\W_]+", " ", apart).strip()


def _beyond_the_range(signal: Any, raw: int) -> bool:
    """Whether a quantity's named value lies outside the range that the description gives for measurements."""
    low, high = signal.minimum, signal.maximum
    if not signal.unit or low is None or high is None or low >= high:
        return False
    signed = raw - (1 << signal.length) if signal.is_signed and raw >= 1 << (signal.length - 1) else raw
    value, half = signed * signal.scale + signal.offset, abs(signal.scale) / 2
    return not low - half <= value <= high + half


def _j1939_floor(signal: Any) -> int | None:
    """From this raw value on there is no measurement: error, not available, reserved (SAE J1939-71, table 1)."""
    if signal.is_signed:
        return None
    if signal.length >= 8:
        return 0xFB << (int(signal.length) - 8)
    return {2: 0b10, 4: 0xE}.get(int(signal.length))
