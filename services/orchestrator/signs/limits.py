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
"""Signs passed within this time may stand on one post, or on both sides of the road."""
SAME_PLACE_NS = 300_000_000
"""Signs of one kind passed within this time stand in one place: the lower of two numbers counts."""
SAME_BORDER_NS = 20_000_000_000
"""A border's signs are passed within this time."""
UNSIGNED_KMH: dict[str, float] = {
    "living_street": 7.0, "rural": 80.0, "expressway": 80.0, "dual_carriageway": 100.0, "motorway": 100.0,
}  # fmt: skip
UNSIGNED_UNKNOWN_KMH = 50.0
"""The lowest limit that our countries have without a sign on such a road: above it, a sign may raise what holds."""
MOST_CONDITIONAL = 3
SCHOOL_PLATE, ARROW_PLATE, DISTANCE_PLATE, WET_PLATE = "plate:school", "plate:arrow", "plate:distance", "plate:when_wet"
LORRIES_PLATE, HOURS_PLATE = "plate:lorries", "plate:time"
RESTRICTED_PLATES = (LORRIES_PLATE, HOURS_PLATE, WET_PLATE, SCHOOL_PLATE, ARROW_PLATE)
"""Plates under which a limit stands beside the others instead of replacing them. The ego's way is not known: a limit under an
arrow counts whenever it is the lowest, and what stands under an arrow ends or starts nothing, but for a slower town."""
TOWN_KMH = 50.0
"""No country of ours lets cars drive faster in a town unless a sign there says so."""


def unit_and_side(country: str | None) -> tuple[Unit, str]:
    """In which unit a country's signs speak, and on which side one drives there; as in most of ours where it is unknown."""
    return OTHERWISE.get(country or "", ("km/h", "right"))


OTHERWISE: dict[str, tuple[Unit, str]] = {"GBR": ("mph", "left"), "IRL": ("km/h", "left"), "USA": ("mph", "right")}
"""Countries in which either is not as in the others."""


def borders(signs: Signs) -> tuple[SignAhead, ...]:
    """Signs of borders ahead that are believed; one of the country that is believed is the other post of a border passed."""
    here = f"border:{signs.country}"
    return tuple(each for each in signs.ahead if each.believed and each.head == "border" and each.reading != here)


def doubts_unit(signs: Signs) -> bool:
    """Whether signs speak against the country's unit or side of traffic, as behind a border whose own sign was missed: a number may be
    miles or kilometres until the country is believed."""
    unit, side = unit_and_side(signs.country)
    against = {reading for other, reading in _OF_UNITS.items() if other != unit}
    against |= {reading for other, reading in _OF_SIDES.items() if other != side}
    seen = (each.reading for each in (*signs.ahead, *signs.recent) if each.believed and each.confidence >= SURE)
    return not borders(signs) and not against.isdisjoint(seen)


_OF_UNITS = {"mph": "info:units_mph", "km/h": "info:units_kmh"}
_OF_SIDES = {"left": "info:side_left", "right": "info:side_right"}


def lowers(signs: Signs, sign: SignAhead) -> bool:
    """Whether a sign shows a limit not above the lowest in force; where none is, not above what such roads have."""
    unsigned = UNSIGNED_KMH.get(signs.road, UNSIGNED_UNKNOWN_KMH)
    return shows_limit(sign) and sign.kmh <= _least_kmh(signs, unsigned)


def _least_kmh(signs: Signs, default: float) -> float:
    return min((each.kmh for each in in_force(signs)), default=default)


def shows_limit(sign: SignAhead) -> bool:
    """Whether a sign sets a limit, other than ending one."""
    return sign.value is not None and sign.scope != "end" and not sign.head.endswith("_end")


def hangs(plates: tuple[str, ...], *heads: str) -> bool:
    """Whether one of these plates hangs below a sign."""
    return any(plate.startswith(heads) for plate in plates)


def in_force(signs: Signs) -> tuple[InForce, ...]:
    """All limits in force."""
    single = tuple(each for each in (signs.permanent, signs.gantry, signs.zone) if each is not None)
    return (*single, *signs.conditional)


def apply(signs: Signs, sign: SignAhead, now_ns: int) -> Signs:
    """The limits after a sign was passed."""
    others = tuple(each for each in signs.recent if each.reading != sign.reading)
    signs = msgspec.structs.replace(signs, recent=(*others, sign)[-4:])
    if not sign.ours or sign.confidence < (TOLD if lowers(signs, sign) else SURE):
        return signs
    if shows_limit(sign):
        return _set(signs, sign, now_ns)
    if hangs(sign.plates, ARROW_PLATE) and not enters_a_slower_town(signs, sign):
        return signs
    head = "limit_end" if sign.scope == "end" and sign.value is not None else sign.head
    ends = ENDS.get(sign.reading) or ENDS.get(head)
    return ends(signs, sign, now_ns) if ends is not None else signs


