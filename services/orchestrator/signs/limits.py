"""The limits in force, and what a passed sign does to them.

A limit that was believed stays until positive evidence ends it: an end sign, a new sign, a junction at which the ego
turned, a border.
"""

import math
from collections.abc import Callable
from typing import Literal, cast, get_args

import msgspec

from proto.rules import PostedLimit
from proto.scene import COUNTRIES, Unit
from services.orchestrator.state import Believed, InForce, SignAhead, Signs

RoadType = Literal["urban", "rural", "motorway", "dual_carriageway", "living_street", "expressway"]
ROAD_TYPES: frozenset[str] = frozenset(get_args(RoadType))
SURE = 0.6
"""From this confidence on a reading may end or raise a limit."""
TOLD = 0.3
"""From this confidence on a believed reading may lower one."""
SAME_POST_NS = 5_000_000_000
"""Signs that are passed within this time may stand on one post, or on both sides of the road."""
SAME_BORDER_NS = 20_000_000_000
"""A border's signs are passed within this time."""
UNSIGNED_KMH: dict[str, float] = {
    "living_street": 7.0, "rural": 80.0, "expressway": 80.0, "dual_carriageway": 100.0, "motorway": 100.0,
}  # fmt: skip
UNSIGNED_UNKNOWN_KMH = 50.0
"""The lowest limit that our countries have without a sign on such a road: above it, a sign may raise what holds."""
MOST_CONDITIONAL = 3
SCHOOL_PLATE, ARROW_PLATE, DISTANCE_PLATE, WET_PLATE = "plate:school", "plate:arrow", "plate:distance", "plate:when_wet"
LORRIES_PLATE = "plate:lorries"
RESTRICTED_PLATES = (LORRIES_PLATE, "plate:time", WET_PLATE, SCHOOL_PLATE, ARROW_PLATE)
"""Plates under which a limit stands beside the others instead of replacing them. Which way the ego will go is not
known: a limit under an arrow counts whenever it is the lowest, and what stands under an arrow ends or starts nothing, but for
a town where more than its law is posted."""
TOWN_KMH = 50.0
"""No country of ours lets cars drive faster in a town unless a sign there says so."""


def lowers(signs: Signs, sign: SignAhead) -> bool:
    """Whether a sign shows a limit not above the lowest in force; where none is, not above what such roads have."""
    if sign.value is None or not shows_limit(sign):
        return False
    value = value_kmh(sign.value, sign.unit)
    road = signs.road_type.value if signs.road_type is not None else ""
    unsigned = UNSIGNED_KMH.get(road, UNSIGNED_UNKNOWN_KMH)
    least = min((value_kmh(each.posted.value, each.posted.unit) for each in in_force(signs)), default=unsigned)
    return value <= least


def shows_limit(sign: SignAhead) -> bool:
    """Whether a sign sets a limit, other than ending one."""
    return sign.value is not None and sign.scope != "end" and not sign.reading.partition(":")[0].endswith("_end")


def value_kmh(value: float, unit: Unit | None) -> float:
    """For comparison; a number without unit is taken as km/h, the lower reading."""
    return value * 1.609344 if unit == "mph" else value


def in_force(signs: Signs) -> tuple[InForce, ...]:
    """All limits in force."""
    single = tuple(each for each in (signs.permanent, signs.gantry, signs.zone) if each is not None)
    return (*single, *signs.conditional)


def apply(signs: Signs, sign: SignAhead, now_ns: int) -> Signs:
    """The limits after a sign was passed."""
    others = tuple(each for each in signs.recent if each.reading != sign.reading)
    signs = msgspec.structs.replace(signs, recent=(*others, sign)[-4:])
    if not sign.believed or not sign.own_lane or sign.confidence < TOLD:
        return signs
    if sign.confidence < SURE and not lowers(signs, sign):
        return signs
    if shows_limit(sign):
        return _set(signs, sign, now_ns)
    if any(plate.startswith(ARROW_PLATE) for plate in sign.plates) and not enters_a_slower_town(signs, sign):
        return signs
    head = sign.reading.partition(":")[0]
    if sign.scope == "end" and sign.value is not None:
        head = "limit_end"
    ends = ENDS.get(sign.reading) or ENDS.get(head)
    return ends(signs, sign, now_ns) if ends is not None else signs


def enters_a_slower_town(signs: Signs, sign: SignAhead) -> bool:
    """Whether a town begins here whose law is lower than all that holds; no such sign is for one way, its arrow is misread."""
    inside = signs.road_type is not None and signs.road_type.value in ("urban", "living_street")
    least = min((value_kmh(each.posted.value, each.posted.unit) for each in in_force(signs)), default=math.inf)
    return sign.reading == "town_entry" and not inside and least > TOWN_KMH


