"""Signs seen become limits in force: pure, from facts and the way travelled.

A limit comes into force when its sign is passed. A limit that was believed stays until positive evidence ends it: an end
sign, a new sign, a junction at which the ego turned, a border. What is doubted never enters here; see `fusion`.
"""

import math
from collections.abc import Callable
from typing import Literal, NamedTuple, cast

import msgspec

from proto.rules import PostedLimit
from proto.scene import Fact, Unit
from services.orchestrator.state import Believed, InForce, SignAhead, Signs

SURE = 0.6
"""From this confidence on a reading may end or raise a limit."""
TOLD = 0.3
"""From this confidence on a believed reading may lower one."""
URBAN_KMH = 50.0
"""The lowest limit that a country has without a sign: above it, a sign may raise what holds."""
DOUBTED = 0.5
"""What is left of the confidence in a reading once its track is read otherwise: less than `SURE`."""
LOST_S = 6.0
"""A sign not seen for so long, whose distance was never known, counts as passed where that is careful."""
FORGOTTEN_S = 30.0
TURN_RAD = math.radians(50.0)
JUNCTION_NEAR_M = 15.0
JUNCTION_BEHIND_M = 25.0
"""A turn from near a junction to so far behind it is a turn at the junction."""
OTHER_JUNCTION_M = 20.0
"""A junction reported so much farther than the one that was near is another one."""
MOST_AHEAD = 12
HEADS = frozenset(
    {
        "limit", "limit_end", "all_end", "zone", "zone_end", "national", "led", "stop", "yield", "priority_road",
        "priority_road_end", "priority_here", "no_entry", "no_vehicles", "no_overtaking", "no_overtaking_end", "one_way",
        "keep_left", "keep_right", "ahead_only", "roundabout", "crossing", "children", "roadworks", "slippery", "danger",
        "calm_street", "town_entry", "town_exit", "motorway", "motorway_end", "border", "info",
    }
)  # fmt: skip
"""Codes, without what follows their colon."""
PLATES = frozenset(
    {
        "plate:when_wet:de", "plate:when_wet:en", "plate:when_wet:fr", "plate:when_wet:nl", "plate:when_wet:drawn",
        "plate:distance", "plate:time", "plate:lorries", "plate:end",
    }
)  # fmt: skip
GIVE_WAY = frozenset({"yield", "priority_road", "priority_here", "crossing", "no_entry"})
STATEMENTS: dict[str, frozenset[str] | None] = {
    "jurisdiction": None, "units": frozenset({"km/h", "mph"}), "traffic_side": frozenset({"left", "right"}),
    "road_type": frozenset({"urban", "rural", "motorway", "dual_carriageway", "living_street"}),
}  # fmt: skip
"""What may be stated; a jurisdiction is three capital letters."""
RESTRICTED_PLATES = ("plate:lorries", "plate:time", "plate:when_wet")
"""Plates under which a limit stands beside the others instead of replacing them."""


class Motion(NamedTuple):
    """What the ego did since the last tick."""

    travelled_m: float = 0.0
    turned_rad: float = 0.0
    junction_m: float | None = None
    lane_id: str = ""


def update(signs: Signs, facts: tuple[Fact, ...], motion: Motion, now_ns: int) -> Signs:
    """The signs after a tick; facts in the order in which they came."""
    signs = _move(signs, motion)
    for fact in facts:
        signs = _take(signs, fact, motion, now_ns)
    signs = _pass_reached(signs, now_ns)
    return _junction(signs, motion, now_ns)


# -- facts -----------------------------------------------------------------------------------------------------------


def _take(signs: Signs, fact: Fact, motion: Motion, now_ns: int) -> Signs:
    if not (math.isfinite(fact.confidence) and len(fact.reading) <= 64):
        return signs
    if fact.kind in _STATED:
        return _STATED[fact.kind](signs, fact, now_ns) if fact.believed else signs
    if fact.kind not in ("limit", "sign", "message") or not plausible_value(fact.value):
        return signs
    if not known_code(fact.reading) or not consistent(fact):
        return signs
    sign = _merge(signs, fact, motion)
    of_track = tuple(each for each in signs.ahead if each.track_id == fact.track_id)
    others = tuple(each for each in signs.ahead if each.track_id != fact.track_id)
    read = (*(_doubted(each, sign) for each in of_track if _outlives(each, sign)), sign)
    if not fact.passed:
        return msgspec.structs.replace(signs, ahead=_most_important((*others, *read)))
    signs = msgspec.structs.replace(signs, ahead=others)
    for each in read:
        signs = _apply(signs, each, now_ns)
    return signs


