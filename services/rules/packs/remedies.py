"""What to do about a file that does not decode: for each of msgspec's messages one remedy."""

import re
from collections.abc import Callable
from typing import Any, get_args

from drivemcp.choices import choices, fields, nearest
from services.rules.packs import format as pack_format

_KINDS = {
    "str": "a text in double quotes", "int": "a whole number", "float": "a number", "bool": "true or false",
    "null": "null", "array": "a list in square brackets", "object": "an object in braces",
}  # fmt: skip
_FORMS = {
    repr(meta.pattern)[1:-1]: f"write it as in {' or '.join(meta.examples)}"
    if meta.examples
    else f"give the {meta.description}"
    for alias in vars(pack_format).values()
    for meta in get_args(alias)[1:]
    if getattr(meta, "pattern", None)
}
"""What to write, by the form that a text must have."""
_Remedy = Callable[[re.Match[str], Exception, Any], str]


def remedy_for(error: Exception, kind: Any) -> str:
    """What to do. `kind`: the type that was decoded."""
    for form, remedy in _REMEDIES:
        if (found := form.search(str(error))) is not None and (said := remedy(found, error, kind)):
            return said
    return "compare it with rulepacks/TEST-v1"


def _unknown_field(found: re.Match[str], error: Exception, kind: Any) -> str:
    meant = nearest(found[1], fields(error, kind))
    return f"{meant}, or remove it" if meant else "remove it"


def _type(found: re.Match[str], error: Exception, kind: Any) -> str:
    return f"give {' or '.join(_KINDS.get(name, name) for name in found[1].split(' | '))}"


_REMEDIES: tuple[tuple[re.Pattern[str], _Remedy], ...] = (
    (re.compile(r"unknown field `(.+?)`"), _unknown_field),
    (re.compile(r"missing required field `(.+?)`"), lambda found, *_: f"add {found[1]!r}"),
    (re.compile(r"Invalid (?:enum )?value"), lambda _, error, kind: choices(error, kind).removeprefix(": ")),
    (re.compile(r"matching regex '(.+)'(?: - at|$)"), lambda found, *_: _FORMS.get(found[1], "")),
    (re.compile(r"of length <= (\d+)"), lambda found, *_: f"shorten it to {found[1]} characters"),
    (re.compile(r"of length (\d+)"), lambda found, *_: f"give {found[1]} values"),
    (re.compile(r"Expected `\w+` ([<>]=? [\d.-]+)"), lambda found, *_: f"give a number {found[1]}"),
    (re.compile(r"Expected `(.+?)`, got"), _type),
    (re.compile(r"truncated"), lambda *_: "the file ends too early: close every quote and bracket"),
    (re.compile(r"'utf-8' codec|\(byte 0\)"), lambda *_: "save the file as JSON in UTF-8"),
    (
        re.compile(r"malformed"),
        lambda *_: "mend this line or the one before: a comma, quote or bracket is missing or too much",
    ),
    (re.compile(r"out of range"), lambda *_: "give a smaller number"),
    (re.compile(r"recursion"), lambda *_: "nest it less deeply"),
)
