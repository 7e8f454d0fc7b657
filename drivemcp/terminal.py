"""What may stand on a terminal: text without the characters that move its cursor, hide, recolour or turn around what it shows."""

import re
import sys
from typing import Any, TextIO, cast

_HARMFUL = re.compile(
    "[\x00-\x08\x0b-\x1f\x7f-\x9f"  # control characters but tab and line feed
    "\u061c\u200b-\u200f\u202a-\u202e\u2060-\u2069\ufeff"  # direction marks and overrides, what has no width
    "\ud800-\udfff]"
)


def printable(text: str) -> str:
    """The text with each harmful character written as `\\u001b`: in JSON still the same string."""
    return _HARMFUL.sub(lambda found: f"\\u{ord(found[0]):04x}", text)


class Printable:
    """A stream that writes what is printable of a text. All else is the stream's own."""

    def __init__(self, stream: TextIO) -> None:
        self._stream = stream

    def write(self, text: str) -> int:
        """Write; the length of what was given."""
        self._stream.write(printable(text))
        return len(text)

    def __getattr__(self, name: str) -> Any:
        return getattr(self._stream, name)


def own_terminal(stream: TextIO) -> TextIO:
    """The stream below `Printable`, for what moves the cursor on purpose."""
    below: TextIO = getattr(stream, "_stream", stream) if isinstance(stream, Printable) else stream
    return below


def filter_output() -> None:
    """From now on nothing harmful comes to this process's standard output and standard error."""
    if not isinstance(sys.stdout, Printable):
        sys.stdout = cast(TextIO, Printable(sys.stdout))
    if not isinstance(sys.stderr, Printable):
        sys.stderr = cast(TextIO, Printable(sys.stderr))
