"""The Direct methods as an advisor: `orchestrator.method=direct`."""

import msgspec

from drivemcp.errors import ConfigError
from evaluation.baselines.direct import advise
from evaluation.baselines.direct.answer import direct_answer
from proto.decision import ArbitrationRequest, Decision, Event
from services.orchestrator.advisor import Advised
from services.orchestrator.driver.answer import Answer
from services.orchestrator.experts.ask import Ask
from services.orchestrator.observations.inputs import Method, Observations
from services.orchestrator.speech.local import decide_locally
from services.orchestrator.state import State
from services.orchestrator.text import plain


class DirectAdvisor:
    """The front end answers a prompt per event; its parsed answer is the advice. The arbiter is not asked."""

    def __init__(self, method: Method) -> None:
        try:
            self._settings = msgspec.convert(method.settings, advise.DirectSettings)
        except msgspec.ValidationError as error:
            raise ConfigError(f"orchestrator.method_settings of 'direct': {error}") from None

    def advise(self, state: State, before: State, events: tuple[Event, ...], seen: Observations, ask: Ask) -> Advised:
        """Ask for the gravest that is new, hear what has come, and put it into words."""
        return advise.advise(state, events, seen, self._settings, ask)

    def decide(self, request: ArbitrationRequest, state: State, ask: Ask) -> Decision:
        """The local rule, which never acts."""
        return decide_locally(request, state.memory, state.now_ns)

    def answer(self, question: str, state: State, ask: Ask) -> Answer:
        """The front end's answer to the prompt."""
        return direct_answer(plain(question, 400), state, self._settings, ask)
