"""The target speed: the legal limit first, and everything else can only lower it.

Each bound says how fast one may go and why; the target is the least of them. What is unknown takes a careful default, and what
was believed holds until something better is known.
"""

import math
from collections.abc import Iterator
from typing import NamedTuple

import msgspec

from domain.law import assuming
from domain.units import legal_limit, to_mps
from proto.observed import value_of
from proto.perception import Track
from proto.rules import Citation, LegalLimit, PostedLimit, RulesAnswer
from proto.vehicle import VehicleHealth
from services.orchestrator.law import rules_question
from services.orchestrator.law.limits_ahead import limits_ahead, surely
from services.orchestrator.observations.local_time import is_over
from services.orchestrator.signs.limits import doubts_unit, in_force, may_be_ours
from services.orchestrator.state import Lost, SignAhead, State
from services.orchestrator.target.lost import Asks, holds_back, settled, unseen
from services.orchestrator.world.actors import KNOWN_CONFIDENCE, Way, known, tracks, vehicles
from services.orchestrator.world.car_faults import UNKNOWN_BRAKES
from services.orchestrator.world.conditions import UNKNOWN_FOLLOWING_FACTOR, UNKNOWN_SPEED_FACTOR
from services.orchestrator.world.giving_way import READY_MPS, Place, place
from services.orchestrator.world.stops import COMFORT_MPS2, Stop, lines, people_ahead

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
PLAUSIBLE_UNKNOWN_KMH = (30.0, 140.0)
UNLIMITED_MPS = 130 * KMH
"""Where the law sets no limit: the highest speed that any pack recommends."""
DOUBT_RATE_MPS2 = 0.7
"""How fast a doubted restriction lowers the target: lifting the foot, no braking."""
APPROACH_MPS2 = 1.2
"""Coasting down to a lower limit ahead."""
MAYBE_THERE_NS = 3_000_000_000
"""Out of sight for so long, at an unknown speed, a sign may have been reached."""
H_SLOPE = 0.4
"""How much a wholly degraded car (h = 1) takes off the target beyond what CAN itself asks for."""
LEAST_BRAKES, MOST_HEADWAY = 0.1, 3.0
LOST_LIGHT_MPS = 20 * KMH
"""Over a junction whose light is not in view."""
LEAST_FACTOR = 0.2
SAME_PLACE_M = 5.0
"""By so much a place may seem farther than in the last tick."""
HEADWAY_S = 1.2
GAP_TIME_S = 4.0
"""In which a gap that is too small is to be opened again, and one that is wider may be closed."""
STANDSTILL_M = 2.0
ANSWER_SERVES_NS = 2_000_000_000
"""For how long an answer counts as today's after a detail of the question (wetness, sight) has changed."""
UNANSWERED = 0.6
"""Factor on the confidence of a limit that rests on an older answer, or on the sign alone."""


OF_THE_ROAD = ("law", "sight")
"""Why a bound of the road itself bounds."""


class Bound(NamedTuple):
    """One upper bound of the target."""

    mps: float
    why: str
    source: str
    confidence: float = 1.0
    factor: float = 1.0
    """By which weather, vehicle and experts had scaled it."""
    track_id: int | None = None
    """The actor that bounds now; None: something else, or an actor that bounded before."""
    known: bool = False
    """That actor is seen well, and was for long enough."""


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

    @property
    def assumed(self) -> bool:
        """Whether neither a sign, a map nor a place tells it: it is not spoken as law, and bounds no speed that is spoken."""
        return self.basis == "unknown" or (self.limit is not None and self.limit.assumed)

    @property
    def told(self) -> bool:
        """Whether it is known well enough to be spoken."""
        return self.limit is not None and not self.assumed and self.confidence >= rules_question.LAW_KNOWN

    @property
    def allowed_mps(self) -> float:
        """The speed that the law allows, or recommends."""
        return UNLIMITED_MPS if self.mps is None else self.mps


