"""The time of day where the car is: satellites tell UTC, the country tells the zone. Some limits depend on hours.

The machine's own clock is not asked: a container and a played log have another day than the road. What is not surely known is unknown,
and then the law counts the lower limit.
"""

from collections.abc import Mapping
from datetime import UTC, datetime
from functools import cache
from types import MappingProxyType
from zoneinfo import ZoneInfo, ZoneInfoNotFoundError

import msgspec

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
FRESH_NS = 2 * SECOND
"""Receivers tell a position once a second or more often."""
STEADY_NS, KEPT_NS = 10 * SECOND, 600 * SECOND
"""For so long UTC has to go on as our clock does before it is believed. For so long our clock goes on without it, as in a tunnel, and a
contradiction is remembered."""
MOST_DRIFT_S, DRIFT_RATE = 1.0, 1e-4
"""By how much the two may part, and by how much more of the time since: a car's clock is wrong by less."""
FIRST_S, LAST_S = 1_577_836_800.0, 4_102_444_800.0
"""The years 2020 to 2099: a receiver without time tells another."""
STEP_MIN = 5
"""The time of day counts in such steps, so that a stretch of road is one question."""
ANSWERS_S = 2
"""Rules have so long to answer once the hour is another."""


def told_now_s(utc_s: float | None, stamp_ns: int, now_ns: int) -> float | None:
    """UTC now by a fix of a time; None where the fix tells none, is late, or is of a time that is yet to come."""
    age_ns = now_ns - stamp_ns
    return utc_s + age_ns / SECOND if utc_s is not None and 0 <= age_ns <= FRESH_NS else None


def heard(known: Utc | None, told_s: float | None, now_ns: int, *, stepped: bool) -> Utc | None:
    """UTC after a tick in which satellites told it, or did not. It begins anew where either clock leapt."""
    if known is not None and (stepped or not 0 <= now_ns - known.at_ns <= KEPT_NS):
        known = None
    if told_s is None or not FIRST_S <= told_s <= LAST_S:
        return known
    if known is not None and _goes_on(known, told_s, now_ns):
        return msgspec.structs.replace(known, utc_s=told_s, at_ns=now_ns)
    doubted_to_ns = known.doubted_to_ns if known is not None else 0
    if known is not None and known.at_ns - known.since_ns >= STEADY_NS:
        doubted_to_ns = now_ns + KEPT_NS
    return Utc(utc_s=told_s, at_ns=now_ns, first_s=told_s, since_ns=now_ns, doubted_to_ns=doubted_to_ns)


def _goes_on(known: Utc, told_s: float, now_ns: int) -> bool:
    gone_s = (now_ns - known.since_ns) / SECOND
    return abs(told_s - known.first_s - gone_s) <= MOST_DRIFT_S + DRIFT_RATE * gone_s


def local_time(state: State) -> datetime | None:
    """Date and time of day in steps of 5 minutes; None: UTC or the country is unknown, the country is assumed, or it has several zones."""
    at = _exactly(state)
    return at.replace(minute=at.minute // STEP_MIN * STEP_MIN, second=0, microsecond=0) if at is not None else None


def hour(state: State) -> float | None:
    """The time of day in hours, as the rules are asked with it; None: unknown."""
    at = local_time(state)
    return round(at.hour + at.minute / 60.0, 4) if at is not None else None


def is_over(asked_h: float | None, state: State) -> bool:
    """Whether the hour that the rules were asked with is over, and they had time to answer for the present one, or that is unknown."""
    if asked_h is None:
        return False
    at, now_h = _exactly(state), hour(state)
    if at is None or now_h is None:
        return True
    steps = round((now_h - asked_h) * 60 / STEP_MIN) % (24 * 60 // STEP_MIN)
    into_s = at.minute % STEP_MIN * 60 + at.second
    return steps != 0 and not (steps == 1 and into_s < ANSWERS_S)


def _exactly(state: State) -> datetime | None:
    known, country = state.utc, state.signs.jurisdiction
    zone = _zone(state.place or "")
    if known is None or country is None or country.assumed or zone is None:
        return None
    if known.at_ns - known.since_ns < STEADY_NS or state.now_ns < known.doubted_to_ns:
        return None
    return datetime.fromtimestamp(known.utc_s + (state.now_ns - known.at_ns) / SECOND, UTC).astimezone(zone)


@cache
def _zone(place: str) -> ZoneInfo | None:
    """None: several zones, or a machine without the table of zones (package tzdata)."""
    try:
        return ZoneInfo(ZONES[place]) if place in ZONES else None
    except ZoneInfoNotFoundError:
        return None
