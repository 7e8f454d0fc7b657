"""All methods on identical recorded snapshots: what each would have noticed, asked, decided and said, and how long it took.

Nothing that is advised changes the drive. Rules, retrieval and the front end's prompts are asked anew, of the real services
on a bus of this process; weather and car answer as the log has it. The arbiter decides by its own logged reading.
"""

import time
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import msgspec

from app.replay.again import traces
from drivemcp.bus.session import Bus, open_bus
from drivemcp.config import BusConfig, ServiceConfig
from drivemcp.errors import UserError
from drivemcp.node import Node
from drivemcp.registry import load_service
from evaluation.run.methods import Method
from proto.decision import ArbitrationRequest, Decision, TraceRecord
from proto.services import BY_NAME
from proto.tools import Outcome
from services.arbiter.decide import Inputs, decide
from services.arbiter.profiles import profile
from services.arbiter.profiles.profile import Profile
from services.arbiter.service import ArbiterConfig
from services.arbiter.state import ArbiterState, fresh
from services.orchestrator.experts.ask import Recorded, within_budget
from services.orchestrator.experts.routing import Call
from services.orchestrator.observations.inputs import Method as How
from services.orchestrator.observations.inputs import Observations
from services.orchestrator.service import OrchestratorConfig
from services.orchestrator.state import State
from services.orchestrator.tick import tick

LIVE = ("retrieval", "rules", "drivelm")
"""Services whose answers depend on the question alone."""


class Answered(msgspec.Struct, frozen=True, kw_only=True):
    """What a method makes of one snapshot."""

    tick: int
    stamp_ns: int
    events: tuple[str, ...]
    tools: tuple[str, ...]
    """Asked in this tick."""
    answered: tuple[str, ...]
    """Tools that gave an answer."""
    kind: str
    directive: str
    target_mps: float | None
    latency_ms: float
    """Measured on this machine, from the observations to the advisory; answers out of the log cost what is logged (`waited_ms`)."""


def answers(log: Path | Sequence[Path], method: Method) -> Iterator[Answered]:
    """Every tick of a log by a method, in order, from the first.

    Raises UserError where the method needs a drive of its own, a tick is missing or does not fit this version, and what a service
    raises that refuses its settings.
    """
    if method.stand_ins:
        raise UserError(f"{method.label} needs a drive of its own: a log holds what was perceived, not what was true")
    with open_bus(BusConfig(mode="peer")) as bus:
        nodes = [_start(bus, name, method) for name in LIVE if name not in method.without]
        asker = Node(bus, "evaluation", ServiceConfig())
        try:
            asker.open(announce=False)
            asker.client.discover()
            yield from _ticks([log] if isinstance(log, Path) else log, method, asker)
        finally:
            for node in (asker, *reversed(nodes)):
                node.close()


def _start(bus: Bus, name: str, method: Method) -> Node:
    service = load_service(name)
    return service.start(bus, msgspec.convert(dict(method.settings.get(name, {})), service.config))


def _ticks(logs: Sequence[Path], method: Method, asker: Node) -> Iterator[Answered]:
    config = msgspec.convert(dict(method.settings.get("orchestrator", {})), OrchestratorConfig)
    how = How(name=config.method, settings=config.method_settings)
    arbiter, state = OpenArbiter(method), State()
    for number, (log, trace) in enumerate(_traces(logs), start=1):
        if trace.tick != number:
            raise UserError(f"{log}: tick {number} is missing: what came after it cannot be told open loop")
        ask = OpenAsk(trace, asker, arbiter, parallel=config.parallel)
        try:
            seen = msgspec.structs.replace(msgspec.convert(trace.inputs, Observations), method=how)
            began_s = time.perf_counter()
            ticked = tick(state, seen, ask)
        except msgspec.ValidationError as error:
            raise UserError(f"{log}: tick {number} does not fit this version: {error}; drive it anew") from None
        took_ms = (time.perf_counter() - began_s) * 1e3 + ask.waited_ms
        state = ticked.state
        yield Answered(
            tick=trace.tick,
            stamp_ns=trace.stamp_ns,
            events=tuple(event.kind for event in ticked.events),
            tools=tuple(call.tool for call in ticked.calls),
            answered=tuple(outcome.tool for outcome in ticked.outcomes if outcome.ok),
            kind=ticked.decision.kind,
            directive=ticked.advisory.directive if ticked.decision.kind != "SILENT" else "",
            target_mps=ticked.advisory.target_mps,
            latency_ms=took_ms,
        )


def _traces(logs: Sequence[Path]) -> Iterator[tuple[Path, TraceRecord]]:
    for log in logs:
        for trace in traces([log]):
            yield log, trace


def waited_ms(live_ms: float, logged_ms: Sequence[float], *, parallel: bool) -> float:
    """What calls out of the log add to the live ones of the same tick: side by side only what the slowest of them takes longer."""
    return max(0.0, max(logged_ms, default=0.0) - live_ms) if parallel else sum(logged_ms)


class OpenArbiter:
    """The arbiter with the method's profile and filter; its state goes on from tick to tick."""

    def __init__(self, method: Method) -> None:
        self._config = msgspec.convert(dict(method.settings.get("arbiter", {})), ArbiterConfig)
        self.profile: Profile = profile.load(self._config.profile)
        self._state: ArbiterState = fresh(self.profile)

    def decide(self, request: ArbitrationRequest, logged: Decision) -> Decision | None:
        """By the reading that the log has of this tick; None where it has none."""
        if not logged.own:
            return None
        inputs = msgspec.convert(logged.own, Inputs)
        inputs = msgspec.structs.replace(inputs, state=self._state, filter=self._config.filter)
        verdict = decide(request, inputs, self.profile)
        self._state = verdict.state
        return verdict.decision


class OpenAsk:
    """Live services for what depends on the question alone, the log for the rest."""

    def __init__(self, trace: TraceRecord, asker: Node, arbiter: OpenArbiter, *, parallel: bool) -> None:
        self._trace, self._asker, self._arbiter, self._parallel = trace, asker, arbiter, parallel
        self._recorded = Recorded(trace)
        self.waited_ms = 0.0
        """What answers out of the log would have made the tick longer by."""

    def experts(self, calls: tuple[Call, ...]) -> tuple[Outcome, ...]:
        """One outcome per call, in order."""
        began_s = time.perf_counter()
        live = [call for call in calls if call.tool in TOOLS]
        batches = [live] if self._parallel else [[call] for call in live]
        asked: list[Any] = [
            each for batch in batches for each in self._asker.call_all(within_budget(tuple(batch), 0.0))
        ]
        live_ms = (time.perf_counter() - began_s) * 1e3
        logged = self._recorded.experts(tuple(call for call in calls if call.tool not in TOOLS))
        self.waited_ms += waited_ms(live_ms, [outcome.elapsed_ms for outcome in logged], parallel=self._parallel)
        answered, told = iter(asked), iter(logged)
        return tuple(self._with(next(answered), call) if call.tool in TOOLS else next(told) for call in calls)

    def arbiter(self, request: ArbitrationRequest) -> Decision | None:
        """The open arbiter's word."""
        return self._arbiter.decide(request, self._trace.decision)

    def _with(self, outcome: Outcome, call: Call) -> Outcome:
        return msgspec.structs.replace(outcome, arguments=call.arguments)


TOOLS = frozenset(tool for name in LIVE for tool in BY_NAME[name].tools)
