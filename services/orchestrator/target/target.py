"""The target speed: the legal limit first, and everything else can only lower it.

Each bound says how fast one may go and why; the target is the least of them. What is unknown takes a careful default,
what was believed holds until something better is known.
"""

import math
from typing import NamedTuple

from domain.units import to_mps
from proto.rules import Citation, LegalLimit, RulesAnswer
from services.orchestrator.law import rules_question
from services.orchestrator.law.limits_ahead import limits_ahead, surely
from services.orchestrator.signs.limits import in_force, may_be_ours
from services.orchestrator.state import Lost, SignAhead, State
from services.orchestrator.world.actors import Way, missed_as, vehicles
from services.orchestrator.world.car_faults import UNKNOWN_BRAKES
from services.orchestrator.world.conditions import UNKNOWN_FOLLOWING_FACTOR, UNKNOWN_SPEED_FACTOR
from services.orchestrator.world.giving_way import READY_MPS, Place, place
from services.orchestrator.world.stops import stops

KMH = 1.0 / 3.6
CAUTIOUS_MPS: dict[str, float] = {
    "living_street": 7 * KMH, "urban": 30 * KMH, "rural": 60 * KMH, "expressway": 60 * KMH, "dual_carriageway": 70 * KMH,
    "motorway": 80 * KMH,
}  # fmt: skip
"""Where no law and no sign is known: below every ordinary limit of such a road."""
CAUTIOUS_UNKNOWN_MPS = 30 * KMH
PLAUSIBLE_KMH: dict[str, tuple[float, float]] = {
    "living_street": (5, 30), "urban": (10, 70), "rural": (30, 120), "expressway": (40, 130), "dual_carriageway": (40, 130),
    "motorway": (40, 140),
}  # fmt: skip
"""Limits that a road can have; a doubted reading outside them lowers nothing."""
DOUBT_RATE_MPS2 = 0.7
"""How fast a doubted restriction lowers the target: lifting the foot, no braking."""
APPROACH_MPS2 = 1.2
"""Coasting down to a lower limit ahead."""
MAYBE_THERE_NS = 3_000_000_000
"""Out of sight for so long, with our speed unknown, a sign may have been reached."""
H_SLOPE = 0.4
"""How much a wholly degraded car (h = 1) takes off the target beyond what CAN itself asks for."""
LEAST_BRAKES, MOST_HEADWAY = 0.1, 3.0
LOST_LIGHT_MPS = 20 * KMH
"""Over a junction whose light is not in view."""
LEAST_FACTOR = 0.2
HEADWAY_S = 1.2
GAP_TIME_S = 4.0
"""In which a gap that is too small is to be opened again, and one that is wider may be closed."""
STANDSTILL_M = 2.0
VANISHED_NS = 3_000_000_000
"""For how long an actor bounds the target that vanished from its way."""
MOST_LOST = 24
ANSWER_SERVES_NS = 2_000_000_000
"""For how long an answer counts as today's while a detail of the question (wetness, sight) has just changed."""
UNANSWERED = 0.6
"""Factor on the confidence of a limit that rests on an older answer, or on the sign alone."""


class Bound(NamedTuple):
    """One upper bound of the target."""

    mps: float
    why: str
    source: str
    confidence: float = 1.0
    factor: float = 1.0
    """With which weather, vehicle and experts had scaled it."""
    track_id: int = 0
    """The actor that was seen well enough to be missed; 0: none."""


class Law(NamedTuple):
    """The legal limit as it stands, and how well it stands."""

    limit: LegalLimit | None
    mps: float | None
    """None: the law sets none here."""
    confidence: float
    basis: str
    """`rules`, `held`, `sign`, `unknown`"""
    citations: tuple[Citation, ...] = ()
    answer: RulesAnswer | None = None


class Target(NamedTuple):
    """The target with all that bounds it, the tightest first."""

    mps: float
    law: Law
    factor: float
    headway_factor: float
    bounds: tuple[Bound, ...]
    place: Place | None = None
    """The place to give way at that is among them."""


