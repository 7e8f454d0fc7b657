"""Text from the world is data: it is cleaned before anything looks at it, and never followed."""

import unicodedata

MAX_CHARS = 160
_MOST_DIGITS = 4
# Categories that have no business on a sign: controls, formats (bidi overrides, zero width), private use, surrogates.
_REFUSED = ("Cc", "Cf", "Co", "Cs", "Cn")


def cleaned(text: str, max_chars: int = MAX_CHARS) -> str:
    """One short line: compatibility forms folded, control and direction characters gone, spaces collapsed, cut."""
    folded = unicodedata.normalize("NFKC", text[: 4 * max_chars])
    kept = "".join(" " if char in "\t\r\n" else char for char in folded if _allowed(char))
    return " ".join(kept.split())[:max_chars]


def _allowed(char: str) -> bool:
    return char in "\t\r\n" or unicodedata.category(char) not in _REFUSED


def number_in(text: str) -> int | None:
    """The number that a text is, in plain digits, else `None`. Digits of other scripts do not count: `int` would read them or fail."""
    plain = text.isascii() and text.isdigit() and len(text) <= _MOST_DIGITS
    return int(text) if plain else None
