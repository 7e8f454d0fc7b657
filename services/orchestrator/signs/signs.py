"""Signs seen become limits in force: pure, from facts and the way travelled.

A limit comes into force when its sign is passed; see `limits` for what it does there. What is doubted never comes into
force; see `target` for what it does.
"""

import math
import re
from collections.abc import Callable

import msgspec

from proto.scene import COUNTRIES, Fact
from services.orchestrator.observations.validity import Motion, distance_ahead
from services.orchestrator.signs.border_evidence import kept
from services.orchestrator.signs.duplicate_tracks import as_passed, with_its_plates, without_earlier_tracks
from services.orchestrator.signs.limits import (
    ENDS,
    ROAD_TYPES,
    SURE,
    TOLD,
    apply,
    enters_a_slower_town,
    home_given_up,
    in_another_country,
    in_force,
    is_unknown_country,
    lowers,
    read_anew,
    shows_limit,
    without_country,
)
from services.orchestrator.signs.turning_off import turned_off
from services.orchestrator.state import Believed, SignAhead, Signs

DOUBTED = 0.5
"""What is left of the confidence in a reading once its track is read otherwise: less than `SURE`."""
LOST_S = 6.0
"""A sign not seen for so long, while pictures were read, whose distance was never known, counts as passed where that is careful."""
FORGOTTEN_S = 30.0
MOST_AHEAD = 12
HEADS = frozenset(
    {
        "limit", "limit_end", "all_end", "zone", "zone_end", "national", "led", "stop", "yield", "priority_road",
        "priority_road_end", "priority_here", "no_entry", "no_vehicles", "no_overtaking", "no_overtaking_end", "one_way",
        "keep_left", "keep_right", "ahead_only", "roundabout", "crossing", "children", "roadworks", "slippery", "danger",
        "calm_street", "town_entry", "town_exit", "motorway", "motorway_end", "border", "info", "school", "school_end",
        "expressway", "expressway_end",
    }
)  # fmt: skip
"""Codes, without what follows their colon."""
PLATES = frozenset(
    {
        "plate:when_wet:de", "plate:when_wet:en", "plate:when_wet:fr", "plate:when_wet:nl", "plate:when_wet:pl",
        "plate:when_wet:drawn", "plate:distance", "plate:length", "plate:time", "plate:lorries", "plate:end",
        "plate:school", "plate:arrow_left", "plate:arrow_right", "plate:arrow_ahead",
    }
)  # fmt: skip
_WITH_NUMBERS = ("plate:time", "plate:distance", "plate:length")
_HOUR = r"(?:1?[0-9]|2[0-4])"
_NUMBERED = re.compile(
    rf"plate:time:{_HOUR}-{_HOUR} h|plate:(?:distance|length):(?:[1-9][0-9]{{0,3}}|[1-9]\.[0-9]|[13]/[24]) (?:m|km|yds|miles|ft)"
)
"""Plates with what is written on them: hours of the day, ways."""
_ENDS_OR_GIVES_WAY = frozenset({*ENDS, "yield", "priority_road", "priority_here", "crossing", "no_entry"})
STATEMENTS: dict[str, frozenset[str]] = {
    "jurisdiction": COUNTRIES, "units": frozenset({"km/h", "mph"}), "traffic_side": frozenset({"left", "right"}),
    "road_type": ROAD_TYPES,
}  # fmt: skip


def update(signs: Signs, facts: tuple[Fact, ...], motion: Motion, now_ns: int) -> Signs:
    """The signs after a tick; facts in the order in which they came."""
    signs = _move(signs, motion)
    for fact in facts:
        signs = _take(signs, fact, motion, now_ns)
    signs = _pass_reached(signs, motion, now_ns)
    return turned_off(signs, motion, now_ns)


# -- facts -----------------------------------------------------------------------------------------------------------