def target(state: State) -> Target:
    """All bounds, and the least."""
    law = law_of(state)
    weather, vehicle, expert = factors(state)
    factor = max(LEAST_FACTOR, weather * vehicle * expert)
    found = [Bound(_or_max(law.mps) * factor, "law", law.basis, law.confidence, factor)]
    found += [b._replace(mps=b.mps * factor, factor=factor) for b in _ahead(state, law)]
    found += _doubts(state, law, factor)
    found += [Bound(s.approach_mps(), s.why, "perception", s.confidence, track_id=s.track_id) for s in stops(state)]
    found += _lost_light(state)
    here = _near_place(state, law)
    found += [Bound(READY_MPS, here.why, "map", here.confidence)] if here is not None else []
    headway = headway_factor(state)
    found += _following(vehicles(state.world), headway)
    found += _blind(state)
    found += _vanished(state)
    found += _sight(state)
    found += [
        Bound(each.target_mps, "expert", each.tool, each.confidence)
        for each in state.held.limiters
        if each.target_mps is not None
    ]
    ordered = tuple(sorted(found, key=lambda b: (b.mps, b.why != "law", b.why)))
    return Target(ordered[0].mps, law, factor, headway, ordered, here)


# -- the law -----------------------------------------------------------------------------------------------------------


def law_of(state: State) -> Law:
    """The answer to today's question; else the last answer, if no sign says less; else the sign; else caution.

    An answer that was given for another road or country holds only where it is below caution.
    """
    answer = state.held.legal
    asked = rules_question.key(rules_question.situation_arguments(state))
    if answer is not None and state.held.legal_key == asked and answer.legal_action != "unknown":
        mps = answer.limit.mps if answer.limit is not None else None
        return Law(answer.limit, mps, answer.confidence, "rules", answer.citations, answer)
    sign = posted_limit(state)
    known = answer.limit if answer is not None and answer.legal_action != "unknown" else None
    if known is not None and answer is not None and (sign is None or known.mps <= sign[0].mps):
        if known.mps > cautious_mps(state) and elsewhere(state, known):
            return Law(None, cautious_mps(state), 0.3, "unknown")
        if state.now_ns - state.held.legal_ns < ANSWER_SERVES_NS:
            return Law(known, known.mps, answer.confidence, "rules", answer.citations, answer)
        return Law(known, known.mps, UNANSWERED * answer.confidence, "held", answer.citations, answer)
    if sign is not None:
        return Law(sign[0], sign[0].mps, UNANSWERED * sign[1], "sign")
    return Law(None, cautious_mps(state), 0.3, "unknown")


def elsewhere(state: State, known: LegalLimit) -> bool:
    """Whether the last answer was given for another road type or country: believed since, or no such road has its limit."""
    places, lost_ns = (state.signs.jurisdiction, state.signs.road_type), state.signs.unknown_ns
    if any(place is not None and place.since_ns > state.held.legal_ns for place in places):
        return True
    if lost_ns is not None and lost_ns > state.held.legal_ns:
        return True
    # The map's word on the road has no beginning that is remembered.
    road = state.world.environment.road_type
    return road is not None and known.mps > PLAUSIBLE_KMH.get(road.value, (30.0, 140.0))[1] * KMH + 0.1


def posted_limit(state: State) -> tuple[LegalLimit, float] | None:
    """The lowest limit on signs in force, and its confidence; conditions that may hold are taken to hold."""
    dry = surely(state, wet=False)
    shown = []
    for each in in_force(state.signs):
        posted = each.posted
        if not may_be_ours(posted.scope, posted.plates, dry=dry):
            continue
        shown.append((LegalLimit(value=posted.value, unit=posted.unit, mps=to_mps(posted.value, posted.unit)), posted))
    if not shown:
        return None
    limit, posted = min(shown, key=lambda pair: (pair[0].mps, pair[1].reading))
    return limit, posted.confidence


def cautious_mps(state: State) -> float:
    """A speed for a road whose law is unknown."""
    road = state.world.environment.road_type
    return CAUTIOUS_MPS.get(road.value, CAUTIOUS_UNKNOWN_MPS) if road is not None else CAUTIOUS_UNKNOWN_MPS


def _or_max(mps: float | None) -> float:
    # Where the law sets no limit and recommends none either, the highest speed any of our packs recommends.
    return 130 * KMH if mps is None else mps


