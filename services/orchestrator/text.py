"""Text from the world is data: it is cleaned, cut and quoted, and nothing is ever read out of it."""

import re
import unicodedata

MOST = 160
_ENDS = re.compile(r"[.!?](?=\s|$)")


def plain(text: str, most: int = MOST) -> str:
    """One line of printable characters, cut to `most`; formatting and control characters go."""
    kept = text[: 4 * most]
    if not kept.isprintable():
        kept = "".join(c if unicodedata.category(c)[0] not in ("C", "Z") else " " for c in kept)
    line = " ".join(kept.split())
    return line if len(line) <= most else line[: most - 1] + "…"


def sentences(text: str, most: int = MOST) -> str:
    """As many whole sentences as fit in `most`, without the last full stop; of one that is longer the beginning."""
    line = plain(text, 4 * most)
    ends = [found.end() for found in _ENDS.finditer(line) if found.end() <= most + 1]
    whole = line if len(line) <= most or not ends else line[: ends[-1]]
    return plain(whole.removesuffix("."), most)
