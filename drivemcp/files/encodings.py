"""In which encoding a text file is written."""

import codecs
import contextlib
import re

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
