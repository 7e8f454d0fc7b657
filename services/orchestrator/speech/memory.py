"""What a tick leaves behind: the memory of what was said, what is held, since when events last. No clock, no bus."""

import msgspec

from domain.speech import adopted, said, without
from proto.decision import ArbitrationRequest, Decision, Event
from proto.messages import Kind
from proto.speech import Memory, News
from services.orchestrator.events import onsets
from services.orchestrator.state import State
from services.orchestrator.target.target import Target, last_seen

OF_LIMITS = (Kind.AHEAD, Kind.APPROACH, Kind.LIMIT, Kind.OVERSPEED)
ANNOUNCING = OF_LIMITS[:2]
SPOKEN_KINDS = ("SPEAK", "ACT")


def remember(
    state: State,
    before: State,
    events: tuple[Event, ...],
    goal: Target,
    request: ArbitrationRequest,
    decision: Decision,
) -> State:
    """The state after the tick, with the arbiter's memory; a decision without one is remembered by the same rule."""
    lead_mps, person_mps = last_seen(goal)
    held = msgspec.structs.replace(
        state.held,
        target_mps=goal.mps,
        target_ns=state.now_ns,
        lead_mps=lead_mps,
        person_mps=person_mps,
        place_m=goal.place.room_m if goal.place is not None else None,
        lost=goal.lost,
    )
    memory = adopted(decision.memory, state.now_ns) if decision.memory is not None else None
    if memory is None:
        memory = without(state.memory, request.past)
        if decision.kind in SPOKEN_KINDS:
            alarm = decision.act_withheld != "" or request.fused.urgency == "alarm"
            memory = said(memory, request, decision.hazard, state.now_ns, alarm=alarm)
    return msgspec.structs.replace(
        state,
        held=held,
        memory=memory,
        announced=_announced(state, memory),
        unheard=decision.memory is None,
        onsets=onsets(before, events, state.now_ns),
    )


def _announced(state: State, memory: Memory) -> News | None:
    """The limit that the last word on limits announced, though what announced it is passed and forgotten."""
    told = [each for each in memory.spoken if each.kind in OF_LIMITS]
    last = max(told, key=lambda each: each.stamp_ns, default=None)
    if last is None or last.stamp_ns < state.now_ns:
        return state.announced
    return last.news if last.kind in ANNOUNCING else None
