"""Text from the world is data: it is cleaned, cut and quoted, and nothing is ever read out of it."""

import unicodedata

MOST = 160


def plain(text: str, most: int = MOST) -> str:
    """One line of printable characters, cut to `most`; formatting and control characters go."""
    kept = "".join(c if unicodedata.category(c)[0] not in ("C", "Z") else " " for c in text[: 4 * most])
    line = " ".join(kept.split())
    return line if len(line) <= most else line[: most - 1] + "…"