def enters_a_slower_town(signs: Signs, sign: SignAhead) -> bool:
    """Whether a town begins here whose law is lower than all that holds; no such sign is for one way, its arrow is misread."""
    begins = sign.reading == "town_entry" and signs.road not in ("urban", "living_street")
    return begins and _least_kmh(signs, math.inf) > TOWN_KMH


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
    if sign.scope == "when_wet" or hangs(sign.plates, *RESTRICTED_PLATES):
        others = tuple(each for each in signs.conditional if _differs(each, posted))
        limit = _surest(signs, limit)
        return changed(signs, now_ns, conditional=_strictest((*others, limit)))
    if hangs(sign.plates, DISTANCE_PLATE) and not lowers(signs, sign):
        return signs
    if sign.confidence >= SURE:
        signs = _beyond_the_junction(signs, now_ns)
    slot = sign.scope if sign.scope in ("gantry", "zone") else "permanent"
    if not _differs(getattr(signs, slot), posted) or (slot == "permanent" and _is_of_the_zone(signs, posted, now_ns)):
        return signs
    if _contradicts(getattr(signs, slot), limit):
        return signs
    also: dict[str, dict[str, object]] = {"zone": {"permanent": None}, "gantry": {"gantry_changed_ns": now_ns}}
    return changed(signs, now_ns, ended=(), **{slot: limit}, **also.get(slot, {}))


def _surest(signs: Signs, limit: InForce) -> InForce:
    """The limit as the surest track of its post told it, and when: a later, doubted track takes no belief away, and lends none."""
    of_post = (each for each in signs.conditional if limit.since_ns - each.since_ns < SAME_POST_NS)
    told = (each for each in of_post if not _differs(each, limit.posted))
    return max((limit, *told), key=lambda each: each.posted.confidence)


def _contradicts(known: InForce | None, limit: InForce) -> bool:
    """Whether a limit allows more than another one of the same place: one sign under two tracks, of which one is misread."""
    return known is not None and limit.since_ns - known.since_ns <= SAME_PLACE_NS and limit.kmh > known.kmh


def _is_of_the_zone(signs: Signs, posted: PostedLimit, now_ns: int) -> bool:
    """Whether a limit is the ring on the board of a zone's sign on the same post, which a camera may find alone.

    A zone beside another limit does not count: it may lower what holds once the zone has ended.
    """
    zone = signs.zone
    if zone is None or signs.permanent is not None or now_ns - zone.since_ns >= SAME_POST_NS:
        return False
    return (zone.posted.value, zone.posted.unit, zone.posted.plates) == (posted.value, posted.unit, posted.plates)


def _beyond_the_junction(signs: Signs, now_ns: int) -> Signs:
    """Without limits under arrows of an earlier post: the next limit for all holds for the ego, whichever way it went."""
    earlier = (each for each in signs.conditional if now_ns - each.since_ns >= SAME_POST_NS)
    return _without(signs, [each for each in earlier if hangs(each.posted.plates, ARROW_PLATE)], now_ns)


def _without(signs: Signs, ended: list[InForce], now_ns: int) -> Signs:
    """Without some of the conditional limits; unchanged if none of these is held."""
    left = tuple(each for each in signs.conditional if each not in ended)
    return changed(signs, now_ns, conditional=left) if ended else signs


def may_be_ours(scope: str, plates: tuple[str, ...], *, dry: bool) -> bool:
    """Whether a posted limit can hold for a car now: not one of wet roads where it is surely dry, nor one of lorries."""
    return not dry if scope == "when_wet" else not hangs(plates, LORRIES_PLATE)


def _strictest(limits: tuple[InForce, ...]) -> tuple[InForce, ...]:
    """As many as are remembered, in the order in which they came; the highest goes first."""
    low = sorted(limits, key=lambda each: each.kmh)[:MOST_CONDITIONAL]
    return tuple(each for each in limits if each in low)


def _differs(known: InForce | None, posted: PostedLimit) -> bool:
    return known is None or _shown(known.posted) != _shown(posted)


def _shown(posted: PostedLimit) -> tuple[object, ...]:
    return posted.value, posted.unit, posted.scope, posted.plates


# -- ends ------------------------------------------------------------------------------------------------------------


def changed(signs: Signs, now_ns: int, **fields: object) -> Signs:
    """The signs with what changed among the limits, and when."""
    return msgspec.structs.replace(signs, changed_ns=now_ns, **fields)


def _clear(signs: Signs, now_ns: int) -> Signs:
    """No limit in force: those of the road or country left behind end."""
    return changed(signs, now_ns, permanent=None, gantry=None, zone=None, conditional=())


def ended(signs: Signs, reading: str) -> tuple[str, ...]:
    """The last ends passed, with this one."""
    return (*signs.ended, reading)[-4:]


def _believed(value: str, sign: SignAhead, now_ns: int, evidence: str = "") -> Believed:
    return Believed(value=value, confidence=sign.confidence, since_ns=now_ns, evidence=evidence)