class Target(NamedTuple):
    """The target with all that bounds it, the tightest first."""

    mps: float
    law: Law
    factor: float
    headway_factor: float
    bounds: tuple[Bound, ...]
    place: Place | None = None
    """The place to give way at that is among them."""
    lost: tuple[Lost, ...] = ()
    """How each actor of this tick and of the last moments bounds the target."""

    @property
    def road_mps(self) -> float:
        """What road, weather and car ask for; a lead or a stop that asks for less is soon passed. Infinite where nothing is asked."""
        return min((bound.mps for bound in self.bounds if bound.why in OF_THE_ROAD), default=math.inf)

    @property
    def told_mps(self) -> float | None:
        """The target as far as it rests on what is known; None: an assumed law is all that bounds it."""
        return min((b.mps for b in self.bounds if not (self.law.assumed and b.why == "law")), default=None)


def target(state: State) -> Target:
    """All bounds, and the least."""
    law, headway = law_of(state), headway_factor(state)
    factor = max(LEAST_FACTOR, math.prod(factors(state)))
    here = _near_place(state, law)
    actors = (*(_stop(each) for each in people_ahead(state)), *_following(state, headway))
    asked = _asked(actors)
    seen = _seen(state)
    lost = settled(unseen(state.held.lost, _blind_ns(state)), asked, seen, state.now_ns)
    found = (
        Bound(law.allowed_mps * factor, "law", law.basis, law.confidence, factor),
        *_ahead(state, factor),
        *_doubts(state, law, factor),
        *(_line(state, each) for each in lines(state)),
        *actors,
        *_lost_light(state),
        *(Bound(READY_MPS, each.why, "map", each.confidence) for each in (here,) if each is not None),
        *_blind(state),
        *_held_back(state, asked, lost),
        *_sight(state),
        *_experts(state),
    )
    ordered = tuple(sorted(found, key=lambda b: (b.mps, b.why != "law", b.why)))
    return Target(ordered[0].mps, law, factor, headway, ordered, here, lost)


# -- the law -----------------------------------------------------------------------------------------------------------


def law_of(state: State) -> Law:
    """The answer to today's question; else the last or a doubted answer, if no sign says less; else the sign; else caution.

    An answer that was given for another road, country or hour holds only where it is below caution.
    """
    unknown, held = Law(None, cautious_mps(state), 0.3, "unknown"), state.held
    answer = held.legal if held.legal is not None and held.legal.legal_action != "unknown" else None
    todays = held.legal_key == rules_question.todays_key(state)
    if answer is not None and todays and answer.confidence >= rules_question.LAW_KNOWN:
        return _answered(state, answer, "rules")
    sign = posted_limit(state)
    limit = answer.limit if answer is not None else None
    if answer is None or limit is None or (sign is not None and to_mps(sign.value, sign.unit) < limit.mps):
        return _posted(sign) if sign is not None else unknown
    if limit.mps > cautious_mps(state):
        if _elsewhere(state, limit):
            return unknown
        if is_over(held.legal_h, state):
            return _posted(sign) if sign is not None and to_mps(sign.value, sign.unit) <= limit.mps else unknown
    if todays or state.now_ns - held.legal_ns < ANSWER_SERVES_NS:
        return _answered(state, answer, "rules")
    return _answered(state, answer, "held")._replace(confidence=UNANSWERED * answer.confidence)


def marked(state: State, answer: RulesAnswer) -> RulesAnswer:
    """With a limit that no sign sets marked as assumed where the country is the home setting alone and no map tells the place; what is
    assumed cites nothing."""
    here = state.signs.jurisdiction
    if not value_of(state.world.environment.segment_id) and (here is None or here.assumed):
        answer = assuming(answer, posted=bool(in_force(state.signs)))
    assumed = answer.limit is not None and answer.limit.assumed
    return msgspec.structs.replace(answer, citations=()) if assumed else answer