# -- signs ahead and doubts ----------------------------------------------------------------------------------------------


def _ahead(state: State, law: Law) -> list[Bound]:
    """Lower limits that are believed but not yet passed: come down to them in time."""
    found = []
    for ahead in limits_ahead(state):
        room = _room_m(state, ahead.sign)
        mps = math.sqrt(ahead.mps * ahead.mps + 2.0 * APPROACH_MPS2 * room)
        found.append(Bound(mps, "ahead", "rules" if ahead.law is not None else "drivelm", ahead.confidence))
    return found


def _room_m(state: State, sign: SignAhead) -> float:
    """How far ahead a sign is. Where it is out of sight and the speed unknown, we may be at its post by now."""
    maybe_there = state.world.ego.speed_mps is None and state.now_ns - sign.seen_ns > MAYBE_THERE_NS
    return 0.0 if maybe_there or sign.distance_m is None else max(0.0, sign.distance_m)


def doubted_mps(state: State) -> float | None:
    """The lowest limit that a doubted sign may show, if it is plausible for this road."""
    road = state.world.environment.road_type
    low, high = PLAUSIBLE_KMH.get(road.value, (30.0, 140.0)) if road is not None else (30.0, 140.0)
    values = [
        to_mps(sign.value, sign.unit or "km/h")
        for sign in state.signs.ahead
        if sign.kind == "limit" and sign.value is not None and sign.scope != "end" and not sign.believed
    ]
    if state.held.doubted_mps is not None and state.now_ns < state.held.doubted_until_ns:
        values.append(state.held.doubted_mps)
    return min((mps for mps in values if low * KMH - 0.1 <= mps <= high * KMH + 0.1), default=None)


def _doubts(state: State, law: Law, factor: float) -> list[Bound]:
    """Down towards what a doubted sign may show, at a bounded rate from where the target stood."""
    doubted, before = doubted_mps(state), state.held.target_mps
    if doubted is None or doubted >= _or_max(law.mps):
        return []
    passed_s = 0.0
    if before is None or state.held.target_ns is None:
        before = _or_max(law.mps) * factor
    else:
        passed_s = min(1.0, max(0.0, (state.now_ns - state.held.target_ns) / 1e9))
    return [Bound(max(doubted * factor, before - DOUBT_RATE_MPS2 * passed_s), "doubt", "drivelm", 0.5, factor)]


# -- what scales ---------------------------------------------------------------------------------------------------------


def factors(state: State) -> tuple[float, float, float]:
    """Weather, vehicle, experts: each in (0, 1]."""
    conditions = state.held.conditions
    weather = UNKNOWN_SPEED_FACTOR if conditions is None else min(1.0, conditions.speed_factor)
    expert = min((each.speed_factor for each in state.held.limiters), default=1.0)
    return weather, vehicle_factor(state), expert


def vehicle_factor(state: State) -> float:
    """By h, and by what CAN asks for while its own degradation still says that something is wrong."""
    car = state.held.degradation
    if car is None or car.h is None:
        return UNKNOWN_SPEED_FACTOR
    own = 1.0 - H_SLOPE * car.h
    brakes = math.sqrt(braking_left(car.brake_envelope))  # the way to a stop goes with v^2 / a
    asked = state.held.health.speed_factor if state.held.health is not None and car.h > 0.1 else 1.0
    return max(LEAST_FACTOR, min(1.0, own, brakes, asked))


def braking_left(envelope: float | None) -> float:
    """The share of braking to reckon with; of brakes that no signal tells anything of, not all."""
    return UNKNOWN_BRAKES if envelope is None else max(LEAST_BRAKES, envelope)


def headway_factor(state: State) -> float:
    """How much the following distance is widened; 1 is ordinary."""
    conditions, car = state.held.conditions, state.held.degradation
    weather = UNKNOWN_FOLLOWING_FACTOR if conditions is None else max(1.0, conditions.following_factor)
    h = car.h if car is not None else None
    vehicle = UNKNOWN_FOLLOWING_FACTOR if h is None else 1.0 + h
    if car is not None and h is not None:
        vehicle = max(vehicle, min(MOST_HEADWAY, 1.0 / braking_left(car.brake_envelope)))
    if state.held.health is not None and h is not None and h > 0.1:
        vehicle = max(vehicle, state.held.health.headway_factor)
    return max(weather, vehicle, *(each.headway_factor for each in state.held.limiters), 1.0)


