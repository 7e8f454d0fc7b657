"""What the text of a DBC says that cantools does not tell, and what in it keeps cantools from reading the rest."""

import re
from collections.abc import Mapping

_MESSAGE = re.compile(r"\s*BO_\s+(\d+)\s")
_MULTIPLEXED = re.compile(r"\s*SG_\s+(\w+)\s+m(\d+)M?\s*:")
EXTENDED = 1 << 31
"""Set in the number of a message whose id has 29 bits."""
SHORT = 32
"""Letters of a name in a DBC; longer names stand in an attribute."""
LARGEST_ID, LARGEST_EXTENDED_ID = (1 << 11) - 1, (1 << 29) - 1
UNASSIGNED = "VECTOR__INDEPENDENT_SIG_MSG"
"""The message of signals that are in none; cantools leaves it out."""
NEEDED = frozenset({"ProtocolType", "VFrameFormat", "GenSigFuncType", "SigFuncType"})
"""Attributes that say how frames are to be read and what guards them: without them more would be believed."""
_BLOCK = re.compile(r"^[ \t]*BO_\s+(\d+)\s+(\w+)[^\n]*\n(?:[ \t]*(?:SG_\s[^\n]*)?\n)*", re.M)
_SIGNAL = re.compile(r"^\s*SG_\s+(\w+)", re.M)
_STRING = r'"(?:\\"|[^"])*+"'
_STATEMENT = re.compile(rf'^[ \t]*(?:(?:VAL_|SIG_VALTYPE_)[ \t]+(?=\d)|BA_[ \t]+(?="))(?:[^";]|{_STRING})*+;', re.M)
_WORD = re.compile(rf"{_STRING}|[^\s;:]+")
_DEFINITION = re.compile(r'^[ \t]*BA_DEF_\s+(?:[A-Z]+_\s+)?"([^"]*)"\s+(\w+)([^;]*);', re.M)


def multiplexed(text: str) -> dict[tuple[tuple[bool, int], str], int]:
    """(message, first 32 letters of the signal) -> selector value, of the signals that are written as multiplexed (`m1`)."""
    found: dict[tuple[tuple[bool, int], str], int] = {}
    number = 0
    for line in text.splitlines():
        if message := _MESSAGE.match(line):
            number = int(message[1])
        elif signal := _MULTIPLEXED.match(line):
            found[(bool(number & EXTENDED), number % EXTENDED), signal[1][:SHORT]] = int(signal[2])
    return found


def mended(text: str) -> tuple[str, list[str]]:
    """The text without what keeps cantools from reading the rest, and that in words: messages of ids that cannot be, and entries
    of signals and attributes that are not described.
    """
    text, left_out = re.sub("\r\n?", "\n", text) + "\n", []
    described: set[tuple[str, str]] = set()

    def block(found: re.Match[str]) -> str:
        if why := "" if found[2] == UNASSIGNED else _impossible(int(found[1])):
            left_out.append(f"message {found[2]} ({why})")
            return ""
        described.update((found[1], name) for name in _SIGNAL.findall(found[0]) if found[2] != UNASSIGNED)
        return found[0]

    def statement(found: re.Match[str]) -> str:
        if why := _of_nothing(_WORD.findall(found[0]), described, kinds):
            left_out.append(why)
        return "" if why else found[0]

    text = _BLOCK.sub(block, text)
    kinds = {name: (kind, rest) for name, kind, rest in _DEFINITION.findall(text)}
    return _STATEMENT.sub(statement, text), left_out


def _impossible(number: int) -> str:
    """Why a message's number is no id."""
    extended, arbitration_id = bool(number & EXTENDED), number % EXTENDED
    if arbitration_id <= (LARGEST_EXTENDED_ID if extended else LARGEST_ID):
        return ""
    return f"its id 0x{arbitration_id:X} has more than {29 if extended else 11} bits" + (
        "" if extended or arbitration_id > LARGEST_EXTENDED_ID else f"; write {number | EXTENDED} for one of 29 bits"
    )


def _of_nothing(words: list[str], described: set[tuple[str, str]], kinds: Mapping[str, tuple[str, str]]) -> str:
    """What an entry is of, where that is not described; of an attribute also where it cannot have the value."""
    if words[0] != "BA_":
        absent = len(words) > 2 and words[1].isdigit() and (words[1], words[2]) not in described
        return " ".join(words[:3]) if absent else ""
    name, value = words[1].strip('"'), words[-1]
    kind, rest = kinds.get(name, ("", ""))
    return "" if name in NEEDED or _may_be(value, kind, rest) else f"{' '.join(words[:-1])} = {value}"


def _may_be(value: str, kind: str, rest: str) -> bool:
    if kind == "ENUM":
        return value.isdigit() and int(value) < len(re.findall(_STRING, rest))
    return kind == "STRING" or (bool(kind) and re.fullmatch(r"[-+]?\d+(?:\.\d*)?(?:[eE][-+]?\d+)?", value) is not None)
