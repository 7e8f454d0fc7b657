"""The country at a position on earth, by the borders that the package countrycheck holds."""

import math
from functools import cache
from typing import NamedTuple, Self

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


LEAP_M, FASTEST_MPS = 1_000.0, 100.0
"""A fix further from the one before than the first, beside what the second drives, is a leap."""


class Journey(NamedTuple):
    """The last fix in the map's frame, and the leap that later fixes have yet to confirm."""

    last: GnssFix | None = None
    last_ns: int = 0
    left: GnssFix | None = None
    """The fix before the leap."""
    leapt_ns: int = 0

    def after(self, fix: GnssFix, now_ns: int) -> Self:
        """With one more fix; one that is no number, or from before the last, is passed over."""
        if not all(map(math.isfinite, (fix.x_m, fix.y_m))) or (self.last is not None and now_ns <= self.last_ns):
            return self
        there = self._replace(last=fix, last_ns=now_ns)
        if self.left is not None and _reaches(self.left, self.leapt_ns, fix, now_ns):
            return there._replace(left=None)
        if self.last is not None and not _reaches(self.last, self.last_ns, fix, now_ns):
            return there._replace(left=self.left or self.last, leapt_ns=now_ns)
        return there._replace(left=None) if self.elsewhere else there

    @property
    def elsewhere(self) -> bool:
        """Whether the car went on for some seconds at a place that it cannot have driven to: a ferry, or another drive."""
        return self.left is not None and self.last_ns - self.leapt_ns >= STEADY_NS


def _reaches(before: GnssFix, before_ns: int, fix: GnssFix, now_ns: int) -> bool:
    apart_m = math.dist((before.x_m, before.y_m), (fix.x_m, fix.y_m))
    return apart_m <= LEAP_M + FASTEST_MPS * (now_ns - before_ns) / 1e9
