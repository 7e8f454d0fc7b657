"""The two waits of a tick, behind one interface: live over the bus, or out of a log."""

from typing import Protocol

from proto.decision import ArbitrationRequest, Decision, TraceRecord
from proto.tools import Outcome
from services.orchestrator.experts.routing import Call
from services.orchestrator.law import rules_question

BUDGET_MS = 100.0
"""From the snapshot's arrival to the advisory."""
ARBITER_DEADLINE_MS = 20.0
RESERVE_MS = 30.0
"""Kept back for fusion, the arbiter and publishing."""
LEAST_MS = 5.0


class Ask(Protocol):
    """Answers for the experts and the arbiter."""

    def experts(self, calls: tuple[Call, ...]) -> tuple[Outcome, ...]:
        """One outcome per call, in order; never raises."""
        ...

    def arbiter(self, request: ArbitrationRequest) -> Decision | None:
        """The arbiter's decision; None where it does not answer in time."""
        ...


def within_budget(calls: tuple[Call, ...], spent_ms: float) -> list[tuple[str, dict[str, object], float]]:
    """Each call with min(its deadline, what is left of the budget)."""
    left = max(LEAST_MS, BUDGET_MS - RESERVE_MS - spent_ms)
    return [(call.tool, call.arguments, min(call.deadline_ms, left)) for call in calls]


class Recorded:
    """Answers from a trace; questions that the log does not hold are answered `unavailable` and counted."""

    def __init__(self, trace: TraceRecord) -> None:
        self._outcomes = {(outcome.tool, rules_question.key(outcome.arguments)): outcome for outcome in trace.calls}
        self._decision = trace.decision if trace.request is not None and trace.decision.profile != "local" else None
        self.unknown: list[Call] = []

    def experts(self, calls: tuple[Call, ...]) -> tuple[Outcome, ...]:
        """What was answered then."""
        return tuple(self._outcome(call) for call in calls)

    def arbiter(self, request: ArbitrationRequest) -> Decision | None:
        """What was decided then."""
        return self._decision

    def _outcome(self, call: Call) -> Outcome:
        outcome = self._outcomes.get((call.tool, rules_question.key(call.arguments)))
        if outcome is None:
            self.unknown.append(call)
            return Outcome(tool=call.tool, status="unavailable", error="not in the log", arguments=call.arguments)
        return outcome
