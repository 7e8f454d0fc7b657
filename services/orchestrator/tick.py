"""One tick as data. The two steps that wait are `ask.experts` and `ask.arbiter`; all others are pure.

observe → detect_events → route → ask.experts → advise → ask.arbiter → remember
"""

from typing import NamedTuple

import msgspec

from proto.decision import Advisory, ArbitrationRequest, Decision, Event, Fused, TraceRecord
from proto.perception import Track
from proto.speed_assistance import Picture, SpeedAssistance
from proto.tools import Outcome
from proto.world import WorldState
from services.orchestrator.advisor import Advised, advisor_of
from services.orchestrator.events import detect_events
from services.orchestrator.experts import answers
from services.orchestrator.experts.ask import Ask, Recorded
from services.orchestrator.experts.routing import Call
from services.orchestrator.observations.clock_set_back import on_this_clock
from services.orchestrator.observations.inputs import Observations
from services.orchestrator.speech.candidate import Candidate
from services.orchestrator.speech.candidates.limits_ahead import past
from services.orchestrator.speech.memory import remember
from services.orchestrator.speech.wording import face, graver, say, toned
from services.orchestrator.speed_assistance import assistance, stepped
from services.orchestrator.state import State, digest
from services.orchestrator.world.actors import people, stands, vehicles
from services.orchestrator.world.observe import observe

HELD = "held"
"""What the driver is told while the car is held at standstill; it stands in a hazard's place."""
MOST_OTHERS = 8
"""Farther road users of a crowd in the path tell the arbiter nothing that the nearer ones do not."""


class Ticked(NamedTuple):
    """All that a tick came to."""

    state: State
    world: WorldState
    events: tuple[Event, ...]
    calls: tuple[Call, ...]
    outcomes: tuple[Outcome, ...]
    fused: Fused
    request: ArbitrationRequest
    decision: Decision
    advisory: Advisory
    assistance: SpeedAssistance
    latency_ms: float | None = None
    """What the advisor's answer took, where the tick's own time does not tell."""


def tick(before: State, seen: Observations, ask: Ask) -> Ticked:
    """The next state and everything on the way to it."""
    before = on_this_clock(before, seen.now_ns)
    state = answers.take(observe(before, seen), seen.late)
    state = stepped(state, seen.ego.message if seen.ego is not None else None, seen.acknowledged)
    events = detect_events(state, before, seen.query, seen.thresholds)
    advisor = advisor_of(seen.method)
    advised = advisor.advise(state, before, events, seen, ask)
    state, fused, outcomes = advised.state, advised.fused, advised.outcomes
    request = request_of(state, advised, seen)
    decision = advisor.decide(request, state, ask)
    spoken = spoken_of(advised.chosen, decision)
    after = remember(state, before, advised.events, advised.goal, request, decision)
    advisory = advisory_of(state, fused, decision, spoken, seen, outcomes)
    return Ticked(
        after,
        state.world,
        advised.events,
        advised.calls,
        outcomes,
        fused,
        request,
        decision,
        advisory,
        assistance(state, fused, advised.goal),
        advised.latency_ms,
    )


def request_of(state: State, advised: Advised, seen: Observations) -> ArbitrationRequest:
    """What the arbiter is asked: the advice, and the numbers as the orchestrator sees them."""
    world, held = state.world, state.held
    ahead, persons = ([each.track for each in ways] for ways in (vehicles(world), people(world)))
    speed, accel = world.ego.speed_mps, world.ego.acceleration_mps2
    conditions, car, told_ns = held.conditions, held.degradation, state.memory.spoken_ns
    return ArbitrationRequest(
        tick=state.tick,
        stamp_ns=world.stamp_ns,
        fused=advised.fused,
        ego_speed_mps=speed.value if speed is not None else None,
        ego_acceleration_mps2=accel.value if accel is not None else None,
        lead=next(iter(ahead), None),
        pedestrian=next(iter(persons), None),
        others=_nearest(tuple(dict.fromkeys((*ahead[1:], *persons[1:])))),
        h=car.h if car is not None else None,
        brake_envelope=car.brake_envelope if car is not None else None,
        mu_low=conditions.mu_low if conditions is not None else None,
        mu_high=conditions.mu_high if conditions is not None else None,
        following_factor=advised.fused.headway_factor,
        tool_timed_out=bool(advised.failed) or any(not outcome.ok for outcome in advised.outcomes),
        degraded=world.degraded,
        seconds_since_spoken=(state.now_ns - told_ns) / 1e9 if told_ns is not None else None,
        feedback=seen.feedback,
        message=advised.chosen.message if advised.chosen is not None else None,
        past=past(state),
        heard=state.memory if state.unheard else None,
    )


def _nearest(tracks: tuple[Track, ...]) -> tuple[Track, ...]:
    """As many as are told, in their order: a row of vehicles far ahead hides no person who is near."""
    near = sorted(tracks, key=lambda track: (track.x_m, track.track_id))[:MOST_OTHERS]
    return tuple(track for track in tracks if track in near)


def spoken_of(chosen: Candidate | None, decision: Decision) -> Candidate | None:
    """The chosen whose words are spoken, if any are; none where the arbiter shouts about what it alone sees."""
    alone = decision.hazard != "" and (chosen is None or chosen.hazard != decision.hazard)
    return None if alone else chosen


