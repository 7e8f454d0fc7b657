"""Candidates for road users ahead, and for places to stop or give way at."""

from collections.abc import Iterator

from domain import kinematics
from domain.road_users import braking_needed_mps2
from proto.decision import Event, Urgency
from proto.messages import ROWS, Kind
from proto.speech import News
from services.orchestrator.speech.candidate import SPOKEN_S, Candidate, told_within
from services.orchestrator.speech.wording import decimal, distance, speed, word
from services.orchestrator.state import State
from services.orchestrator.target.target import Target
from services.orchestrator.world.actors import (
    FAINT,
    Way,
    clear,
    comes_from,
    confirmed,
    known,
    met,
    people,
    stands,
    surely_nears,
)
from services.orchestrator.world.giving_way import READY_MPS
from services.orchestrator.world.stops import REACTION_S, Stop, stops

ACTS_S = 1.25
"""Until the median driver acts on a word."""
HAZARD_TTC_S = 4.0
ALARM_TTC_S = 2.0
FIRM_MPS2 = 1.5
"""A stop that needs more than this is a hazard: it should have begun."""
RED_S = 120.0
"""No red light lasts much longer."""
QUEUE_TTC_S, QUEUE_CLOSING_MPS, QUEUE_SPEED_MPS = 7.0, 6.0, 60.0 / 3.6
"""The end of a queue is told early at speed, and at any speed on a motorway, where a queue is not expected."""
CUT_IN_S, CUT_IN_ACROSS_MPS, CUT_IN_CLOSING_MPS, SIGMAS_ACROSS = 1.0, 1.0, 3.0, 3.0
"""A vehicle cuts in that is so near by the ego's speed, and moves so fast sideways, slower than the ego by so much. A driver reacts after
1.25 s, and keeps 2 s."""
IN_THE_LANE_M = 0.5
"""The end of a queue leaves less than no room by so much; nearer than `HAZARD_TTC_S` any vehicle that leaves no room counts."""
LEAST_TTC_S, LOSES_MPS2 = 2.5, 4.0
DRAG_MPS2 = 0.5
"""What a lifted foot alone gives."""


def person(state: State, target: Target, events: dict[str, Event]) -> Iterator[Candidate]:
    """People in or near the path that comfortable braking does not avoid; the most urgent one sets the urgency."""
    judged = [(way, _person_urgency(state, way)) for way in people(state.world) if clear(state.gaps, way)]
    found = [(way, urgency) for way, urgency in judged if urgency is not None and _worth_a_word(state, way, urgency)]
    if not found:
        return
    # The nearest need not be the most urgent: a rider behind a walker may be met sooner.
    way, urgency = min(found, key=lambda each: each[1] != "alarm")
    if urgency == "warning" and all(_tells_of_the_line(state, events, each) for each, _ in found):
        return
    yield Candidate(
        kind=Kind.PERSON,
        news=News(track_id=way.track.track_id, what=urgency),
        phrase="person_alarm" if urgency == "alarm" else "person",
        urgency=urgency,
        values={"gap": distance(state.preferences, max(0.0, way.gap_m))},
        why=("person",),
        hazard="pedestrian",
        confidence=way.track.confidence,
        asked_mps=target.mps,
    )


def _worth_a_word(state: State, way: Way, urgency: Urgency) -> bool:
    """Every word waits until the person is certain or confirmed, and meanwhile the target sinks; an alarm does not wait for a person who
    is known for a while. A driver who was told of a line and brakes enough for this person too needs no warning.
    """
    if urgency == "warning" and _heeds(state, Kind.STOP, _person_needs_mps2(state, way)):
        return False
    return confirmed(state.gaps, way) or (urgency == "alarm" and known(way.track))


