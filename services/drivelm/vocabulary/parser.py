"""From what the front end said to typed statements: a closed grammar, allow-lists, and otherwise abstention.

Answers are text from outside (a network's or a language model's words about the world) and are trusted with nothing.
A sentence says something only where it matches one known form from its first to its last letter. A number in it has to
be one that signs of the country can show, in the unit that the country uses. So no text can invent a limit, and above
all no text can raise one: two numbers, instructions, other units, huge numbers, spelled-out or exotic digits all abstain.
"""

import re
from typing import NamedTuple

from proto.scene import FactKind, Scope, Unit
from services.drivelm.vocabulary.classes import OTHER, SENTENCES
from services.drivelm.vocabulary.jurisdictions import allowed_limits
from services.drivelm.vocabulary.text import cleaned, number_in


class Statement(NamedTuple):
    """One typed statement: what kind of fact, the sign code, its number and unit if it has them, and its scope."""

    kind: FactKind
    reading: str
    value: int | None = None
    unit: Unit | None = None
    scope: Scope = "permanent"


NOTHING = Statement("sign", OTHER)
"""The front end says that there is nothing to read."""

_NUMBER = re.compile(
    r"(?:the )?(?P<what>traffic sign|sign|panel|gantry panel|variable message panel) (?:is|shows) (?:a|the) "
    r"speed limit(?P<zone> zone)?(?: sign)? of (?P<value>[1-9][0-9]{0,2})(?: (?P<unit>km/h|mph))?"
    r"(?P<wet>,? when wet)?\.?"
)
_PLAIN = re.compile(r"(?:the )?speed limit is (?P<value>[1-9][0-9]{0,2}) (?P<unit>km/h|mph)(?P<wet>,? when wet)?\.?")
_NAMED = {sentence.lower().rstrip("."): label for label, sentence in SENTENCES.items()}
_ENDS = frozenset({"limit_end", "all_end", "zone_end", "national", "led:end", "general_end", "school_end"})


def parse(text: str) -> Statement | None:
    """The statement of an answer, or None (abstention) unless the whole of it is of a known form."""
    said = cleaned(text).lower()
    # Before anything is folded: lower case alone makes a k of a Kelvin sign.
    if not text.isascii() or said != " ".join(text.split()).lower():
        return None  # something had to be cleaned away or folded: not the language agreed on
    if (label := _NAMED.get(said.rstrip("."))) is not None and said.count(".") <= 1:
        return statement_of(label)
    if match := _NUMBER.fullmatch(said):
        return _numbered(match, "panel" in match["what"], match["zone"] is not None)
    if match := _PLAIN.fullmatch(said):
        return _numbered(match, gantry=False, zone=False)
    return None


def statement_of(label: str) -> Statement:
    """The statement of a class of the reader's table."""
    head, _, tail = label.partition(":")
    if label == OTHER:
        return NOTHING
    if label in _ENDS:
        return Statement("limit", label, scope="end")
    if head in _SCOPES and (value := number_in(tail)) is not None:
        return Statement("limit", label, value, None, _SCOPES[head])
    return Statement(_KINDS.get(head, "sign"), label)


_SCOPES: dict[str, Scope] = {
    "limit": "permanent", "zone": "zone", "led": "gantry",
    "limit_board": "permanent", "school_limit": "permanent", "general": "permanent",
}  # fmt: skip
_KINDS: dict[str, FactKind] = {"light": "light", "plate": "plate", "led": "message"}


def _numbered(match: re.Match[str], gantry: bool, zone: bool) -> Statement | None:
    if gantry and (zone or match["wet"]):
        return None
    head = "led" if gantry else "zone" if zone else "limit"
    value = int(match["value"])
    unit: Unit | None = {"km/h": "km/h", "mph": "mph"}.get(match["unit"] or "")  # type: ignore[assignment]
    scope: Scope = "when_wet" if match["wet"] else _SCOPES[head]
    return Statement("limit", f"{head}:{value}", value, unit, scope)


def admitted(statement: Statement, jurisdiction: str | None) -> bool:
    """Whether a statement is plausible where we are: its number is on the country's list, in the country's unit."""
    if statement.value is None:
        return True
    return statement.value in allowed_limits(jurisdiction, statement.unit)
