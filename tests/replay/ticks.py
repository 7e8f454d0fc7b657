"""Logged ticks decided again in a closed loop: inputs, answers of experts and the arbiter's own reading come from the log,
the states of orchestrator and arbiter evolve as today's code has them.
"""

from collections.abc import Iterable, Iterator
from typing import Any

import msgspec

from proto.decision import ArbitrationRequest, Decision, TraceRecord
from proto.tools import Outcome
from services.arbiter.decide import Inputs, decide
from services.arbiter.profiles.profile import load
from services.arbiter.state import ArbiterState, fresh
from services.orchestrator.experts.routing import Call
from services.orchestrator.observations.inputs import Observations
from services.orchestrator.state import State
from services.orchestrator.tick import Ticked, tick
from tests.replay.files import Parts, stated

STATED = ("own", "memory", "profile_sha256", "state_sha256")
"""Of a decision: memory and its hashes, whose form may change while what is decided does not."""
MEASURED = ("event_to_advice_ms", "snapshot_to_advice_ms")


class LoggedTick(msgspec.Struct, frozen=True, kw_only=True):
    """What one tick was decided from; nothing of what it came to."""

    inputs: dict[str, Any]
    calls: tuple[Outcome, ...]
    profile: str
    """Of the arbiter that answered; empty: none did."""
    own: dict[str, Any] = {}
    """The arbiter's inputs beside the request, its state apart."""


def logged(trace: TraceRecord) -> LoggedTick:
    """The part of a trace that the lock keeps."""
    own = {name: value for name, value in trace.decision.own.items() if name != "state"}
    answered = trace.decision.profile if trace.decision.own else ""
    return LoggedTick(inputs=trace.inputs, calls=trace.calls, profile=answered, own=own)


class FromLog:
    """The two waits of a tick: experts answer as logged, the arbiter decides anew."""

    def __init__(self, entry: LoggedTick, state: ArbiterState | None) -> None:
        self._entry, self.state = entry, state
        self._outcomes = entry.calls

    def experts(self, calls: tuple[Call, ...]) -> tuple[Outcome, ...]:
        """A question that the log does not hold is answered `unavailable`; one that names more facts today is the same."""
        return tuple(self._answer(call) for call in calls)

    def _answer(self, call: Call) -> Outcome:
        asked = msgspec.json.decode(msgspec.json.encode(call.arguments))
        found = (each for each in self._outcomes if each.tool == call.tool and _within(each.arguments, asked))
        outcome = next(found, Outcome(tool=call.tool, status="unavailable", error="not in the log"))
        return msgspec.structs.replace(outcome, arguments=call.arguments)

    def arbiter(self, request: ArbitrationRequest) -> Decision | None:
        """The decision on the log's reading, from the state that today's code has come to."""
        if not self._entry.profile:
            return None
        profile = load(self._entry.profile)
        state = self.state or fresh(profile)
        inputs = msgspec.convert({**self._entry.own, "state": msgspec.to_builtins(state)}, Inputs)
        if inputs.delta is not None:
            profile = msgspec.structs.replace(profile, delta=inputs.delta)
        verdict = decide(request, inputs, profile)
        self.state = verdict.state
        return verdict.decision


def _within(logged: Any, today: Any) -> bool:
    """Whether everything that the log's question says stands in today's too."""
    if isinstance(logged, dict) and isinstance(today, dict):
        return all(name in today and _within(value, today[name]) for name, value in logged.items())
    return bool(logged == today)


def decided_again(entries: Iterable[LoggedTick]) -> Iterator[Parts]:
    """Events, calls, decision and advisory of each tick, from a drive's beginning."""
    state, arbiter = State(), None
    for entry in entries:
        ask = FromLog(entry, arbiter)
        ticked = tick(state, msgspec.convert(entry.inputs, Observations), ask)
        state, arbiter = ticked.state, ask.state
        yield parts_of(ticked)


def parts_of(ticked: Ticked) -> Parts:
    """What a tick came to, without memory and measured times."""
    decision, advisory = stated(ticked.decision), stated(ticked.advisory)
    return {
        "events": [stated(event) for event in ticked.events],
        "calls": [{"tool": each.tool, "arguments": each.arguments} for each in ticked.outcomes],
        "decision": {name: value for name, value in decision.items() if name not in STATED},
        "advisory": {name: value for name, value in advisory.items() if name not in MEASURED},
    }