def _lost_light(state: State) -> list[Bound]:
    """A light that one stands too near to see may be red still: over the junction as over one whose light is out."""
    light = state.light
    return [Bound(LOST_LIGHT_MPS, "light_lost", "drivelm", 0.3)] if light is not None and light.lost_at_line else []


def _near_place(state: State, law: Law) -> Place | None:
    """Where to be slow enough to let others go first, from where one who drives as fast as is allowed has to begin."""
    here = place(state)
    return here if here is not None and here.room_m <= here.begins_m(_or_max(law.mps)) else None


def _blind(state: State) -> list[Bound]:
    """Who can no longer be seen or measured bounds the target as when last seen: blindness is no free road."""
    held, world = state.held, state.world
    unseen = world.actors is None
    unmeasured = world.ego.speed_mps is None and vehicles(world) != ()
    found = []
    if held.lead_mps is not None and (unseen or unmeasured):
        found.append(Bound(held.lead_mps, "lead", "perception", 0.3))
    if held.person_mps is not None and unseen:
        found.append(Bound(held.person_mps, "person", "perception", 0.3))
    return found


def _vanished(state: State) -> list[Bound]:
    """Who was in the way a moment ago and is nowhere now did not dissolve: it bounds as when last seen, for a while."""
    if state.world.actors is None:
        return []
    return [Bound(lost.mps, lost.why, "perception", 0.3) for lost in _gone(state)]


def _gone(state: State) -> list[Lost]:
    """Those of the last moments who are not seen now; of a tick that sees nobody and nothing, all of them."""
    seen = {track.track_id for track in state.world.actors.value} if state.world.actors is not None else set()
    recent = (lost for lost in state.held.lost if state.now_ns - lost.stamp_ns <= VANISHED_NS)
    return [lost for lost in recent if lost.track_id not in seen]


def still_lost(state: State, goal: Target) -> tuple[Lost, ...]:
    """How the actors of this tick bound the target, and those who vanished lately."""
    now: dict[int, Lost] = {}
    for b in goal.bounds:  # the tightest first: who bounds twice, as a cyclist does, is remembered by the lower
        now.setdefault(b.track_id, Lost(track_id=b.track_id, why=b.why, mps=b.mps, stamp_ns=state.now_ns))
    now.pop(0, None)
    gone = (lost for lost in _gone(state) if lost.track_id not in now)
    return (*gone, *now.values())[-MOST_LOST:]


def _sight(state: State) -> list[Bound]:
    """One stops within what one sees, whatever the limit is: the factor was worked out for one limit and has a floor."""
    conditions = state.held.conditions
    if conditions is None or conditions.safe_speed_mps is None:
        return []
    return [Bound(max(0.0, conditions.safe_speed_mps), "sight", "weather", conditions.confidence)]


def last_seen(goal: Target) -> tuple[float | None, float | None]:
    """How lead and person bound the target of this tick, to be held if they are lost from sight."""
    return (
        min((b.mps for b in goal.bounds if b.why == "lead"), default=None),
        min((b.mps for b in goal.bounds if b.why == "person"), default=None),
    )


def _following(ahead: tuple[Way, ...], headway: float) -> list[Bound]:
    """Of all who drive ahead: whom one meets first need not be whom one follows."""
    return [bound for way in ahead if (bound := _behind(way, headway)) is not None]


def _behind(way: Way, headway: float) -> Bound | None:
    """Open a gap that is too small, and close one that is wider no faster than in `GAP_TIME_S`: a bound that fades with the
    distance, and does not end from one tick to the next."""
    if way.speed_mps is None or way.track.oncoming:
        return None
    speed = max(0.0, way.speed_mps)
    wanted = STANDSTILL_M + HEADWAY_S * headway * speed
    # Doubted or not: an actor may always lower the target.
    mps = max(0.0, speed + (way.gap_m - wanted) / GAP_TIME_S)
    return Bound(mps, "lead", "perception", way.track.confidence, track_id=missed_as(way))