def known_code(reading: str) -> bool:
    """A sign code of the readers' table. Anything else is text from the world, and text does nothing."""
    head, _, tail = reading.partition(":")
    return head in HEADS and (tail == "" or (len(tail) <= 12 and tail.replace("_", "").isalnum() and tail.isascii()))


def consistent(fact: Fact) -> bool:
    """Whether number and code agree: a code with a number is that number, one without has none."""
    tail = fact.reading.partition(":")[2]
    return fact.value == (float(tail) if tail.isdigit() else None)


def plausible_value(value: float | None) -> bool:
    """A number that a sign can show: none, or one from 5 to 140."""
    return value is None or (math.isfinite(value) and 5.0 <= value <= 140.0)


def _merge(signs: Signs, fact: Fact, motion: Motion) -> SignAhead:
    known = next((each for each in signs.ahead if each.track_id == fact.track_id), None)
    distance = fact.distance_m if fact.distance_m is not None and math.isfinite(fact.distance_m) else None
    return SignAhead(
        track_id=fact.track_id,
        kind=fact.kind,
        reading=fact.reading,
        scope=fact.scope,
        value=fact.value,
        unit=fact.unit,
        confidence=min(1.0, max(0.0, fact.confidence)),
        believed=fact.believed,
        distance_m=distance if distance is not None or known is None else known.distance_m,
        seen_ns=fact.frame_stamp_ns,
        first_ns=known.first_ns if known is not None else fact.frame_stamp_ns,
        candidates=tuple(each for each in fact.candidates[:5] if known_code(each.reading)),
        plates=tuple(plate for plate in fact.plates[:4] if plate in PLATES),
        text=fact.text[:120],
        own_lane=not fact.lane_id or fact.lane_id == motion.lane_id or not fact.lane_id.startswith("offset:"),
    )


def _most_important(ahead: tuple[SignAhead, ...]) -> tuple[SignAhead, ...]:
    """As many as are remembered; the least important goes first, of equals the oldest."""
    by_importance = sorted(range(len(ahead)), key=lambda at: (*_importance(ahead[at]), at))
    return tuple(ahead[at] for at in sorted(by_importance[-MOST_AHEAD:]))


def _importance(sign: SignAhead) -> tuple[int, float]:
    """What lowers before what may, then what ends or gives way; the lower the limit, the more important."""
    if sign.reading == "stop":
        return 3, 0.0
    if shows_limit(sign) and sign.kind == "limit":
        counts = sign.believed and sign.own_lane and sign.confidence >= TOLD
        return 3 if counts else 2, -value_kmh(sign.value or 0.0, sign.unit)
    head = sign.reading.partition(":")[0]
    return int(head in _ENDS or sign.reading in _ENDS or head in GIVE_WAY), 0.0


def _outlives(known: SignAhead, sign: SignAhead) -> bool:
    """Whether what was believed of a track stands beside its new reading, which is a doubt."""
    if not known.believed or known.confidence < TOLD or (sign.believed and sign.confidence >= SURE):
        return False
    return not sign.believed or sign.confidence < TOLD or _shown(sign) != _shown(known)


def _doubted(known: SignAhead, sign: SignAhead) -> SignAhead:
    """What was believed and is in doubt: no longer sure, so that it lowers and ends or raises nothing."""
    near = min((each for each in (known.distance_m, sign.distance_m) if each is not None), default=None)
    confidence = min(known.confidence, DOUBTED)
    return msgspec.structs.replace(known, confidence=confidence, distance_m=near, seen_ns=sign.seen_ns)


def _shown(sign: SignAhead) -> tuple[object, ...]:
    return sign.reading, sign.scope, sign.unit, sign.plates, sign.own_lane


def _state(field: str) -> Callable[[Signs, Fact, int], Signs]:
    def state(signs: Signs, fact: Fact, now_ns: int) -> Signs:
        known: Believed | None = getattr(signs, field)
        if not _may_be_stated(field, fact.reading):
            return signs
        if fact.confidence < SURE:
            return signs
        if known is not None and known.value == fact.reading:
            seen_now = known.assumed and not fact.assumed
            return msgspec.structs.replace(signs, **{field: _seen(known, fact)}) if seen_now else signs
        believed = Believed(
            value=fact.reading, confidence=min(1.0, fact.confidence), since_ns=now_ns, assumed=fact.assumed
        )
        return msgspec.structs.replace(signs, **{field: believed})

    return state


def _seen(known: Believed, fact: Fact) -> Believed:
    return msgspec.structs.replace(known, confidence=min(1.0, fact.confidence), assumed=False)


def _may_be_stated(field: str, value: str) -> bool:
    allowed = STATEMENTS[field]
    if allowed is not None:
        return value in allowed
    return len(value) == 3 and value.isascii() and value.isalpha() and value.isupper()