def _answered(state: State, answer: RulesAnswer, basis: str) -> Law:
    answer = marked(state, answer)
    limit = answer.limit
    if limit is not None and doubts_unit(state.signs):
        limit = msgspec.structs.replace(limit, assumed=True)
    return Law(limit, limit.mps if limit is not None else None, answer.confidence, basis, answer.citations, answer)


def _posted(sign: PostedLimit) -> Law:
    limit = legal_limit(sign.value, sign.unit)
    return Law(limit, limit.mps, UNANSWERED * sign.confidence, "sign")


def _elsewhere(state: State, known: LegalLimit) -> bool:
    """Whether the last answer was given for another road type or country: believed since, or no such road has its limit."""
    signs, (_, most_kmh) = state.signs, PLAUSIBLE_KMH.get(state.road, PLAUSIBLE_UNKNOWN_KMH)
    since = [place.since_ns for place in (signs.jurisdiction, signs.road_type) if place is not None]
    # The map's word on the road has no beginning that is remembered.
    implausible = state.road != "" and known.mps > most_kmh * KMH + 0.1
    return implausible or max(*since, signs.unknown_ns or 0, 0) > state.held.legal_ns


def posted_limit(state: State) -> PostedLimit | None:
    """The lowest limit on signs in force; conditions that may hold are taken to hold."""
    dry = surely(state, wet=False)
    posted = [each.posted for each in in_force(state.signs)]
    ours = (each for each in posted if may_be_ours(each.scope, each.plates, dry=dry))
    return min(ours, key=lambda each: (to_mps(each.value, each.unit), each.reading), default=None)


def cautious_mps(state: State) -> float:
    """A speed for a road whose law is unknown."""
    return CAUTIOUS_MPS.get(state.road, CAUTIOUS_UNKNOWN_MPS)


# -- signs ahead and doubts ----------------------------------------------------------------------------------------------


def _ahead(state: State, factor: float) -> Iterator[Bound]:
    """Lower limits that are believed but not yet passed: come down to them in time."""
    for ahead in limits_ahead(state):
        mps = math.sqrt(ahead.mps * ahead.mps + 2.0 * APPROACH_MPS2 * _room_m(state, ahead.sign))
        yield Bound(mps * factor, "ahead", "rules" if ahead.law is not None else "drivelm", ahead.confidence, factor)


def _room_m(state: State, sign: SignAhead) -> float:
    """How far ahead a sign is; 0 where it is out of sight and, at an unknown speed, the ego may be at its post by now."""
    maybe_there = state.speed_mps is None and state.now_ns - sign.seen_ns > MAYBE_THERE_NS
    return 0.0 if maybe_there else max(0.0, sign.distance_m or 0.0)


def _doubted_mps(state: State) -> float | None:
    """The lowest limit that a doubted sign may show, if it is plausible for this road."""
    low, high = _plausible_kmh(state)
    doubted = (sign for sign in state.signs.ahead if sign.doubted_limit and sign.scope != "end")
    values = [to_mps(sign.value, sign.unit or "km/h") for sign in doubted if sign.value is not None]
    if state.held.doubted_mps is not None and state.held.doubted_for_ns > 0:
        values.append(state.held.doubted_mps)
    return min((mps for mps in values if low * KMH - 0.1 <= mps <= high * KMH + 0.1), default=None)


def _plausible_kmh(state: State) -> tuple[float, float]:
    """The limits that a road of this type can have; of one whose type is known no more, also those that it could have before."""
    ranges = [PLAUSIBLE_KMH.get(road, PLAUSIBLE_UNKNOWN_KMH) for road in (state.road, state.road or state.held.road)]
    return min(low for low, _ in ranges), max(high for _, high in ranges)


