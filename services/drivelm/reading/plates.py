"""The parts of a sign: the plate that hangs below it on the same post, and the ring on a zone sign, which holds its number."""

from collections.abc import Sequence

from services.drivelm.reading.crops import Region
from services.drivelm.vocabulary.classes import ZONE_VALUES

TALL = 1.35
"""A sign box taller than this for its width holds the sign and its plate in one."""
TALL_BOARD, TALLEST_PAIR = 1.42, 1.62
"""Where limits stand on upright boards: lower than the first is a board, higher than the second a school board."""
_PLATE_ASPECT = 0.55  # height over width
_GAP = 0.02


def split(region: Region, *, boards: bool = False) -> tuple[Region, Region]:
    """The sign's own part of a box, and the part where its plate is or would be.

    ``boards``: limits stand on upright boards here, which are taller than wide without any plate.
    """
    if _holds_both(region, boards):
        seam = region.y0_px + region.width_px
        return region._replace(y1_px=seam), region._replace(y0_px=seam)
    top = region.y1_px + _GAP * region.height_px
    return region, Region(region.x0_px, top, region.x1_px, top + _PLATE_ASPECT * region.width_px)


def _holds_both(region: Region, boards: bool) -> bool:
    if boards:
        return TALL_BOARD * region.width_px < region.height_px < TALLEST_PAIR * region.width_px
    return region.height_px > TALL * region.width_px


def below(sign: Region, others: Sequence[Region]) -> int | None:
    """Which of the other boxes is the plate of this sign: the nearest one right below it; None without one."""
    fitting = [(other.y0_px - sign.y1_px, index) for index, other in enumerate(others) if _hangs_under(sign, other)]
    return min(fitting)[1] if fitting else None


def _hangs_under(sign: Region, other: Region) -> bool:
    middle, width = (sign.x0_px + sign.x1_px) / 2, sign.width_px
    aside = abs((other.x0_px + other.x1_px) / 2 - middle)
    gap = other.y0_px - sign.y1_px
    return (
        aside < 0.4 * width
        and -0.3 * sign.height_px < gap < 0.6 * sign.height_px
        and 0.5 < other.width_px / width < 2.0
    )


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
