"""The speed that the law asks not to go below: told beside the limit, and no reason for a driver to drive faster."""

from domain.units import to_mps
from proto.rules import Situation
from services.rules.limits.conditions import holds
from services.rules.packs.format import Minimum, Provision
from services.rules.packs.loading import Pack

CLEAR_M = 150.0
"""Every law excepts bad weather; in less sight, and on a wet or snowy road, no minimum is told."""


def minimum_speed(pack: Pack, situation: Situation, most_mps: float | None) -> tuple[Provision, Minimum] | None:
    """The highest minimum whose every condition surely holds, if the limit allows it; None: the pack has none here."""
    hindered = situation.wet or situation.snow or (situation.visibility_m or CLEAR_M) < CLEAR_M
    if hindered or most_mps is None:
        return None
    sure = (row for row in pack.minimums if holds(row[1].when, situation) == "yes")
    allowed = (row for row in sure if to_mps(row[1].value, row[1].unit) <= most_mps)
    return max(allowed, key=lambda row: to_mps(row[1].value, row[1].unit), default=None)
