"""Raised text (`<sup>`) on a line: a power, a note or a unit, and no letter or digit of the number before it."""

RAISED = frozenset({"sup", "SUP", "Superior"})
_WRITTEN = str.maketrans(
    "0123456789+-−–=()abcdefghijklmnoprstuvwxyzABDEGHIJKLMNOPRTUVW",
    "⁰¹²³⁴⁵⁶⁷⁸⁹⁺⁻⁻⁻⁼⁽⁾ᵃᵇᶜᵈᵉᶠᵍʰⁱʲᵏˡᵐⁿ°ᵖʳˢᵗᵘᵛʷˣʸᶻᴬᴮᴰᴱᴳᴴᴵᴶᴷᴸᴹᴺᴼᴾᴿᵀᵁⱽᵂ",
)
"""A raised `o` is a degree, or the end of an ordinal number, which is written alike."""
_OF_THE_NUMBER = frozenset(
    {"bis", "ter", "quater", "quinquies", "sexies", "septies", "octies", "novies", "nonies", "decies", "undecies", "duodecies",
     "st", "nd", "rd", "th", "er", "re", "ère", "ème"}
)  # fmt: skip
"""What is raised by custom and belongs to the number before it: `1bis`, `1st`."""


def raised(text: str) -> str:
    """`2` → `²`, `1)` → `¹⁾`, `bis` → `bis`; `^(...)` around what has no raised form. White space around it stays."""
    bare = " ".join(text.split())
    if bare.casefold() in _OF_THE_NUMBER or not any(each.isalnum() or each in "()+-−–" for each in bare):
        return text
    written = bare.translate(_WRITTEN)
    before, after = text[: len(text) - len(text.lstrip())], text[len(text.rstrip()) :]
    has_form = all(ord(each) in _WRITTEN or each in " *" for each in bare)
    return f"{before}{written if has_form else f'^({bare})'}{after}"