def _waits_at_a_line(state: State, way: Way, least: float) -> bool:
    """Whether a driver who stops at the next line does all that a person needs: the person is behind the line, believed at `least`."""
    line = next((stop for stop in stops(state) if stop.why != "person"), None)
    known = line is not None and line.confidence >= least and not line.unmapped and not line.doubted
    return known and line is not None and line.room_m <= way.least_m - SPARE_M


def _tells_of_the_line(state: State, events: dict[str, Event], way: Way) -> bool:
    """Whether "Stop: red light" is said in place of a person behind that line, or was said so lately that the driver acts on it."""
    told = state.memory.last(Kind.STOP)
    lately = told is not None and told.news.grave and told_within(state, Kind.STOP, REACTION_S)
    if lately and _waits_at_a_line(state, way, FAINT):
        return True
    return "stop_required" in events and _may_tell_of_a_line(state) and _waits_at_a_line(state, way, SURE)


def _may_tell_of_a_line(state: State) -> bool:
    """Whether the driver drives, and was not told of a line lately."""
    ego = state.world.ego.speed_mps
    return ego is not None and ego.value > STOPS_MPS and not told_within(state, Kind.STOP, HEEDED_S)


def _keeps_from_people(state: State) -> bool:
    """Whether a person worth a word is behind the next line: the line is told at once, for both."""
    if not _may_tell_of_a_line(state):
        return False
    behind = (way for way in people(state.world) if clear(state.gaps, way) and _waits_at_a_line(state, way, SURE))
    judged = ((way, _person_urgency(state, way)) for way in behind)
    return any(urgency is not None and _worth_a_word(state, way, urgency) for way, urgency in judged)


def _heeds(state: State, kind: Kind, need_mps2: float) -> bool:
    """Whether the driver was told of such a thing recently and brakes as hard as it needs."""
    return told_within(state, kind, HEEDED_S) and _brakes(state, need_mps2)


HEEDED_S = 10.0
"""A word counts for so long."""


def _person_needs_mps2(state: State, way: Way) -> float:
    ego = state.world.ego.speed_mps
    return kinematics.needed_mps2(ego.value, way.least_m - SPARE_M) if ego is not None else FIRM_MPS2 + 0.1


def _person_urgency(state: State, way: Way) -> Urgency | None:
    """None: the driver has time to brake comfortably. A person that would be an alarm before the warning is over is an alarm at once;
    a driver who was told and brakes enough hears no alarm."""
    need, ttc_s = _person_needs_mps2(state, way), way.ttc_s
    told = told_within(state, Kind.PERSON, HEEDED_S)
    first = need > FIRM_MPS2 and not told and confirmed(state.gaps, way)
    heeds = _heeds(state, Kind.PERSON, need) or _heeds(state, Kind.STOP, need)
    if ttc_s is not None and ttc_s < ALARM_TTC_S + first * PERSON_SPOKEN_S and not heeds:
        return "alarm"
    return "warning" if need > FIRM_MPS2 or (ttc_s is not None and ttc_s < HAZARD_TTC_S) else None


PERSON_SPOKEN_S, LEAD_SPOKEN_S = 0.8, 1.2
"""How long the words of a warning take."""
HARD_MPS2 = 3.0
"""Firm braking."""
SPARE_M = 1.0
"""The gap that is left when the ego has stopped behind a road user."""
SURE = 0.6
"""A line in whose place a person is told of is believed so much: a driver who sees a green light would heed neither."""
STOPS_MPS = 2.0
"""A slower ego stops at its line within a metre."""