def _set(signs: Signs, sign: SignAhead, now_ns: int) -> Signs:
    posted = PostedLimit(
        value=sign.value or 0.0,
        unit=sign.unit or "km/h",  # as everywhere: a number without unit is the lower reading
        scope=cast(Literal["permanent"], sign.scope),
        confidence=sign.confidence,
        plates=sign.plates,
        reading=sign.reading,
    )
    limit = InForce(posted=posted, since_ns=now_ns, track_id=sign.track_id)
    beside = sign.scope == "when_wet" or any(plate.startswith(RESTRICTED_PLATES) for plate in sign.plates)
    if beside:
        others = tuple(each for each in signs.conditional if _differs(each, posted))
        return changed(signs, now_ns, conditional=_strictest((*others, limit)))
    if any(plate.startswith(DISTANCE_PLATE) for plate in sign.plates) and not lowers(signs, sign):
        return signs
    if sign.confidence >= SURE:
        signs = _beyond_the_junction(signs, now_ns)
    slot = {"gantry": "gantry", "zone": "zone"}.get(sign.scope, "permanent")
    known: InForce | None = getattr(signs, slot)
    if slot == "permanent" and _is_of_the_zone(signs, posted, now_ns):
        return signs
    if known is not None and not _differs(known, posted):
        return signs
    also = {"permanent": None} if slot == "zone" else {}
    when = {"gantry_changed_ns": now_ns} if slot == "gantry" else {}
    return changed(signs, now_ns, ended=(), **{slot: limit}, **also, **when)


def _is_of_the_zone(signs: Signs, posted: PostedLimit, now_ns: int) -> bool:
    """Whether a limit is what a zone's sign shows on the same post: the ring on its board, which a camera may find alone.

    Where another limit stands beside the zone it is none: it may lower what holds once the zone has ended.
    """
    zone = signs.zone
    if zone is None or signs.permanent is not None or now_ns - zone.since_ns >= SAME_POST_NS:
        return False
    return (zone.posted.value, zone.posted.unit, zone.posted.plates) == (posted.value, posted.unit, posted.plates)


def _beyond_the_junction(signs: Signs, now_ns: int) -> Signs:
    """Without limits under arrows of an earlier post: the limit that is posted next for all holds for us, whichever way we went."""
    left = tuple(
        each
        for each in signs.conditional
        if now_ns - each.since_ns < SAME_POST_NS
        or not any(plate.startswith(ARROW_PLATE) for plate in each.posted.plates)
    )
    return _with_conditional(signs, left, now_ns)


def _with_conditional(signs: Signs, left: tuple[InForce, ...], now_ns: int) -> Signs:
    return signs if left == signs.conditional else changed(signs, now_ns, conditional=left)


def may_be_ours(scope: str, plates: tuple[str, ...], *, dry: bool) -> bool:
    """Whether a posted limit can hold for a car now: not one of wet roads where it is surely dry, nor one of lorries."""
    if scope == "when_wet":
        return not dry
    return not any(plate.startswith(LORRIES_PLATE) for plate in plates)


def _strictest(limits: tuple[InForce, ...]) -> tuple[InForce, ...]:
    """As many as are remembered, in the order in which they came; the highest goes first."""
    low = sorted(limits, key=lambda each: value_kmh(each.posted.value, each.posted.unit))[:MOST_CONDITIONAL]
    return tuple(each for each in limits if each in low)


def _differs(known: InForce, posted: PostedLimit) -> bool:
    old = known.posted
    return (old.value, old.unit, old.scope, old.plates) != (posted.value, posted.unit, posted.scope, posted.plates)


# -- ends ------------------------------------------------------------------------------------------------------------


def changed(signs: Signs, now_ns: int, **fields: object) -> Signs:
    """The signs with what changed among the limits, and when."""
    return msgspec.structs.replace(signs, changed_ns=now_ns, **fields)


def clear(signs: Signs, now_ns: int) -> Signs:
    """No limit in force: those of the road or country left behind end."""
    return changed(signs, now_ns, permanent=None, gantry=None, zone=None, conditional=())


def in_another_country(signs: Signs, now_ns: int) -> Signs:
    """Nothing of the country left behind holds: no limit, and no unit in which the numbers ahead were read till now."""
    return _without_units(clear(signs, now_ns))


