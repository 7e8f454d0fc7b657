"""What comes to the advice of a tick. `tools` is the way of production; others are found by entry point.

A distribution registers an advisor under `drivemcp.advisors`: a class with the methods of `Advisor`. The name of the entry
point is the setting `orchestrator.method`. The trace names advisor and settings, so that a replay decides by the same one.
"""

from typing import NamedTuple, Protocol

from drivemcp.errors import ConfigError
from drivemcp.registry import registered
from proto.decision import ArbitrationRequest, Decision, Event, Fused
from proto.tools import Outcome
from services.orchestrator.driver.answer import Answer, answer
from services.orchestrator.driver.question import calls_for, subject_of
from services.orchestrator.events import detect_events
from services.orchestrator.experts import answers
from services.orchestrator.experts.ask import Ask
from services.orchestrator.experts.routing import Call, failing, route
from services.orchestrator.observations.inputs import Method, Observations
from services.orchestrator.speech.candidate import Candidate
from services.orchestrator.speech.fusion import advise
from services.orchestrator.speech.local import decide_locally
from services.orchestrator.state import State
from services.orchestrator.target.target import Target

GROUP = "drivemcp.advisors"


class Advised(NamedTuple):
    """What a tick comes to before it is decided."""

    state: State
    events: tuple[Event, ...]
    calls: tuple[Call, ...]
    outcomes: tuple[Outcome, ...]
    fused: Fused
    chosen: Candidate | None
    goal: Target
    failed: tuple[str, ...] = ()
    """Tools that were to be asked and failed, now or a moment ago."""
    latency_ms: float | None = None
    """What an answer heard in this tick took, where the tick's own time does not tell."""


class Advisor(Protocol):
    """One way to come to advice; pure but for what it asks."""

    def __init__(self, method: Method) -> None: ...

    def advise(self, state: State, before: State, events: tuple[Event, ...], seen: Observations, ask: Ask) -> Advised:
        """Ask what has to be asked, and put it into words; `before` is the state of the last tick."""
        ...

    def decide(self, request: ArbitrationRequest, state: State, ask: Ask) -> Decision:
        """The word on whether the advice is spoken, or acted on."""
        ...

    def answer(self, question: str, state: State, ask: Ask) -> Answer:
        """The answer to a driver's question."""
        ...


class Consulted(NamedTuple):
    """What the experts have answered, and what holds by it."""

    state: State
    now: tuple[Event, ...]
    """The events that hold now: an answer can be news itself, or the end of it."""
    events: tuple[Event, ...]
    """Those, and the events because of which the experts were asked."""
    calls: tuple[Call, ...]
    outcomes: tuple[Outcome, ...]
    failed: tuple[str, ...]


def consulted(state: State, before: State, events: tuple[Event, ...], seen: Observations, ask: Ask) -> Consulted:
    """Route the events to experts, ask these in parallel, and take their answers."""
    calls = route(events, state, seen.experts)
    outcomes = ask.experts(calls) if calls else ()
    state = answers.take(state, outcomes)
    now = detect_events(state, before, seen.query, seen.thresholds) if outcomes else events
    held = {event.kind for event in now}
    events = (*now, *(event for event in events if event.kind not in held))
    return Consulted(state, now, events, calls, outcomes, failing(events, state, seen.experts))


class Tools:
    """Experts are asked in parallel, their answers fused, and the arbiter decides; without it the local rule, which never acts."""

    def __init__(self, method: Method) -> None:
        if method.settings:
            raise ConfigError(
                f"orchestrator.method_settings: the method 'tools' has none, not {min(method.settings)!r}"
            )

    def advise(self, state: State, before: State, events: tuple[Event, ...], seen: Observations, ask: Ask) -> Advised:
        """Route, ask, take the answers, fuse."""
        told = consulted(state, before, events, seen, ask)
        fused, chosen, goal = advise(told.state, told.now, told.failed)
        return Advised(told.state, told.events, told.calls, told.outcomes, fused, chosen, goal, told.failed)

    def decide(self, request: ArbitrationRequest, state: State, ask: Ask) -> Decision:
        """The arbiter's decision on this tick; without an answer the local rule, which never acts."""
        decision = ask.arbiter(request)
        if decision is None or decision.tick != request.tick:
            return decide_locally(request, state.memory, state.now_ns)
        return decision

    def answer(self, question: str, state: State, ask: Ask) -> Answer:
        """From the running drive and the tools that the question is about."""
        subject = subject_of(question)
        return answer(question, subject, state, ask.experts(calls_for(subject, question, state)))


def advisor_of(method: Method) -> Advisor:
    """The advisor of that name. Raises ConfigError for an unknown name or setting."""
    kind = Tools if method.name == "tools" else registered(GROUP, method.name, "orchestrator.method")
    advisor: Advisor = kind(method)
    return advisor