def _jurisdiction(signs: Signs, fact: Fact, now_ns: int) -> Signs:
    after = _state("jurisdiction")(signs, fact, now_ns)
    before, now = signs.jurisdiction, after.jurisdiction
    if before is None or now is None or before.value == now.value:
        return after
    # Another country's signs, believed: the border is behind us even if its sign was missed.
    return msgspec.structs.replace(_clear(after, now_ns), former_jurisdiction=before.value)


_STATED: dict[str, Callable[[Signs, Fact, int], Signs]] = {
    "jurisdiction": _jurisdiction,
    "units": _state("units"),
    "traffic_side": _state("traffic_side"),
    "road_type": _state("road_type"),
}


# -- passing ---------------------------------------------------------------------------------------------------------


def _move(signs: Signs, motion: Motion) -> Signs:
    ahead = tuple(
        msgspec.structs.replace(each, distance_m=each.distance_m - motion.travelled_m)
        if each.distance_m is not None
        else each
        for each in signs.ahead
    )
    return msgspec.structs.replace(signs, ahead=ahead)


def _pass_reached(signs: Signs, now_ns: int) -> Signs:
    for sign in sorted(signs.ahead, key=lambda each: (each.first_ns, each.track_id)):
        unseen_s = (now_ns - sign.seen_ns) / 1e9
        # A range is a few metres off: what lowers counts at the post, what raises well behind it.
        reached = sign.distance_m is not None and sign.distance_m <= (0.0 if lowers(signs, sign) else -3.0)
        kept = _open(signs, sign)
        lost = sign.distance_m is None and unseen_s > LOST_S and not kept
        forgotten = unseen_s > FORGOTTEN_S and (sign.distance_m is None or not (kept or sign.reading == "stop"))
        if reached or lost or forgotten:
            left = tuple(each for each in signs.ahead if each is not sign)
            signs = msgspec.structs.replace(signs, ahead=left)
            # A sign whose passing was not seen may lower, not raise: it may have stood on another road.
            if reached or lowers(signs, sign):
                signs = _apply(signs, sign, now_ns)
    return signs


def lowers(signs: Signs, sign: SignAhead) -> bool:
    """Whether a sign shows a limit not above the lowest in force; where none is, not above what any road may have."""
    if sign.value is None or not shows_limit(sign):
        return False
    value = value_kmh(sign.value, sign.unit)
    least = min((value_kmh(each.posted.value, each.posted.unit) for each in in_force(signs)), default=URBAN_KMH)
    return value <= least


def _open(signs: Signs, sign: SignAhead) -> bool:
    """Whether it is open what a believed limit would do: it may lower what no sign set. Till its post it only bounds."""
    return sign.believed and shows_limit(sign) and not in_force(signs) and not lowers(signs, sign)


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


def _apply(signs: Signs, sign: SignAhead, now_ns: int) -> Signs:
    others = tuple(each for each in signs.recent if each.reading != sign.reading)
    signs = msgspec.structs.replace(signs, recent=(*others, sign)[-4:])
    if not sign.believed or not sign.own_lane or sign.confidence < TOLD:
        return signs
    if sign.confidence < SURE and not lowers(signs, sign):
        return signs
    if shows_limit(sign):
        return _set(signs, sign, now_ns)
    head = sign.reading.partition(":")[0]
    if sign.scope == "end" and sign.value is not None:
        head = "limit_end"
    ends = _ENDS.get(sign.reading) or _ENDS.get(head)
    return ends(signs, sign, now_ns) if ends is not None else signs


def _set(signs: Signs, sign: SignAhead, now_ns: int) -> Signs:
    units = cast(Unit, signs.units.value) if signs.units and signs.units.value in ("km/h", "mph") else "km/h"
    posted = PostedLimit(
        value=sign.value or 0.0,
        unit=sign.unit or units,
        scope=cast(Literal["permanent"], sign.scope),
        confidence=sign.confidence,
        plates=sign.plates,
        reading=sign.reading,
    )
    limit = InForce(posted=posted, since_ns=now_ns, track_id=sign.track_id)
    beside = sign.scope == "when_wet" or any(plate.startswith(RESTRICTED_PLATES) for plate in sign.plates)
    if beside:
        others = tuple(each for each in signs.conditional if _differs(each, posted))
        return _changed(signs, now_ns, conditional=(*others, limit)[-3:])
    if "plate:distance" in sign.plates and not lowers(signs, sign):
        return signs
    slot = {"gantry": "gantry", "zone": "zone"}.get(sign.scope, "permanent")
    known: InForce | None = getattr(signs, slot)
    if known is not None and not _differs(known, posted):
        return signs
    also = {"permanent": None} if slot == "zone" else {}
    when = {"gantry_changed_ns": now_ns} if slot == "gantry" else {}
    return _changed(signs, now_ns, ended=(), **{slot: limit}, **also, **when)


