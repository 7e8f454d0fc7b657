"""The time of day where the car is: satellites tell UTC, the country tells the zone. Some limits depend on hours.

The machine's own clock is not asked: a container and a played log have another day than the road. What is not surely known is unknown,
and then the law counts the lower limit.
"""

from collections.abc import Mapping
from datetime import UTC, datetime
from functools import cache
from types import MappingProxyType
from zoneinfo import ZoneInfo, ZoneInfoNotFoundError

from services.orchestrator.observations.validity import SECOND
from services.orchestrator.state import State, Utc

ZONES: Mapping[str, str] = MappingProxyType(
    {
        "AUT": "Europe/Vienna", "BEL": "Europe/Brussels", "CHE": "Europe/Zurich", "DEU": "Europe/Berlin", "FRA": "Europe/Paris",
        "GBR": "Europe/London", "IRL": "Europe/Dublin", "ITA": "Europe/Rome", "NLD": "Europe/Amsterdam", "POL": "Europe/Warsaw",
        "USA-CA": "America/Los_Angeles", "USA-NY": "America/New_York", "USA-WA": "America/Los_Angeles",
    }
)  # fmt: skip
"""Countries and parts with one zone. Spain, Texas, Florida and the USA as a whole have several: their time of day is unknown."""
STEADY_NS, KEPT_NS = 3 * SECOND, 600 * SECOND
"""For so long UTC has to go on as our clock does before it is believed; for so long our clock goes on without it, as in a tunnel."""
MOST_DRIFT_S = 2.0
FIRST_S, LAST_S = 1_577_836_800.0, 4_102_444_800.0
"""The years 2020 to 2099: a receiver without time tells another."""
STEP_MIN = 5
"""The time of day counts in such steps, so that a stretch of road is one question."""


def heard(known: Utc | None, told_s: float | None, now_ns: int, *, stepped: bool) -> Utc | None:
    """UTC after a tick in which satellites told it, or did not. It begins anew where either clock leapt."""
    if known is not None and (stepped or now_ns < known.at_ns or now_ns - known.at_ns > KEPT_NS):
        known = None
    if told_s is None or not FIRST_S <= told_s <= LAST_S:
        return known
    steady = known is not None and abs(told_s - _utc_s(known, now_ns)) <= MOST_DRIFT_S
    return Utc(utc_s=told_s, at_ns=now_ns, since_ns=known.since_ns if known is not None and steady else now_ns)


def local_time(state: State) -> datetime | None:
    """Date and time of day in steps of 5 minutes; None: UTC or the country is unknown, the country is assumed, or it has several zones."""
    known, country = state.utc, state.signs.jurisdiction
    zone = _zone(state.place or "")
    if known is None or country is None or country.assumed or zone is None or known.at_ns - known.since_ns < STEADY_NS:
        return None
    at = datetime.fromtimestamp(_utc_s(known, state.now_ns), UTC).astimezone(zone)
    return at.replace(minute=at.minute // STEP_MIN * STEP_MIN, second=0, microsecond=0)


@cache
def _zone(place: str) -> ZoneInfo | None:
    """None: several zones, or a machine without the table of zones (package tzdata)."""
    try:
        return ZoneInfo(ZONES[place]) if place in ZONES else None
    except ZoneInfoNotFoundError:
        return None


def _utc_s(known: Utc, now_ns: int) -> float:
    return known.utc_s + (now_ns - known.at_ns) / SECOND