def _take(signs: Signs, fact: Fact, motion: Motion, now_ns: int) -> Signs:
    if not math.isfinite(fact.confidence):
        return signs
    if fact.kind in _STATED:
        return (_STATED[fact.kind] if fact.believed else _in_doubt)(signs, fact, now_ns)
    if fact.kind not in ("limit", "sign", "message") or not (known_code(fact.reading) and consistent(fact)):
        return signs
    of_track = tuple(each for each in signs.ahead if each.track_id == fact.track_id)
    others = tuple(each for each in signs.ahead if each.track_id != fact.track_id)
    known = next(iter(of_track), None)
    sign = with_its_plates(_merge(known, fact, motion, now_ns), known, others)
    others = tuple(with_its_plates(each, None, (sign,)) for each in others)
    read = (*(_doubted(each, sign) for each in of_track if _outlives(each, sign)), sign)
    if not fact.passed:
        return msgspec.structs.replace(signs, ahead=_most_important((*others, *read)))
    signs = msgspec.structs.replace(signs, ahead=without_earlier_tracks(sign, others))
    for each in read:
        signs = _passed(signs, each, now_ns)
    return signs


def known_code(reading: str) -> bool:
    """A sign code of the readers' table. Anything else is text from the world, and text does nothing."""
    head, _, tail = reading.partition(":")
    return head in HEADS and (tail == "" or (len(tail) <= 12 and tail.replace("_", "").isalnum() and tail.isascii()))


def known_plate(plate: str) -> str:
    """A plate's code of the readers' table, without a number that is not of a form of theirs; empty: no such plate."""
    if plate in PLATES or (len(plate) <= 32 and _NUMBERED.fullmatch(plate)):
        return plate
    return next((each for each in _WITH_NUMBERS if plate.startswith(f"{each}:")), "")


def consistent(fact: Fact) -> bool:
    """Whether the number is one that a sign can show and agrees with the code, which has none or this one."""
    tail = fact.reading.partition(":")[2]
    number = float(tail) if tail.isascii() and tail.isdigit() else None
    return fact.value == number and plausible_value(number)


def plausible_value(value: float | None) -> bool:
    """A number that a sign can show: none, or one from 5 to 140."""
    return value is None or 5.0 <= value <= 140.0


