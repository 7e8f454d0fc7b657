"""What a tick leaves behind: what was said, what is held, since when events last. No clock, no bus."""

import msgspec

from proto.decision import Decision, Event
from proto.messages import Kind
from services.orchestrator.events import onsets
from services.orchestrator.speech.candidate import Candidate
from services.orchestrator.speech.candidates.limits_ahead import without_past
from services.orchestrator.state import Memory, News, Spoken, State
from services.orchestrator.target.target import Target, last_seen, still_lost

SPOKEN_KINDS = ("SPEAK", "ACT")
KEPT_TOPICS, KEPT_NAMES = 40, 60


def remember(
    state: State, before: State, events: tuple[Event, ...], goal: Target, chosen: Candidate | None, decision: Decision
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
    memory = said(state.memory, chosen, decision, state.now_ns) if decision.kind in SPOKEN_KINDS else state.memory
    memory = msgspec.structs.replace(memory, spoken=without_past(memory.spoken, state))
    return msgspec.structs.replace(state, held=held, memory=memory, onsets=onsets(before, events, state.now_ns))


def said(memory: Memory, chosen: Candidate | None, decision: Decision, now_ns: int) -> Memory:
    """A message was spoken; without a candidate it was the arbiter's own warning."""
    alarm = decision.act_withheld != "" or (chosen is not None and chosen.urgency == "alarm")
    if chosen is None:
        news = News(what="caution")
        entries = [Spoken(kind=Kind.CAUTION, news=news, stamp_ns=now_ns, hazard=decision.hazard, alarm=alarm)]
    else:
        kind, hazard = chosen.remembered_as, chosen.hazard
        entries = [
            Spoken(kind=kind, about=chosen.about, news=chosen.news, stamp_ns=now_ns, hazard=hazard, alarm=alarm),
        ]
        if chosen.tells is not None:
            told, news = chosen.tells
            entries.append(Spoken(kind=told, news=news, stamp_ns=now_ns))
    replaced = {(each.kind, each.about) for each in entries}
    others = tuple(each for each in memory.spoken if (each.kind, each.about) not in replaced)
    return msgspec.structs.replace(
        memory,
        spoken=(*others, *entries)[-KEPT_TOPICS:],
        spoken_ns=now_ns,
        noticed=tuple(dict.fromkeys((*memory.noticed, *(chosen.names if chosen is not None else ()))))[-KEPT_NAMES:],
    )


def seconds_since_spoken(state: State) -> float | None:
    """Since the last message of any kind; None: nothing was said yet."""
    spoken_ns = state.memory.spoken_ns
    return None if spoken_ns is None else (state.now_ns - spoken_ns) / 1e9
