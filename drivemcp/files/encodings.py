"""In which encoding a text file is written, and how a text is written into a file."""

import codecs
import contextlib
import json
import re

from drivemcp.errors import UserError

_NAMED = re.compile(rb"\s*<\?xml[^>]*?encoding=[\"']([\w.-]+)")
WINDOWS = "cp1252"


def encoding_of(content: bytes) -> str:
    """By the byte order mark, else UTF-8 where it is that, else what XML names, else what Windows writes in western Europe."""
    if content.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)):
        return "utf-16"
    with contextlib.suppress(UnicodeDecodeError):
        content.decode("utf-8")
        return "utf-8-sig"
    if named := _NAMED.match(content):
        with contextlib.suppress(LookupError):
            return codecs.lookup(named[1].decode()).name
    return WINDOWS


def toml_text(text: str) -> str:
    """A text as a string of TOML, which has no surrogates. Raises UserError for a text with bytes that are no letters."""
    if any("\ud800" <= letter <= "\udfff" for letter in text):
        raise UserError(f"{text!r} has bytes that are no text; rename the file or its folder")
    return json.dumps(text, ensure_ascii=False).replace("\x7f", "\\u007f")
