"""What is decided where the arbiter does not answer: speak or be silent, by the arbiter's own rows. Never act."""

from domain.speech import Saying, being_heard, due, is_fresh
from proto.decision import ArbitrationRequest, Decision, SafetyMetrics
from proto.speech import Memory

PAUSE_S = 5.0
"""Between two messages that are no hazard: there is no attention budget here."""
HAZARD_REPEAT_S = 4.0
"""A standing hazard is told again after this time."""


def decide_locally(request: ArbitrationRequest, memory: Memory, now_ns: int) -> Decision:
    """Hazards and first notices are spoken; anything else if it is new, not muted, and some seconds have passed."""
    fused = request.fused
    alarm = fused.urgency == "alarm"
    speak, reason = due(
        Saying(
            fused=fused,
            hazard=fused.hazard,
            fresh_hazard=is_fresh(memory, fused.hazard, now_ns, HAZARD_REPEAT_S, alarm=alarm),
            being_heard=being_heard(memory, fused, now_ns, PAUSE_S),
        )
    )
    warns = speak and reason == "hazard"
    return Decision(
        tick=request.tick,
        kind="SPEAK" if speak else "SILENT",
        reason=f"without the arbiter: {reason}" + (f": {fused.hazard}" if warns else ""),
        metrics=SafetyMetrics(h=request.h),
        profile="local",
        hazard=fused.hazard if warns else "",
    )
