"""The country at a position on earth, by the borders that the package countrycheck holds."""

from functools import cache
from typing import NamedTuple

from countrycheck import CountryCheck

SURE = 0.9
"""A share of the cell around the position (some 7 km) below which two countries are near: the position tells neither."""


class Place(NamedTuple):
    """A country (ISO 3166-1 alpha-3), and how much of the surroundings lies in it."""

    country: str
    share: float


@cache
def _borders() -> CountryCheck:
    return CountryCheck()


def place_of(latitude_deg: float, longitude_deg: float) -> Place | None:
    """The country there; None at sea, near a border, or for a position that is none."""
    if not (abs(latitude_deg) <= 90.0 and abs(longitude_deg) <= 180.0):
        return None
    found = _borders().check(longitude_deg, latitude_deg)
    return Place(found.country, found.confidence) if found.country and found.confidence >= SURE else None