def _merge(known: SignAhead | None, fact: Fact, motion: Motion, now_ns: int) -> SignAhead:
    seen_ns = min(fact.frame_stamp_ns, now_ns)  # no frame is of a time that is yet to come
    # A passing is told with the last picture that showed the sign: where it passed is reckoned, not seen.
    reckoned = known is not None and seen_ns <= known.seen_ns
    distance_m, seen_m, missed_ns = (
        (known.distance_m, known.seen_m, known.missed_ns) if known is not None else (None, None, 0)
    )
    if (at_m := distance_ahead(fact.distance_m)) is not None:
        distance_m, seen_m = at_m, seen_m if reckoned else at_m
    return SignAhead(
        track_id=fact.track_id,
        kind=fact.kind,
        reading=fact.reading,
        scope=fact.scope,
        value=fact.value,
        unit=fact.unit,
        confidence=min(1.0, max(0.0, fact.confidence)),
        believed=fact.believed,
        distance_m=distance_m,
        seen_m=seen_m,
        seen_ns=seen_ns,
        missed_ns=missed_ns if reckoned else 0,
        first_ns=known.first_ns if known is not None else seen_ns,
        candidates=tuple(each for each in fact.candidates[:5] if known_code(each.reading)),
        plates=tuple(filter(None, map(known_plate, fact.plates[:4]))),
        text=fact.text[:120],
        own_lane=fact.lane_id == motion.lane_id or not fact.lane_id.startswith("offset:"),
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
        return 3 if sign.ours and sign.confidence >= TOLD else 2, -sign.kmh
    return int(not {sign.head, sign.reading}.isdisjoint(_ENDS_OR_GIVES_WAY)), 0.0


def _outlives(known: SignAhead, sign: SignAhead) -> bool:
    """Whether what was believed of a track stands beside its new reading, which is a doubt."""
    if not known.believed or known.confidence < TOLD or (sign.believed and sign.confidence >= SURE):
        return False
    return not sign.believed or sign.confidence < TOLD or _shown(sign) != _shown(known)


def _doubted(known: SignAhead, sign: SignAhead) -> SignAhead:
    """What was believed and is in doubt: no longer sure, so that it lowers and ends or raises nothing."""
    near = min((each for each in (known.distance_m, sign.distance_m) if each is not None), default=None)
    confidence = min(known.confidence, DOUBTED)
    return msgspec.structs.replace(known, confidence=confidence, distance_m=near, seen_ns=sign.seen_ns, missed_ns=0)


def _shown(sign: SignAhead) -> tuple[object, ...]:
    return sign.reading, sign.scope, sign.unit, sign.plates, sign.own_lane


def _state(field: str) -> Callable[[Signs, Fact, int], Signs]:
    def state(signs: Signs, fact: Fact, now_ns: int) -> Signs:
        if fact.reading not in STATEMENTS[field] or fact.confidence < SURE:
            return signs
        known: Believed | None = getattr(signs, field)
        since_ns = now_ns
        if known is not None and known.value == fact.reading:
            if fact.assumed or not known.assumed:
                return signs
            since_ns = known.since_ns  # assumed by a setting so far, and seen now
        confidence, evidence = min(1.0, fact.confidence), kept(fact.text)
        believed = Believed(
            value=fact.reading, confidence=confidence, since_ns=since_ns, assumed=fact.assumed, evidence=evidence
        )
        return msgspec.structs.replace(signs, **{field: believed})

    return state


def _jurisdiction(signs: Signs, fact: Fact, now_ns: int) -> Signs:
    if fact.confidence >= SURE and is_unknown_country(fact.reading):
        return without_country(signs, now_ns)
    after = _state("jurisdiction")(signs, fact, now_ns)
    if signs.country in (None, after.country):
        return after
    # Another country's signs, believed: the border is behind the ego even if its sign was missed.
    abroad = read_anew(signs, in_another_country(after, now_ns), now_ns)
    return msgspec.structs.replace(abroad, former_jurisdiction=signs.country, crossed=True)


def _in_doubt(signs: Signs, fact: Fact, now_ns: int) -> Signs:
    """A doubt of the country ends one that was only assumed; what was told stands until another is."""
    here = signs.jurisdiction
    other = fact.kind == "jurisdiction" and here is not None and here.assumed and fact.reading != here.value
    return home_given_up(signs, now_ns) if other else signs


_STATED: dict[str, Callable[[Signs, Fact, int], Signs]] = {
    "jurisdiction": _jurisdiction,
    "units": _state("units"),
    "traffic_side": _state("traffic_side"),
    "road_type": _state("road_type"),
}


# -- passing ---------------------------------------------------------------------------------------------------------


def _move(signs: Signs, motion: Motion) -> Signs:
    return msgspec.structs.replace(signs, ahead=tuple(_moved(each, motion) for each in signs.ahead))


def _moved(sign: SignAhead, motion: Motion) -> SignAhead:
    at_m = None if sign.distance_m is None else sign.distance_m - motion.travelled_m
    return msgspec.structs.replace(sign, distance_m=at_m, missed_ns=sign.missed_ns + motion.read_ns)


def _pass_reached(signs: Signs, motion: Motion, now_ns: int) -> Signs:
    for sign in sorted(signs.ahead, key=lambda each: (each.first_ns, each.track_id)):
        # A range is a few metres off: what lowers counts at the post, what raises well behind it.
        careful = lowers(signs, sign)
        reached = sign.distance_m is not None and sign.distance_m <= (0.0 if careful else -3.0)
        if not reached and not _is_lost(signs, sign):
            continue
        left = without_earlier_tracks(sign, tuple(each for each in signs.ahead if each is not sign))
        signs = msgspec.structs.replace(signs, ahead=left)
        # A sign whose passing was not seen may lower, not raise: it may have stood on another road.
        if reached or careful or (not motion.known and enters_a_slower_town(signs, sign)):
            signs = _passed(signs, sign, now_ns)
    return signs


def _passed(signs: Signs, sign: SignAhead, now_ns: int) -> Signs:
    return apply(signs, as_passed(sign, signs.conditional, now_ns), now_ns)


def _is_lost(signs: Signs, sign: SignAhead) -> bool:
    """Whether a sign that is not in the pictures is given up: sooner at an unknown distance, later where a limit may still lower."""
    unseen_s = sign.missed_ns / 1e9
    # A believed limit may lower what no sign set; till its post it only bounds.
    undecided = sign.believed and shows_limit(sign) and not in_force(signs) and not lowers(signs, sign)
    if sign.distance_m is None:
        return unseen_s > (FORGOTTEN_S if undecided else LOST_S)
    return unseen_s > FORGOTTEN_S and not undecided and sign.reading != "stop"
