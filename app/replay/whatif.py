"""What would have differed with another rulepack, Delta or friction. Pure.

The drive itself is not driven again: the road, the car and all answers but those of Rules are the log's. The orchestrator's
state and the arbiter's evolve as they would have; a question that the log has no answer to counts as unanswered, which only
makes advice more careful.
"""

from collections.abc import Iterable, Iterator

import msgspec

from app.replay.again import LOCAL, SHIPPED, AtHand, known_state
from app.replay.differences import Difference, differences
from drivemcp.errors import UserError
from proto.decision import ArbitrationRequest, Decision, TraceRecord
from proto.rules import RulesAnswer, Situation
from proto.tools import Outcome
from services.arbiter.decide import Inputs, decide
from services.arbiter.state import ArbiterState
from services.orchestrator.experts.ask import Recorded
from services.orchestrator.experts.routing import Call
from services.orchestrator.observations.inputs import Observations
from services.orchestrator.state import State
from services.orchestrator.tick import Ticked, tick
from services.rules.book import RuleBook
from services.rules.limits.limit_answer import applicable_limit

RULES_TOOL = "applicable_limit"


class Change(msgspec.Struct, frozen=True, kw_only=True):
    """What is supposed otherwise; None: as it was."""

    delta: float | None = None
    mu: float | None = None
    book: RuleBook | None = None


class Otherwise(msgspec.Struct, frozen=True, kw_only=True):
    """What would have differed in one tick."""

    tick: int
    logged_kind: str
    kind: str
    differences: tuple[Difference, ...]


class _Supposed:
    """Answers from the trace, but for what is supposed otherwise."""

    def __init__(self, trace: TraceRecord, change: Change, arbiter_state: ArbiterState | None, at_hand: AtHand) -> None:
        self._recorded, self._trace, self._change, self._at_hand = Recorded(trace), trace, change, at_hand
        self.arbiter_state = arbiter_state

    def experts(self, calls: tuple[Call, ...]) -> tuple[Outcome, ...]:
        return tuple(self._answer(call) for call in calls)

    def arbiter(self, request: ArbitrationRequest) -> Decision | None:
        logged = self._trace.decision
        if self._trace.request is None or logged.profile == LOCAL:
            return None
        change, inputs = self._change, msgspec.convert(logged.own, Inputs)
        profile = self._at_hand.of(logged.profile, logged.profile_sha256)
        delta = change.delta if change.delta is not None else inputs.delta
        if delta is not None:
            profile = msgspec.structs.replace(profile, delta=delta)
        state = self.arbiter_state or inputs.state
        if change.delta is not None and self.arbiter_state is None:
            state = msgspec.structs.replace(state, adapted=msgspec.structs.replace(state.adapted, delta=change.delta))
        reading = inputs.reading
        if change.mu is not None:
            request = msgspec.structs.replace(request, mu_low=change.mu, mu_high=change.mu)
            view = msgspec.structs.replace(reading.view, mu_low=change.mu, mu_high=change.mu)
            reading = msgspec.structs.replace(reading, view=view)
        verdict = decide(request, msgspec.structs.replace(inputs, state=state, reading=reading, delta=delta), profile)
        self.arbiter_state = verdict.state
        return verdict.decision

    def _answer(self, call: Call) -> Outcome:
        book = self._change.book
        if book is None or call.tool != RULES_TOOL:
            return self._recorded.experts((call,))[0]
        situation = msgspec.convert(call.arguments["situation"], Situation)
        answer = applicable_limit(book, situation)
        logged = self._recorded.experts((call,))[0]
        if logged.ok and logged.result is not None:
            answer = _as_sure(answer, msgspec.convert(logged.result, RulesAnswer))
        return Outcome(tool=call.tool, status="ok", arguments=call.arguments, result=msgspec.to_builtins(answer))


def _as_sure(answer: RulesAnswer, logged: RulesAnswer) -> RulesAnswer:
    """The same law found again counts as sure as in the log, where retrieval confirmed it; retrieval is not asked here."""
    same = (answer.limit, answer.legal_action) == (logged.limit, logged.legal_action)
    return msgspec.structs.replace(answer, confidence=logged.confidence, degraded=logged.degraded) if same else answer


def otherwise(traces: Iterable[TraceRecord], change: Change, at_hand: AtHand = SHIPPED) -> Iterator[Otherwise]:
    """Every tick under the supposition. Ticks before the first known state are passed over.

    Raises UnknownProfile, and UserError for a tick whose state, inputs or answers do not fit.
    """
    state: State | None = None
    arbiter_state: ArbiterState | None = None
    last: int | None = None
    for trace in traces:
        if trace.tick == 1:
            state = State()
        elif last is None or trace.tick != last + 1:
            state, arbiter_state = None, None
        if state is None:
            state = known_state(trace)
        else:
            ask = _Supposed(trace, change, arbiter_state, at_hand)
            ticked = _ticked(state, trace, ask)
            yield _compared(trace, ticked)
            state, arbiter_state = ticked.state, ask.arbiter_state
        last = trace.tick


def _ticked(state: State, trace: TraceRecord, ask: _Supposed) -> Ticked:
    try:
        return tick(state, msgspec.convert(trace.inputs, Observations), ask)
    except msgspec.ValidationError as error:
        raise UserError(f"inputs or answers of tick {trace.tick} do not fit this version: {error}") from None


def _compared(trace: TraceRecord, ticked: Ticked) -> Otherwise:
    told, would = trace.advisory, ticked.advisory
    pairs = (
        ("kind", told.kind, would.kind),
        ("limit", told.legal_limit, would.legal_limit),
        ("target_mps", told.target_mps, would.target_mps),
        ("directive", told.directive, would.directive),
        ("hazard", told.hazard, would.hazard),
        ("act_withheld", told.act_withheld, would.act_withheld),
        ("r", trace.decision.metrics.r, ticked.decision.metrics.r),
    )
    found = tuple(one for name, logged, new in pairs for one in differences(name, logged, new))
    return Otherwise(tick=trace.tick, logged_kind=told.kind, kind=would.kind, differences=found)
