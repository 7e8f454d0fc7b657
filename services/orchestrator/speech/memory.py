"""What a tick leaves behind: what was said, what is held, since when events last. No clock, no bus."""

import msgspec

from proto.decision import Decision, Event
from services.orchestrator.events import onsets
from services.orchestrator.speech.candidate import Matter
from services.orchestrator.speech.candidates.limits_ahead import without_past
from services.orchestrator.state import Memory, Spoken, State
from services.orchestrator.target.target import Target, last_seen, still_lost

SPOKEN_KINDS = ("SPEAK", "ACT")
KEPT_TOPICS, KEPT_NAMES = 40, 60


def remember(
    state: State, before: State, events: tuple[Event, ...], goal: Target, matter: Matter | None, decision: Decision
) -> State:
    """The state after the tick."""
    lead_mps, person_mps = last_seen(goal)
    held = msgspec.structs.replace(
        state.held,
        target_mps=goal.mps,
        target_ns=state.now_ns,
        lead_mps=lead_mps,
        person_mps=person_mps,
        lost=still_lost(state, goal),
    )
    memory = said(state.memory, matter, decision, state.now_ns) if decision.kind in SPOKEN_KINDS else state.memory
    memory = msgspec.structs.replace(memory, spoken=without_past(memory.spoken, state))
    return msgspec.structs.replace(state, held=held, memory=memory, onsets=onsets(before, events, state.now_ns))


def said(memory: Memory, matter: Matter | None, decision: Decision, now_ns: int) -> Memory:
    """A message was spoken; without a matter it was the arbiter's own warning."""
    told = [(matter.slot, matter.key) if matter is not None else ("caution", "caution")]
    if matter is not None and matter.tells is not None:
        told.append(matter.tells)
    first, *rest = (_entry(memory, slot, key, now_ns) for slot, key in told)
    alarm = decision.act_withheld != "" or (matter is not None and matter.urgency == "alarm")
    meant = matter.hazard if matter is not None else decision.hazard
    entries = (msgspec.structs.replace(first, hazard=meant, alarm=alarm), *rest)
    others = tuple(each for each in memory.spoken if each.topic not in dict(told))
    hazard = matter is None or bool(matter.hazard)
    return msgspec.structs.replace(
        memory,
        spoken=(*others, *entries)[-KEPT_TOPICS:],
        spoken_ns=now_ns,
        messages=memory.messages + 1,
        hazards=memory.hazards + int(hazard),
        noticed=tuple(dict.fromkeys((*memory.noticed, *(matter.names if matter is not None else ()))))[-KEPT_NAMES:],
    )


def _entry(memory: Memory, slot: str, key: str, now_ns: int) -> Spoken:
    known = next((each for each in memory.spoken if each.topic == slot), None)
    return Spoken(topic=slot, key=key, stamp_ns=now_ns, count=known.count + 1 if known is not None else 1)


def seconds_since_spoken(state: State) -> float | None:
    """Since the last message of any kind; None: nothing was said yet."""
    spoken_ns = state.memory.spoken_ns
    return None if spoken_ns is None else (state.now_ns - spoken_ns) / 1e9