def _differs(known: InForce, posted: PostedLimit) -> bool:
    old = known.posted
    return (old.value, old.unit, old.scope, old.plates) != (posted.value, posted.unit, posted.scope, posted.plates)


# -- ends ------------------------------------------------------------------------------------------------------------


def _changed(signs: Signs, now_ns: int, **fields: object) -> Signs:
    return msgspec.structs.replace(signs, changed_ns=now_ns, **fields)


def _clear(signs: Signs, now_ns: int) -> Signs:
    return _changed(signs, now_ns, permanent=None, gantry=None, zone=None, conditional=())


def _end(*slots: str) -> Callable[[Signs, SignAhead, int], Signs]:
    def end(signs: Signs, sign: SignAhead, now_ns: int) -> Signs:
        fields: dict[str, object] = {slot: () if slot == "conditional" else None for slot in slots}
        if not any(getattr(signs, slot) for slot in slots):
            return signs
        when = {"gantry_changed_ns": now_ns} if signs.gantry is not None and "gantry" in slots else {}
        ended = (*signs.ended, sign.reading)[-4:]
        return _changed(signs, now_ns, ended=ended, **fields, **when)

    return end


def _place(road_type: str) -> Callable[[Signs, SignAhead, int], Signs]:
    def place(signs: Signs, sign: SignAhead, now_ns: int) -> Signs:
        believed = Believed(value=road_type, confidence=sign.confidence, since_ns=now_ns)
        ended = (*signs.ended, sign.reading)[-4:]
        return msgspec.structs.replace(_clear(signs, now_ns), road_type=believed, ended=ended)

    return place


def _national(signs: Signs, sign: SignAhead, now_ns: int) -> Signs:
    after = _end("permanent", "zone", "conditional")(signs, sign, now_ns)
    if signs.road_type is None or signs.road_type.value == "urban":
        rural = Believed(value="rural", confidence=sign.confidence, since_ns=now_ns)
        after = _changed(after, now_ns, road_type=rural)
    return after


def _border(signs: Signs, sign: SignAhead, now_ns: int) -> Signs:
    country = sign.reading.partition(":")[2]
    if not (len(country) == 3 and country.isalpha() and country.isupper()):
        return signs
    before = signs.jurisdiction.value if signs.jurisdiction is not None else ""
    if before == country:
        return signs
    believed = Believed(value=country, confidence=sign.confidence, since_ns=now_ns)
    return msgspec.structs.replace(
        _clear(signs, now_ns), jurisdiction=believed, former_jurisdiction=before, ended=(sign.reading,)
    )


_ENDS: dict[str, Callable[[Signs, SignAhead, int], Signs]] = {
    "limit_end": _end("permanent", "conditional", "gantry"),
    "all_end": _end("permanent", "conditional", "gantry"),
    "zone_end": _end("zone"),
    "led:end": _end("gantry"),
    "led:blank": _end("gantry"),
    "national": _national,
    "town_entry": _place("urban"),
    "town_exit": _place("rural"),
    "motorway": _place("motorway"),
    "motorway_end": _place("rural"),
    "calm_street": _place("living_street"),
    "border": _border,
}


def _junction(signs: Signs, motion: Motion, now_ns: int) -> Signs:
    signs = _near_junction(signs, motion)
    if not signs.near_junction:
        return signs
    # A car that stands does not turn, whatever its yaw rate drifts to.
    turned = signs.turned_rad + (motion.turned_rad if motion.travelled_m > 0.0 else 0.0)
    if abs(turned) < TURN_RAD:
        return msgspec.structs.replace(signs, turned_rad=turned)
    cleared = _changed(signs, now_ns, permanent=None, conditional=(), ended=(*signs.ended, "junction")[-4:])
    return msgspec.structs.replace(cleared, near_junction=False, turned_rad=0.0, junction_m=0.0)


def _near_junction(signs: Signs, motion: Motion) -> Signs:
    """The junction that is near, by the way travelled since it came near: what the map says of it may stand still."""
    known = signs.junction_m - motion.travelled_m
    reported = motion.junction_m if motion.junction_m is not None else math.inf
    near = -JUNCTION_BEHIND_M <= reported <= JUNCTION_NEAR_M
    still = signs.near_junction and known >= -JUNCTION_BEHIND_M
    if near and (not still or reported >= known + OTHER_JUNCTION_M):
        return msgspec.structs.replace(signs, near_junction=True, junction_m=reported, turned_rad=0.0)
    if still:
        return msgspec.structs.replace(signs, junction_m=min(known, reported) if near else known)
    return msgspec.structs.replace(signs, near_junction=False, junction_m=0.0, turned_rad=0.0)
