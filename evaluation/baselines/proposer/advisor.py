"""The proposer as an advisor: `orchestrator.method=proposer`. For the evaluation.

Events, tools and arbiter are those of production. What they come to is not our fusion, but the parsed answer to one prompt, which
holds the scene and what the tools have answered: the paper's vision-language model that fuses. The arbiter stands behind it; with
`arbiter.filter=none` its advice passes unjudged.
"""

from collections.abc import Mapping

import msgspec

from drivemcp.errors import ConfigError
from evaluation.baselines.direct import advise
from evaluation.baselines.direct.advise import QUERIES, DirectSettings, Experts
from evaluation.baselines.proposer.told import told
from proto.decision import Event
from services.orchestrator.advisor import Advised, Tools, consulted
from services.orchestrator.experts.ask import Ask
from services.orchestrator.observations.inputs import Method, Observations
from services.orchestrator.state import State

EXPERT_QUERIES: Mapping[str, str] = {
    "overspeed": "The ego vehicle is faster than the speed limit: how fast may it drive?",
    "vehicle_fault": "Is something wrong with the car?",
    "low_friction": "Is the grip of the road low?",
}
"""What only experts tell of, and so what the Direct methods do not ask about."""


class ProposerSettings(DirectSettings, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """`orchestrator.method_settings` of the proposer."""

    @property
    def queries(self) -> Mapping[str, str]:
        """Those of the Direct methods, then what only experts tell of."""
        return {**QUERIES, **EXPERT_QUERIES}


class Proposer(Tools):
    """The experts are asked as under fusion, one prompt is answered with what they say, and the arbiter decides.

    A driver's question goes to the tools.
    """

    def __init__(self, method: Method) -> None:
        try:
            self._settings = msgspec.convert(method.settings, ProposerSettings)
        except msgspec.ValidationError as error:
            raise ConfigError(f"orchestrator.method_settings of 'proposer': {error}") from None

    def advise(self, state: State, before: State, events: tuple[Event, ...], seen: Observations, ask: Ask) -> Advised:
        """Ask the experts, then for the gravest that is new; hear what has come, and put it into words."""
        found = consulted(state, before, events, seen, ask)
        experts = Experts(told(found.state), max((each.elapsed_ms for each in found.outcomes), default=0.0))
        advised = advise.advise(found.state, found.now, seen, self._settings, ask, experts)
        return advised._replace(
            events=found.events,
            calls=(*found.calls, *advised.calls),
            outcomes=(*found.outcomes, *advised.outcomes),
            failed=found.failed,
        )