def _doubts(state: State, law: Law, factor: float) -> Iterator[Bound]:
    """Down towards what a doubted sign may show, at a bounded rate from where the target stood."""
    doubted, held = _doubted_mps(state), state.held
    if doubted is None or doubted >= law.allowed_mps:
        return
    before, passed_s = law.allowed_mps * factor, 0.0
    if held.target_mps is not None and held.target_ns is not None:
        before, passed_s = held.target_mps, min(1.0, max(0.0, (state.now_ns - held.target_ns) / 1e9))
    yield Bound(max(doubted * factor, before - DOUBT_RATE_MPS2 * passed_s), "doubt", "drivelm", 0.5, factor)


# -- what scales ---------------------------------------------------------------------------------------------------------


def factors(state: State) -> tuple[float, float, float]:
    """Weather, vehicle, experts: each in (0, 1]."""
    conditions = state.held.conditions
    weather = UNKNOWN_SPEED_FACTOR if conditions is None else min(1.0, conditions.speed_factor)
    return weather, _vehicle_factor(state), min((each.speed_factor for each in state.held.limiters), default=1.0)


def _vehicle_factor(state: State) -> float:
    """By h, and by what CAN asks for."""
    car, asked = state.held.degradation, _asked_by_can(state)
    if car is None or car.h is None:
        return UNKNOWN_SPEED_FACTOR
    brakes = math.sqrt(_braking_left(car.brake_envelope))  # the way to a stop goes with v^2 / a
    return max(LEAST_FACTOR, min(1.0, 1.0 - H_SLOPE * car.h, brakes, asked.speed_factor if asked is not None else 1.0))


def _asked_by_can(state: State) -> VehicleHealth | None:
    """The tool's answer, while the car's own degradation still says that something is wrong."""
    car = state.held.degradation
    return state.held.health if car is not None and (car.h or 0.0) > 0.1 else None


def _braking_left(envelope: float | None) -> float:
    """The share of braking to reckon with; not all where no signal tells of the brakes."""
    return UNKNOWN_BRAKES if envelope is None else max(LEAST_BRAKES, envelope)


def headway_factor(state: State) -> float:
    """How much the following distance is widened; 1 is ordinary."""
    conditions, car, asked = state.held.conditions, state.held.degradation, _asked_by_can(state)
    weather = vehicle = UNKNOWN_FOLLOWING_FACTOR
    if conditions is not None:
        weather = conditions.following_factor
    if car is not None and car.h is not None:
        vehicle = max(1.0 + car.h, min(MOST_HEADWAY, 1.0 / _braking_left(car.brake_envelope)))
    can = asked.headway_factor if asked is not None else 1.0
    return max(1.0, weather, vehicle, can, *(each.headway_factor for each in state.held.limiters))


def _line(state: State, stop: Stop) -> Bound:
    """Of a line that is a guess down at the rate of comfortable braking: where it is first told nearby, nothing falls at once."""
    bound, held = _stop(stop), state.held
    if not stop.unmapped or held.target_mps is None or held.target_ns is None:
        return bound
    passed_s = min(1.0, max(0.0, (state.now_ns - held.target_ns) / 1e9))
    return bound._replace(mps=max(bound.mps, held.target_mps - COMFORT_MPS2 * passed_s))


def _stop(stop: Stop) -> Bound:
    bound = Bound(stop.approach_mps(), stop.why, "perception", stop.confidence)
    return bound if stop.track is None else _of(stop.track, bound)


def _of(track: Track, bound: Bound) -> Bound:
    return bound._replace(track_id=track.track_id, known=known(track))


# -- what else bounds ----------------------------------------------------------------------------------------------------


def _lost_light(state: State) -> Iterator[Bound]:
    """A light that is out of view at the line may be red still: over the junction as over one whose light is out."""
    if state.light is not None and state.light.lost_at_line:
        yield Bound(LOST_LIGHT_MPS, "light_lost", "drivelm", 0.3)