def advisory_of(
    state: State,
    fused: Fused,
    decision: Decision,
    chosen: Candidate | None,
    seen: Observations,
    outcomes: tuple[Outcome, ...],
) -> Advisory:
    """What the driver is told: the candidate's words, the gravest where the car is braked or would be; without one, those of a warning
    that the arbiter alone wants; while the car is held at standstill, what ends it."""
    preferences = state.preferences
    directive, justification = fused.directive, fused.justification
    urgency, hazard, topic, asked_mps, picture = (
        fused.urgency,
        fused.hazard,
        fused.topic,
        fused.asked_mps,
        fused.picture,
    )
    acts = decision.kind == "ACT"
    grave = acts or decision.act_withheld != ""
    if acts and stands(state.world):
        hazard, topic, urgency, directive = HELD, "caution", "alarm", say(preferences, "directive", HELD)
        asked_mps, picture = fused.target_mps, Picture(face="caution", country=state.signs.country or "")
    elif decision.kind != "SILENT" and (chosen is None or (acts and not chosen.hazard)):
        hazard = decision.hazard or "caution"
        topic = {"closing_lead": "lead", "pedestrian": "person"}.get(hazard, "caution")
        urgency = "alarm" if grave else "warning"
        directive = say(preferences, "directive", f"{topic}_alarm" if grave else topic)
        asked_mps, picture = fused.target_mps, Picture(face=face(topic), country=state.signs.country or "")
    elif grave and chosen is not None:
        urgency, directive = "alarm", say(preferences, "directive", graver(chosen.phrase), **chosen.values)
    if decision.act_withheld:
        withheld = say(preferences, "justification", "withheld", why=decision.act_withheld)
        justification = f"{justification} {withheld}".strip()
        urgency = "alarm"
        asked_mps = fused.target_mps if asked_mps is None else asked_mps
    return Advisory(
        tick=state.tick,
        snapshot_stamp_ns=state.world.stamp_ns,
        kind=decision.kind,
        directive=toned(preferences, directive, urgency) if directive != fused.directive else directive,
        justification=justification,
        urgency=urgency,
        topic=topic,
        hazard=hazard,
        target_mps=fused.target_mps,
        legal_limit=fused.legal_limit,
        unit=fused.unit,
        language=fused.language,
        confidence=fused.confidence,
        citations=fused.citations,
        degraded=fused.degraded,
        act_withheld=decision.act_withheld,
        late_tools=tuple(sorted({o.tool for o in (*outcomes, *seen.late) if o.late or o.status == "timeout"})),
        ahead_mps=fused.ahead_mps if topic == fused.topic else None,
        told_limit_mps=fused.told_limit_mps if topic == fused.topic else None,
        target_why=fused.target_why,
        asked_mps=asked_mps,
        picture=picture,
    )


def trace_of(
    ticked: Ticked, seen: Observations, versions: dict[str, str], advisory: Advisory, *, whole: bool
) -> TraceRecord:
    """The record of a tick: enough, with the state before, to run it again."""
    return TraceRecord(
        tick=ticked.state.tick,
        stamp_ns=ticked.world.stamp_ns,
        cause=seen.cause,
        inputs=msgspec.to_builtins(seen),
        events=ticked.events,
        calls=ticked.outcomes,
        fused=ticked.fused,
        request=ticked.request,
        decision=ticked.decision,
        advisory=advisory,
        state_sha256=digest(ticked.state),
        state=msgspec.to_builtins(ticked.state) if whole else None,
        versions=versions,
        world=msgspec.to_builtins(ticked.world),
    )


class Redecided(NamedTuple):
    """A logged tick, run again."""

    ticked: Ticked
    differences: tuple[str, ...]
    """Names of what came out otherwise; empty: the same to the last bit."""


def redecide(before: State, trace: TraceRecord, ask: Ask | None = None) -> Redecided:
    """Run a logged tick again from the state before it, its inputs and its answers; `ask` replaces the logged answers.

    Raises msgspec.ValidationError on malformed inputs.
    """
    recorded = Recorded(trace)
    ticked = tick(before, msgspec.convert(trace.inputs, Observations), ask or recorded)
    pairs = {
        "events": (ticked.events, trace.events),
        "calls": (len(ticked.outcomes) if not recorded.unknown else -1, len(trace.calls)),
        "fused": (ticked.fused, trace.fused),
        "request": (ticked.request, trace.request),
        "decision": (ticked.decision, trace.decision),
        "advisory": (_timeless(ticked.advisory), _timeless(trace.advisory)),
        "state": (digest(ticked.state), trace.state_sha256),
    }
    return Redecided(ticked, tuple(name for name, (ours, theirs) in pairs.items() if ours != theirs))


def state_of(trace: TraceRecord) -> State | None:
    """The whole state after a tick whose record carries it."""
    return msgspec.convert(trace.state, State) if trace.state is not None else None


def _timeless(advisory: Advisory) -> Advisory:
    """Without the latencies, which were measured."""
    return msgspec.structs.replace(advisory, event_to_advice_ms=None, snapshot_to_advice_ms=None)