def read_anew(before: Signs, signs: Signs, now_ns: int) -> Signs:
    """The signs behind a border without a border sign, with the limit that was passed last read in the country's unit.

    A limit passed recently is as likely to stand behind the border as before it, and it is lower than the law alone.
    """
    last, unit = before.permanent, unit_and_side(signs.country)[0]
    if last is None or last.posted.unit == unit or now_ns - last.since_ns > UNTOLD_BORDER_NS:
        return signs
    posted = msgspec.structs.replace(last.posted, unit=unit)
    return msgspec.structs.replace(signs, permanent=msgspec.structs.replace(last, posted=posted))


UNTOLD_BORDER_NS = 20_000_000_000
"""Until other signs than the border's have told the country."""


def in_another_country(signs: Signs, now_ns: int) -> Signs:
    """No limit of the country left behind holds, nor the unit in which the numbers ahead were read."""
    return _without_units(_clear(signs, now_ns))


def _without_units(signs: Signs) -> Signs:
    ahead = tuple(msgspec.structs.replace(each, unit=None) for each in signs.ahead)
    return msgspec.structs.replace(signs, ahead=ahead, units=None, traffic_side=None)


def is_unknown_country(code: str) -> bool:
    """Whether a text is the code of a country whose signs are unknown here."""
    return len(code) == 3 and code.isascii() and code.isalpha() and code.isupper() and code not in COUNTRIES


def without_country(signs: Signs, now_ns: int) -> Signs:
    """The country is unknown, and the law the strictest of all; no limit ends by it."""
    if signs.jurisdiction is None:
        return signs
    return msgspec.structs.replace(
        _without_units(signs),
        jurisdiction=None,
        former_jurisdiction=signs.jurisdiction.value,
        crossed=True,
        unknown_ns=now_ns,
    )


def home_given_up(signs: Signs, now_ns: int) -> Signs:
    """The country was a setting alone and is unknown now: no border was crossed, and no limit ends by it."""
    return msgspec.structs.replace(_without_units(signs), jurisdiction=None, unknown_ns=now_ns)


def _end(*slots: str) -> Callable[[Signs, SignAhead, int], Signs]:
    def end(signs: Signs, sign: SignAhead, now_ns: int) -> Signs:
        if not any(getattr(signs, slot) for slot in slots):
            return signs
        fields: dict[str, object] = {slot: () if slot == "conditional" else None for slot in slots}
        if signs.gantry is not None and "gantry" in slots:
            fields["gantry_changed_ns"] = now_ns
        return changed(signs, now_ns, ended=ended(signs, sign.reading), **fields)

    return end


def _zone_end(signs: Signs, sign: SignAhead, now_ns: int) -> Signs:
    """A zone's sign under a plate is ended with the zone, as the sign without one on the other side of the road."""
    under_plates = [each for each in signs.conditional if each.posted.scope == "zone"]
    return _end("zone")(_without(signs, under_plates, now_ns), sign, now_ns)


def _school_end(signs: Signs, sign: SignAhead, now_ns: int) -> Signs:
    return _without(signs, [each for each in signs.conditional if SCHOOL_PLATE in each.posted.plates], now_ns)


def _place(road_type: str) -> Callable[[Signs, SignAhead, int], Signs]:
    """Another kind of road, on which no earlier limit holds."""

    def place(signs: Signs, sign: SignAhead, now_ns: int) -> Signs:
        after = _road(road_type)(_clear(signs, now_ns), sign, now_ns)
        return msgspec.structs.replace(after, ended=ended(signs, sign.reading))

    return place


def _road(road_type: str) -> Callable[[Signs, SignAhead, int], Signs]:
    """Another kind of road, on which limits go on: such signs lift none in most countries."""

    def road(signs: Signs, sign: SignAhead, now_ns: int) -> Signs:
        return changed(signs, now_ns, road_type=_believed(road_type, sign, now_ns))

    return road


def _national(signs: Signs, sign: SignAhead, now_ns: int) -> Signs:
    after = _end("permanent", "zone", "conditional")(signs, sign, now_ns)
    return _road("rural")(after, sign, now_ns) if signs.road in ("", "urban") else after


def _border(signs: Signs, sign: SignAhead, now_ns: int) -> Signs:
    country, here = sign.reading.partition(":")[2], signs.jurisdiction
    if is_unknown_country(country):
        return without_country(signs, now_ns)
    if country not in COUNTRIES:
        return signs
    told: dict[str, object] = {
        "jurisdiction": _believed(country, sign, now_ns, sign.reading), "crossed": True, "ended": (sign.reading,),
    }  # fmt: skip
    if here is None or here.value != country:
        abroad = in_another_country(signs, now_ns)
        return msgspec.structs.replace(abroad, former_jurisdiction=signs.country or "", **told)
    if not here.assumed and now_ns - here.since_ns < SAME_BORDER_NS:
        return signs  # its other camera's track, or the sign on the other side of the road
    # The ego was taken to be here before it was: its units go on to hold, and no limit of the country left behind does.
    return msgspec.structs.replace(_clear(signs, now_ns), former_jurisdiction="", **told)


ENDS: dict[str, Callable[[Signs, SignAhead, int], Signs]] = {
    "limit_end": _end("permanent", "conditional", "gantry"),
    "all_end": _end("permanent", "conditional", "gantry"),
    "zone_end": _zone_end,
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
