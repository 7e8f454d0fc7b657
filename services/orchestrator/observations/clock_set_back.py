"""A clock that was set back: what is stamped later than now would be young for as long, and is forgotten or stamped now."""

from typing import Any

import msgspec

from domain import speech
from services.orchestrator.state import Held, State


def on_this_clock(state: State, now_ns: int) -> State:
    """The state without a word, question, onset or sighting from a time that is yet to come; the same where the clock goes on."""
    if now_ns >= state.now_ns:
        return state
    return msgspec.structs.replace(
        state,
        asked=tuple(each for each in state.asked if each.stamp_ns <= now_ns),
        memory=speech.on_this_clock(state.memory, now_ns),
        held=_held(state.held, now_ns),
        onsets=tuple(each for each in state.onsets if each.last_ns <= now_ns),
        missing=tuple(each for each in state.missing if each.since_ns <= now_ns),
        gaps=tuple(each for each in state.gaps if each.stamp_ns <= now_ns),
    )


def _held(held: Held, now_ns: int) -> Held:
    """What bounds the target stays, and is no younger than now."""
    fields: dict[str, Any] = {"legal_ns": min(held.legal_ns, now_ns)}
    fields["lost"] = tuple(
        msgspec.structs.replace(each, stamp_ns=min(each.stamp_ns, now_ns), higher_ns=None, higher_mps=None)
        for each in held.lost
    )
    if held.speed_ns > now_ns:
        fields |= {"speed_mps": None, "speed_ns": 0, "speed_owed_mps": 0.0}
    return msgspec.structs.replace(held, **fields)