def lead(state: State, target: Target, events: dict[str, Event]) -> Iterator[Candidate]:
    """The vehicle that is met soonest, if soon: one that drives before us, or across our way."""
    if stands(state.world):
        return
    soon = (way for way in met(state.world) if _soon_met(state, way) and clear(state.gaps, way))
    # A driver who brakes enough for the first need not brake enough for the next.
    way = next((way for way in soon if not _is_heeded(state, way)), None)
    if way is None or way.ttc_s is None:
        return
    close, side = _is_close(state, way, way.ttc_s), comes_from(way)
    alarm = way.ttc_s < ALARM_TTC_S and not told_within(state, Kind.LEAD, LEAD_SPOKEN_S)
    known_as = "lead" if close else "slow_traffic"
    phrase = known_as if side is None else "crossing"
    yield Candidate(
        kind=Kind.LEAD,
        news=News(track_id=way.track.track_id, what=known_as),
        phrase=f"{phrase}_alarm" if alarm else phrase,
        urgency="alarm" if alarm else "warning",
        values={
            "gap": distance(state.preferences, max(0.0, way.gap_m)),
            "closing": speed(state.preferences, way.closing_mps),
            "ttc": decimal(state.preferences, way.ttc_s),
            **({"side": word(state.preferences, side)} if side is not None else {}),
        },
        why=(phrase,),
        hazard="closing_lead" if close else "slow_traffic",
        confidence=way.track.confidence,
        asked_mps=target.mps,
    )


def _is_close(state: State, way: Way, ttc_s: float) -> bool:
    """A queue that is close before its words are over is so at once; and a driver who hears "brake" hears the alarm after that."""
    ahead_s = 0.0 if told_within(state, Kind.LEAD, HEEDED_S) else LEAD_SPOKEN_S
    return ttc_s - ahead_s < _hazard_ttc_s(way) or _cuts_in(state, way)


def _is_heeded(state: State, way: Way) -> bool:
    """Whether the driver brakes, or gives way, as a vehicle needs."""
    if way.ttc_s is None or _brakes_for(state, way, way.ttc_s, close=_is_close(state, way, way.ttc_s)):
        return True
    return way.ttc_s >= ALARM_TTC_S and comes_from(way) is not None and _gives_way(state, way)


def _brakes_for(state: State, way: Way, ttc_s: float, *, close: bool) -> bool:
    """Whether the driver brakes as hard as a vehicle needs, or for the end of a queue that was told and is not close by most of that.

    One untold may brake for something else than a vehicle from the side, and hears of what is an alarm.
    """
    need, untold = _lead_needs_mps2(way), ttc_s >= ALARM_TTC_S and comes_from(way) is None
    share = 1.0 if close else HEEDS_SHARE
    return _heeds(state, Kind.LEAD, share * need) or (untold and _brakes(state, max(need, DRAG_MPS2)))


def _gives_way(state: State, way: Way) -> bool:
    """Whether the driver was just told to give way, or was told recently and brakes as hard as the crossing vehicle needs."""
    return told_within(state, Kind.GIVE_WAY, REACTION_S) or _heeds(state, Kind.GIVE_WAY, _lead_needs_mps2(way))


def _lead_needs_mps2(way: Way) -> float:
    ego_mps = way.speed_mps + way.closing_mps if way.speed_mps is not None else None
    return braking_needed_mps2(way.track, way.least_m, way.closing_mps, SPARE_M, ego_mps)


def _soon_met(state: State, way: Way) -> bool:
    if way.ttc_s is None or not surely_nears(way):
        return False
    fast = state.road == "motorway" or state.speed_mps is None or state.speed_mps > QUEUE_SPEED_MPS
    near = way.ttc_s < _hazard_ttc_s(way) and (comes_from(way) is not None or _lead_needs_mps2(way) > FIRM_MPS2)
    return (
        near
        or _cuts_in(state, way)
        or (fast and way.ttc_s < QUEUE_TTC_S and way.closing_mps > QUEUE_CLOSING_MPS and _is_in_the_lane(way))
    )


def _cuts_in(state: State, way: Way) -> bool:
    """Whether a slower vehicle moves into the ego's lane on a motorway, nearer than a driver reacts. In bends of other roads all that drive
    ahead seem to move sideways."""
    ego_mps, track = state.speed_mps, way.track
    if state.road != "motorway" or ego_mps is None or way.gap_m > CUT_IN_S * ego_mps:
        return False
    sideways = abs(track.vy_mps) >= max(CUT_IN_ACROSS_MPS, SIGMAS_ACROSS * (track.sigma_vy_mps or 0.0))
    inward = track.y_m * track.vy_mps < 0.0
    return inward and sideways and way.closing_mps > CUT_IN_CLOSING_MPS


