"""What is plausible on signs where: the allow-lists that a reading must pass, and what a country's signs give away."""

from collections.abc import Mapping
from types import MappingProxyType
from typing import Literal, NamedTuple

from proto.scene import Country, Unit

Side = Literal["left", "right"]


class Jurisdiction(NamedTuple):
    """Signs of one country. Numbers as posted, in its own unit."""

    unit: Unit
    side: Side
    limits: frozenset[int]
    town_ground: str
    plate_languages: tuple[str, ...]
    boards: bool = False
    """Limits stand on boards in words, warnings on diamonds; elsewhere in rings and on triangles."""
    by_signs: bool = True
    """Whether signs alone may tell the country; another is told by the position, a border or the home setting."""


_KMH = frozenset(range(10, 140, 10)) | {5, 15}
_MPH = frozenset({5, 10, 15, 20, 30, 40, 50, 60, 70})
_IRISH = frozenset({20, 30, 40, 50, 60, 80, 100, 120})

_TABLE: Mapping[Country, Jurisdiction] = MappingProxyType(
    {
        "DEU": Jurisdiction("km/h", "right", _KMH, "yellow", ("de",)),
        "AUT": Jurisdiction("km/h", "right", _KMH, "white", ("de",)),
        "FRA": Jurisdiction("km/h", "right", _KMH, "white", ("fr",)),
        "NLD": Jurisdiction("km/h", "right", _KMH, "dark", ("nl",)),
        "POL": Jurisdiction("km/h", "right", _KMH | {140}, "dark", ("pl",)),
        "GBR": Jurisdiction("mph", "left", _MPH, "white", ("en",)),
        "CHE": Jurisdiction("km/h", "right", _KMH - {130}, "dark", ("de", "fr")),
        "USA": Jurisdiction("mph", "right", frozenset(range(5, 90, 5)), "", ("en",), boards=True),
        "BEL": Jurisdiction("km/h", "right", _KMH - {130}, "white", ("nl", "fr"), by_signs=False),
        "IRL": Jurisdiction("km/h", "left", _IRISH, "white", ("en",), by_signs=False),
        "ITA": Jurisdiction("km/h", "right", _KMH, "white", ("it",), by_signs=False),
        "ESP": Jurisdiction("km/h", "right", _KMH - {130}, "white", ("es",), by_signs=False),
    }
)
JURISDICTIONS: Mapping[str, Jurisdiction] = MappingProxyType({str(country): row for country, row in _TABLE.items()})


def allowed_limits(jurisdiction: str | None, unit: Unit | None) -> frozenset[int]:
    """The numbers that a limit sign may show here; without a known country, those common to all that fit the unit."""
    if (here := JURISDICTIONS.get(jurisdiction or "")) is not None:
        return here.limits if unit in (None, here.unit) else frozenset()
    fitting = [row.limits for row in JURISDICTIONS.values() if unit in (None, row.unit)]
    return frozenset.union(*fitting) if fitting else frozenset()


def unit_of(jurisdiction: str | None) -> Unit | None:
    """The unit in which a country's signs speak; None where the country is unknown."""
    row = JURISDICTIONS.get(jurisdiction or "")
    return row.unit if row else None


def has_boards(jurisdiction: str | None) -> bool:
    """Whether limits stand on boards there."""
    row = JURISDICTIONS.get(jurisdiction or "")
    return row is not None and row.boards


def unit_of_sign(jurisdiction: str | None, reading: str) -> Unit | None:
    """The unit of a sign's number: the country's; of a ring where numbers stand on boards the lower reading, km/h."""
    if has_boards(jurisdiction) and reading.partition(":")[0] not in ON_BOARDS:
        return "km/h"
    return unit_of(jurisdiction)


ON_BOARDS = frozenset({"limit_board", "school_limit", "led"})
"""Codes of numbers that are no ring of a sign."""