def _without_units(signs: Signs) -> Signs:
    ahead = tuple(msgspec.structs.replace(each, unit=None) for each in signs.ahead)
    return msgspec.structs.replace(signs, ahead=ahead, units=None, traffic_side=None)


def is_unknown_country(code: str) -> bool:
    """Whether a text is a country's code, of a country whose signs nobody knows here."""
    return len(code) == 3 and code.isascii() and code.isalpha() and code.isupper() and code not in COUNTRIES


def without_country(signs: Signs, now_ns: int) -> Signs:
    """The country is unknown, which is the careful side: the law is then the strictest of all. No limit ends by it."""
    if signs.jurisdiction is None:
        return signs
    return msgspec.structs.replace(
        _without_units(signs),
        jurisdiction=None,
        former_jurisdiction=signs.jurisdiction.value,
        crossed=True,
        unknown_ns=now_ns,
    )


def _end(*slots: str) -> Callable[[Signs, SignAhead, int], Signs]:
    def end(signs: Signs, sign: SignAhead, now_ns: int) -> Signs:
        fields: dict[str, object] = {slot: () if slot == "conditional" else None for slot in slots}
        if not any(getattr(signs, slot) for slot in slots):
            return signs
        when = {"gantry_changed_ns": now_ns} if signs.gantry is not None and "gantry" in slots else {}
        ended = (*signs.ended, sign.reading)[-4:]
        return changed(signs, now_ns, ended=ended, **fields, **when)

    return end


def _school_end(signs: Signs, sign: SignAhead, now_ns: int) -> Signs:
    left = tuple(each for each in signs.conditional if SCHOOL_PLATE not in each.posted.plates)
    return _with_conditional(signs, left, now_ns)


def _place(road_type: str) -> Callable[[Signs, SignAhead, int], Signs]:
    def place(signs: Signs, sign: SignAhead, now_ns: int) -> Signs:
        believed = Believed(value=road_type, confidence=sign.confidence, since_ns=now_ns)
        ended = (*signs.ended, sign.reading)[-4:]
        return msgspec.structs.replace(clear(signs, now_ns), road_type=believed, ended=ended)

    return place


def _road(road_type: str) -> Callable[[Signs, SignAhead, int], Signs]:
    """Another kind of road, on which limits go on: such signs lift none in most countries."""

    def road(signs: Signs, sign: SignAhead, now_ns: int) -> Signs:
        believed = Believed(value=road_type, confidence=sign.confidence, since_ns=now_ns)
        return changed(signs, now_ns, road_type=believed)

    return road


def _national(signs: Signs, sign: SignAhead, now_ns: int) -> Signs:
    after = _end("permanent", "zone", "conditional")(signs, sign, now_ns)
    if signs.road_type is None or signs.road_type.value == "urban":
        rural = Believed(value="rural", confidence=sign.confidence, since_ns=now_ns)
        after = changed(after, now_ns, road_type=rural)
    return after


def _border(signs: Signs, sign: SignAhead, now_ns: int) -> Signs:
    country = sign.reading.partition(":")[2]
    if is_unknown_country(country):
        return without_country(signs, now_ns)
    if country not in COUNTRIES:
        return signs
    here = signs.jurisdiction
    believed = Believed(value=country, confidence=sign.confidence, since_ns=now_ns, evidence=sign.reading)
    told: dict[str, object] = {"jurisdiction": believed, "crossed": True, "ended": (sign.reading,)}
    if here is None or here.value != country:
        former = here.value if here is not None else ""
        return msgspec.structs.replace(in_another_country(signs, now_ns), former_jurisdiction=former, **told)
    if not here.assumed and now_ns - here.since_ns < SAME_BORDER_NS:
        return signs  # its other camera's track, or the sign on the other side of the road
    # We were taken to be here before we were: its units go on to hold, and no limit of the country left behind does.
    return msgspec.structs.replace(clear(signs, now_ns), former_jurisdiction="", **told)


ENDS: dict[str, Callable[[Signs, SignAhead, int], Signs]] = {
    "limit_end": _end("permanent", "conditional", "gantry"),
    "all_end": _end("permanent", "conditional", "gantry"),
    "zone_end": _end("zone"),
    "school_end": _school_end,
    "led:end": _end("gantry"),
    "led:blank": _end("gantry"),
    "national": _national,
    "town_entry": _place("urban"),
    "town_exit": _place("rural"),
    "motorway": _place("motorway"),
    "motorway_end": _place("rural"),
    "expressway": _road("expressway"),
    "expressway_end": _road("rural"),
    "calm_street": _place("living_street"),
    "border": _border,
}