def _is_in_the_lane(way: Way) -> bool:
    """Whether a vehicle so far away fills the ego's lane, rather than its edge, which is where parked vehicles are measured, too."""
    return way.track.clearance_m is None or way.track.clearance_m <= -IN_THE_LANE_M


def _hazard_ttc_s(way: Way) -> float:
    """By the closing speed: time to react, and to lose it by firm braking. Drivers find a word 4 s ahead of a slow approach too early."""
    if comes_from(way) is not None:
        return HAZARD_TTC_S
    return min(HAZARD_TTC_S, max(LEAST_TTC_S, REACTION_S + way.closing_mps / (2.0 * LOSES_MPS2)))


def stop(state: State, target: Target, events: dict[str, Event]) -> Iterator[Candidate]:
    """The nearest red light or stop sign.

    For a driver who sets off below a light that only the driver can see, the request to look at the light.
    """
    due = _next_line(state)
    found = _stop_candidate(state, due) if due is not None and "stop_required" in events else None
    if found is not None:
        yield found
    elif state.light is not None and state.light.lost_at_line and not stands(state.world):
        values = {"state": _lamp(state, state.light.state)}
        yield Candidate(
            kind=Kind.STOP, news=News(what="light_lost"), again_s=60.0, phrase="light_lost", urgency="advice", values=values,
            why=("light_lost",), confidence=0.3,
        )  # fmt: skip


def _next_line(state: State) -> Stop | None:
    """The next line to stop at that is not doubted."""
    return next((stop for stop in stops(state) if stop.why != "person" and not stop.doubted), None)


def _stop_candidate(state: State, stop: Stop) -> Candidate | None:
    """The stop, for a driver who would not stop there by comfortable braking; or without a speed, calmly."""
    ego = state.world.ego.speed_mps
    need = _stop_needs_mps2(state, stop, ego.value) if ego is not None else 0.0
    told = _told_firmly(state, stop)
    due = (
        ego is not None and ego.value > STOPS_MPS and need > FIRM_MPS2 and not (told and _stops(state, ego.value, need))
    )
    firm = due or _keeps_from_people(state)
    if ego is not None and not firm and not told:
        return None
    if firm and not told and need < HARD_MPS2 and _is_being_warned(state):
        return None
    light = state.light.state if state.light is not None and stop.why == "red_light" else "red"
    return Candidate(
        kind=Kind.STOP,
        news=News(what=_hazard(stop), grave=firm or told),
        phrase=f"{stop.why}_firm" if firm else stop.why,
        urgency="warning" if firm else "advice",
        values={
            "gap": distance(state.preferences, max(0.0, stop.room_m)),
            "state": _lamp(state, light),
        },
        why=(stop.why,),
        hazard=_hazard(stop) if firm else "",
        confidence=stop.confidence,
        asked_mps=max(0.0, stop.approach_mps()),
    )


def _is_being_warned(state: State) -> bool:
    """Whether the driver still hears of a road user ahead, for whom a driver begins to brake as for a line."""
    return told_within(state, Kind.PERSON, PERSON_SPOKEN_S) or told_within(state, Kind.LEAD, LEAD_SPOKEN_S)


def stop_is_due_soon(state: State) -> bool:
    """Whether a word on the next line is due before a word of now is over, for a driver who goes on like this."""
    line, ego = _next_line(state), state.world.ego.speed_mps
    if line is None or ego is None:
        return False
    nearer = line._replace(room_m=line.room_m - SPOKEN_S * ego.value)
    return _stop_needs_mps2(state, nearer, ego.value) > FIRM_MPS2