def _near_place(state: State, law: Law) -> Place | None:
    """Where to be slow enough to let others go first, from where a driver at the allowed speed has to begin.

    A law that is known no more, and lower for that, frees no target that a place bounds already.
    """
    here, held_m = place(state), state.held.place_m
    if here is None:
        return None
    begun = held_m is not None and here.room_m <= held_m + SAME_PLACE_M
    return here if begun or here.room_m <= here.begins_m(law.allowed_mps) else None


def _blind(state: State) -> Iterator[Bound]:
    """Actors that can no longer be seen or measured bound the target as when last seen: blindness is no free road."""
    held, unseen = state.held, state.world.actors is None
    unmeasured = state.speed_mps is None and vehicles(state.world) != ()
    if held.lead_mps is not None and (unseen or unmeasured):
        yield Bound(held.lead_mps, "lead", "perception", 0.3)
    if held.person_mps is not None and unseen:
        yield Bound(held.person_mps, "person", "perception", 0.3)


def _held_back(state: State, asked: dict[int, Asks], lost: tuple[Lost, ...]) -> Iterator[Bound]:
    """An actor that was in the way a moment ago did not dissolve: it bounds as it did, for a while."""
    if state.world.actors is not None:  # else `_blind` bounds
        yield from (Bound(each.mps, each.why, "perception", 0.3) for each in lost if holds_back(each, asked))


def _asked(actors: tuple[Bound, ...]) -> dict[int, Asks]:
    """The lowest bound of each actor: a cyclist bounds twice, as a person and as a lead."""
    lowest_last = sorted(actors, key=lambda b: -b.mps)
    return {b.track_id: Asks(b.track_id, b.why, b.mps, b.known) for b in lowest_last if b.track_id is not None}


def _seen(state: State) -> dict[int, bool] | None:
    """Which actors are seen, and whether surely; none without tracks, and without a speed none that would bound by it."""
    if state.world.actors is None:
        return None
    measured = state.speed_mps is not None
    return {
        track.track_id: track.confidence >= KNOWN_CONFIDENCE
        for track in tracks(state.world)
        if measured or track.kind == "pedestrian"
    }


def _blind_ns(state: State) -> int:
    """How much of the time since the last tick no picture tells of; negative where pictures come late."""
    before_ns = state.held.target_ns
    return 0 if before_ns is None else max(0, state.now_ns - before_ns) - state.looked_ns


def last_seen(goal: Target) -> tuple[float | None, float | None]:
    """How lead and person bound the target of this tick, to be held if they are lost from sight."""
    least: dict[str, float] = {}
    for bound in goal.bounds:  # the tightest first
        least.setdefault(bound.why, bound.mps)
    return least.get("lead"), least.get("person")


def _sight(state: State) -> Iterator[Bound]:
    """The speed from which one stops within sight: the factor was worked out for one limit and has a floor."""
    conditions = state.held.conditions
    if conditions is not None and conditions.safe_speed_mps is not None:
        yield Bound(max(0.0, conditions.safe_speed_mps), "sight", "weather", conditions.confidence)


def _experts(state: State) -> Iterator[Bound]:
    for each in state.held.limiters:
        if each.target_mps is not None:
            yield Bound(each.target_mps, "expert", each.tool, each.confidence)


def _following(state: State, headway: float) -> Iterator[Bound]:
    """Open or close the gap to each vehicle ahead within `GAP_TIME_S`: the one met first need not be the one followed."""
    for way in vehicles(state.world):
        if not way.track.oncoming:
            speed = max(0.0, _lead_mps(state, way))
            wanted_m = STANDSTILL_M + HEADWAY_S * headway * speed
            mps = max(0.0, speed + (way.least_m - wanted_m) / GAP_TIME_S)
            yield _of(way.track, Bound(mps, "lead", "perception", way.track.confidence))


def _lead_mps(state: State, way: Way) -> float:
    """The speed of a vehicle ahead; while the ego's own is unknown, by the one that was believed last, and without one it may stand."""
    if way.speed_mps is not None:
        return way.speed_mps
    return 0.0 if state.held.speed is None else state.held.speed.mps - way.closing_mps
