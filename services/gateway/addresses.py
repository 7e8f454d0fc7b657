"""The addresses of resources, as text and taken apart."""

import re
from typing import NamedTuple
from urllib.parse import unquote

ADVICE, WORLD, HEALTH = "drivemcp://advice/last", "drivemcp://world", "drivemcp://vehicle/health"
DECISION, REPORT = "drivemcp://decision/{tick}", "drivemcp://drives/{id}/report"
CITATION = "rulepack://{pack}/{+document}{#offset}"
"""By RFC 6570: `rulepack://DEU-v1/sources/signs.en.md#120`."""
MOST_URI = 512
_FORMS = (
    ("decision", re.compile(r"drivemcp://decision/(\d{1,15})")),
    ("report", re.compile(r"drivemcp://drives/([A-Za-z0-9_-][A-Za-z0-9_.-]{0,99})/report")),
    ("citation", re.compile(r"rulepack://([A-Za-z0-9][A-Za-z0-9.-]{0,63}/[A-Za-z0-9_./-]{1,120})#(\d{1,7})")),
)


class Address(NamedTuple):
    """What is asked for: `fixed` with the whole address, or a form of `_FORMS` with its parts."""

    form: str
    parts: tuple[str, ...]


def parsed(uri: str) -> Address | None:
    """None for what is no address of ours."""
    if uri in (ADVICE, WORLD, HEALTH):
        return Address("fixed", (uri,))
    if len(uri) > MOST_URI:
        return None
    plain = unquote(uri)
    matches = ((form, pattern.fullmatch(plain)) for form, pattern in _FORMS)
    return next((Address(form, found.groups()) for form, found in matches if found is not None), None)


def citation_address(document: str, offset: int | str) -> str:
    """Of a citation: `document` as citations name it, `offset` where they start."""
    return f"rulepack://{document}#{offset}"
