"""The floor: everything runs and is logged, nothing is said and nothing brakes. `orchestrator.method=silent`."""

from proto.decision import ArbitrationRequest, Decision, SafetyMetrics
from services.orchestrator.advisor import Tools
from services.orchestrator.experts.ask import Ask
from services.orchestrator.state import State


class SilentAdvisor(Tools):
    """Advises as `tools` does; the advice is never spoken."""

    def decide(self, request: ArbitrationRequest, state: State, ask: Ask) -> Decision:
        """SILENT."""
        return silent(request)


def silent(request: ArbitrationRequest) -> Decision:
    """Nothing, whatever is advised: the driver drives as without an assistant (the evaluation's floor)."""
    return Decision(
        tick=request.tick,
        kind="SILENT",
        reason="the assistant is off",
        metrics=SafetyMetrics(h=request.h),
        profile="local",
    )
