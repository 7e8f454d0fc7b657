"""The number on a zone sign stands in a ring of its own: a second, closer look at that ring tells it apart."""

from services.drivelm.reading.crops import Region
from services.drivelm.vocabulary.classes import ZONE_VALUES

Readings = tuple[tuple[str, float], ...]
HEAD = "zone:"
ENOUGH = 0.3
"""Probability of a known zone number that the closer look must reach to be of use."""


def ring(region: Region) -> Region:
    """Where the ring is on a zone sign's box."""
    width, height = region.width_px, region.height_px
    return Region(
        region.x0_px + 0.18 * width,
        region.y0_px + 0.08 * height,
        region.x1_px - 0.18 * width,
        region.y0_px + 0.71 * height,
    )


def sharpened(whole: Readings, closer: Readings) -> Readings:
    """The readings of the whole sign, its number taken from the closer look; unclear there, it stays open.

    What the whole sign is (a zone, something else, nothing) is never changed by the closer look.
    """
    zone = sum(share for reading, share in whole if reading.startswith(HEAD))
    numbers = {f"{HEAD}{value}": share for value, share in _limits(closer) if f"{HEAD}{value}" in KNOWN}
    total = sum(numbers.values())
    if zone <= 0.0:
        return whole
    if total < ENOUGH:
        numbers, total = dict.fromkeys(sorted(KNOWN), 1.0), float(len(KNOWN))
    others = tuple(row for row in whole if not row[0].startswith(HEAD))
    return (*((reading, zone * share / total) for reading, share in numbers.items()), *others)


def _limits(readings: Readings) -> list[tuple[str, float]]:
    return [(reading.removeprefix("limit:"), share) for reading, share in readings if reading.startswith("limit:")]


KNOWN = frozenset(f"{HEAD}{value}" for value in ZONE_VALUES)