def _stop_needs_mps2(state: State, stop: Stop, speed_mps: float) -> float:
    """The deceleration that ends at the line, with the speed that a driver who speeds up towards it gains before acting on a word."""
    change = state.world.ego.acceleration_mps2
    gained_mps = max(0.0, change.value) * ACTS_S if change is not None else 0.0
    return kinematics.needed_mps2(speed_mps + gained_mps, stop.room_m - gained_mps * ACTS_S / 2.0)


def _stops(state: State, speed_mps: float, need_mps2: float) -> bool:
    """Whether a driver who was told of a line is about to stop there.

    The driver brakes by most of what the line needs, where that is not firm braking, or brakes visibly at low speed.
    """
    slow = speed_mps < SLOW_MPS and _brakes(state, SLOWING_MPS2)
    soft = need_mps2 < HARD_MPS2 and _brakes(state, HEEDS_SHARE * need_mps2)
    return slow or soft or _brakes(state, need_mps2)


HEEDS_SHARE, SLOW_MPS, SLOWING_MPS2 = 0.7, 4.0, 1.0


def _lamp(state: State, light: str) -> str:
    return word(state.preferences, light if light in ("red", "red_amber", "amber") else "red")


def _hazard(stop: Stop) -> str:
    """A line is no other hazard once its sign is read."""
    return "stop_sign" if stop.why == "stop_line" else stop.why


def _told_firmly(state: State, stop: Stop) -> bool:
    """Whether the driver was told firmly of such a stop recently: a calmer word on it is no news."""
    told = state.memory.last(Kind.STOP)
    firmly = told is not None and told.news == News(what=_hazard(stop), grave=True)
    return firmly and told_within(state, Kind.STOP, ROWS[Kind.STOP].repeat_s)


def _brakes(state: State, need_mps2: float) -> bool:
    """Whether the ego slows down as hard as the stop needs."""
    change = state.world.ego.acceleration_mps2
    return change is not None and -change.value >= need_mps2


def go(state: State, target: Target, events: dict[str, Event]) -> Iterator[Candidate]:
    """The light before which one was told to stop is green; a word of longer ago than a red phase was about another one."""
    told = state.memory.last(Kind.STOP)
    light = state.light
    if (
        told is None
        or not told_within(state, Kind.STOP, RED_S)
        or told.news.what != "red_light"
        or light is None
        or light.state != "green"
    ):
        return
    yield Candidate(
        kind=Kind.GO,
        news=News(what="go"),
        phrase="go",
        urgency="info",
        values={},
        why=("go",),
        confidence=light.confidence,
    )


def give_way(state: State, target: Target, events: dict[str, Event]) -> Iterator[Candidate]:
    """A place to give way at, for a driver too fast to let others go first who does not slow down yet."""
    here, ego, side = target.place, state.world.ego.speed_mps, state.signs.traffic_side
    if here is None:
        return
    if ego is not None:
        slow_enough = ego.value < READY_MPS + OVER_MPS or here.room_m > here.begins_m(ego.value)
        if slow_enough or _brakes(state, _to_be_ready_mps2(ego.value, here.room_m)):
            return
    from_right = (
        side is not None and side.value == "right"
    )  # a road user from there goes first where nothing says otherwise
    yield Candidate(
        kind=Kind.GIVE_WAY,
        news=News(what=here.why),
        phrase="junction_open" if here.why == "junction" and not from_right else here.why,
        urgency="advice",
        values={
            "gap": distance(state.preferences, max(0.0, here.room_m)),
            **({"side": word(state.preferences, "right")} if from_right else {}),
        },
        why=(here.why,),
        confidence=here.confidence,
        asked_mps=READY_MPS,
    )


OVER_MPS = 1.0


def _to_be_ready_mps2(speed_mps: float, room_m: float) -> float:
    return kinematics.needed_mps2(speed_mps, room_m, READY_MPS)
