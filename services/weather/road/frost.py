"""The road's temperature, ice and hoar frost.

Ice needs a road at or below freezing, and water: rain, melt or vapour. Vapour settles where the road is no warmer than
the dew point (Jang, Forecasting nighttime frost-induced black ice formation on bridges using atmospheric data, Open
Transportation Journal 18, 2024). A road is up to 4 K colder than the air on clear nights and bridges, and warmer than
the air in winter sun (ours; road weather stations show the same spread, Climate 12(5):63, 2024). A road that is measured
warmer than freezing air may be that sun or a wrong thermometer; which of them is not known, so freezing air warns.
"""

from collections.abc import Iterable, Sequence
from typing import Literal

from services.weather.observations.claim import Claim, assumed, share
from services.weather.observations.observation import Observation, trust

FREEZING_C = 1.0
"""At or below this a road may freeze in places."""
COLDER_K, SUNNY_K = 4.0, 1.0
DOUBT_K = 10.0
"""A thermometer hardly trusted may be off by this."""
DEW_MARGIN_K, DRY_AIR_K = 1.0, 4.0
"""A road this much above the dew point takes on no frost; this much above it, what froze earlier has gone (ours)."""

Cold = Literal["warm", "unknown", "possible"]


def cold(observations: Sequence[Observation], now_ns: int) -> Cold:
    """Whether the road may be freezing: warm only where a source reassures and none warns."""
    claims = _claims(observations, now_ns)
    if not claims:
        return "unknown"
    warned = any(-each.warn <= FREEZING_C for each in claims)
    if not warned and any(_reassures(each) for each in claims):
        return "warm"
    return "possible" if warned or any(-each.bound <= FREEZING_C for each in claims) else "unknown"


def _reassures(claim: Claim) -> bool:
    sure = share(claim.trust)
    return sure > 0.0 and -claim.bound - (1.0 - sure) * DOUBT_K > FREEZING_C


def _claims(observations: Iterable[Observation], now_ns: int) -> list[Claim]:
    """Of the road's coldness: degC with the sign turned."""
    found = []
    for each in observations:
        sure = trust(each, now_ns)
        if each.road_c is not None:
            found.append(Claim(each.source, -each.road_c.low, -each.road_c.low, sure))
        if each.air_c is not None:
            found.append(Claim(each.source, COLDER_K - each.air_c.low, -each.air_c.low - SUNNY_K, sure))
    return found


def coldest_c(observations: Sequence[Observation], now_ns: int) -> float | None:
    """The road's temperature to count on, where any source knows."""
    claims = _claims(observations, now_ns)
    return -assumed(claims, max(each.bound for each in claims)) if claims else None


def frost_possible(observations: Sequence[Observation], now_ns: int, *, drying: bool) -> bool:
    """Whether frost may lie on a dry road that is cold: not where sure sources know it warmer than the dew point, and
    none has it nearer. `drying`: it may have been wet lately, which takes drier air.
    """
    roads = [(each.road_c.low, trust(each, now_ns)) for each in observations if each.road_c is not None]
    airs = [each.air_c.low + SUNNY_K for each in observations if each.air_c is not None]
    dews = [(each.dew_point_c.high, trust(each, now_ns)) for each in observations if each.dew_point_c is not None]
    if not all(any(share(sure) >= 1.0 for _, sure in found) for found in (roads, dews)):
        return True
    return min(min(roads)[0], *airs, 100.0) <= max(dews)[0] + (DRY_AIR_K if drying else DEW_MARGIN_K)


def warmest_c(observations: Sequence[Observation], now_ns: int) -> float | None:
    """The most that the road's temperature may be; None where no sure source measures it."""
    roads = [(each.road_c.high, trust(each, now_ns)) for each in observations if each.road_c is not None]
    return max(roads)[0] if any(share(sure) >= 1.0 for _, sure in roads) else None
