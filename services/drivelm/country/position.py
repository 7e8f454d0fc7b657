"""The country at a position on earth, by the borders that the package countrycheck holds."""

from functools import cache
from typing import NamedTuple

from countrycheck import CountryCheck

from proto.sensors import GnssFix

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
    """The country there; None at sea, near a border, or for coordinates outside the earth."""
    if not (abs(latitude_deg) <= 90.0 and abs(longitude_deg) <= 180.0):
        return None
    found = _borders().check(longitude_deg, latitude_deg)
    return Place(found.country, found.confidence) if found.country and found.confidence >= SURE else None


STEADY_NS, GAP_NS = 3_000_000_000, 2_000_000_000
"""For so long fixes must lie in one country, without a longer gap, before it is told: a receiver's jump tells none."""
MOST_SIGMA_M = 500.0


class Placing(NamedTuple):
    """The country in which the last fixes lay, since when, and until when."""

    country: str = ""
    since_ns: int = 0
    last_ns: int = 0

    def after(self, fix: GnssFix, now_ns: int) -> "Placing":
        """With one more fix; one that tells no country, or is poor, begins anew."""
        place = None
        if fix.latitude_deg is not None and fix.longitude_deg is not None and 0.0 <= fix.sigma_m <= MOST_SIGMA_M:
            place = place_of(fix.latitude_deg, fix.longitude_deg)
        if place is None:
            return Placing()
        steady = place.country == self.country and 0 <= now_ns - self.last_ns <= GAP_NS
        return Placing(place.country, self.since_ns if steady else now_ns, now_ns)

    @property
    def told(self) -> str:
        """The country that the fixes tell; empty: none yet."""
        return self.country if self.last_ns - self.since_ns >= STEADY_NS else ""
