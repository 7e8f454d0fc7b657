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

from services.orchestrator.observations.validity import SECOND, fresh_ns
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
    """UTC now by a fix of a time; None where the fix tells none, is late, or is of a time that is yet to come by another clock."""
    if utc_s is None or not fresh_ns(stamp_ns, FRESH_NS, now_ns):
        return None
    return utc_s + (now_ns - stamp_ns) / SECOND


def heard(known: Utc | None, told_s: float | None, now_ns: int, *, step_ns: int) -> Utc | None:
    """UTC after a tick in which satellites told it, or did not; `step_ns`: by how much our clock leapt, or the process stood.

    UTC that does not go on as our clock did begins anew. What was believed and was contradicted, or can no longer be compared, is doubted.
    """
    told_s = told_s if told_s is not None and FIRST_S <= told_s <= LAST_S else None
    if known is None:
        return _anew(told_s, now_ns, 0) if told_s is not None else None
    doubted_to_ns = known.doubted_to_ns + step_ns if known.doubted_to_ns else 0
    if told_s is not None and _goes_on(known, told_s, now_ns):
        return msgspec.structs.replace(known, utc_s=told_s, at_ns=now_ns, doubted_to_ns=doubted_to_ns)
    if told_s is not None or step_ns:
        doubted_to_ns = now_ns + KEPT_NS if _is_steady(known) else doubted_to_ns
        return _anew(told_s if told_s is not None else known.utc_s, now_ns, doubted_to_ns)
    if now_ns - known.at_ns > KEPT_NS:  # too long ago, but later fixes are compared with it
        return msgspec.structs.replace(known, first_s=known.utc_s, since_ns=known.at_ns)
    return known


def set_back(known: Utc | None, now_ns: int) -> Utc | None:
    """UTC after our clock was set back: as after a leap."""
    if known is None:
        return None
    doubted = _is_steady(known) or known.doubted_to_ns > 0
    return _anew(known.utc_s, now_ns, now_ns + KEPT_NS if doubted else 0)


def _anew(told_s: float, now_ns: int, doubted_to_ns: int) -> Utc:
    return Utc(utc_s=told_s, at_ns=now_ns, first_s=told_s, since_ns=now_ns, doubted_to_ns=doubted_to_ns)


def _is_steady(known: Utc) -> bool:
    return known.at_ns - known.since_ns >= STEADY_NS


def _goes_on(known: Utc, told_s: float, now_ns: int) -> bool:
    gone_s = (now_ns - known.since_ns) / SECOND
    return abs(told_s - known.first_s - gone_s) <= MOST_DRIFT_S + DRIFT_RATE * gone_s


def local_time(state: State) -> datetime | None:
    """Date and time of day in steps of 5 minutes; None: UTC or the country is unknown, the country is assumed, or it has several zones."""
    at = _exactly(state)
    return _stepped(at) if at is not None else None


def hour(at: datetime) -> float:
    """The time of day in hours, as the rules are asked with it."""
    return round(at.hour + at.minute / 60.0, 4)


def is_over(asked_h: float | None, state: State) -> bool:
    """Whether the hour that the rules were asked with is over, and they had time to answer for the present one, or that is unknown."""
    if asked_h is None:
        return False
    at = _exactly(state)
    if at is None:
        return True
    steps = round((hour(_stepped(at)) - asked_h) * 60 / STEP_MIN) % (24 * 60 // STEP_MIN)
    into_s = at.minute % STEP_MIN * 60 + at.second
    return steps != 0 and not (steps == 1 and into_s < ANSWERS_S)


def _stepped(at: datetime) -> datetime:
    return at.replace(minute=at.minute // STEP_MIN * STEP_MIN, second=0, microsecond=0)


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
