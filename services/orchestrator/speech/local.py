"""What is decided where the arbiter does not answer: speak or be silent, by rules that need no numbers. Never act."""

from proto.decision import ArbitrationRequest, Decision, SafetyMetrics

PAUSE_S = 5.0
"""Between two messages that are no hazard."""
HAZARD_PAUSE_S = 2.0


def decide_locally(request: ArbitrationRequest) -> Decision:
    """Hazards and first notices are spoken; anything else if it is new, not muted, and some seconds have passed."""
    fused, since_s, hazard = request.fused, request.seconds_since_spoken, ""
    paused = since_s is None or since_s >= PAUSE_S
    if fused.hazard and (fused.new_information or since_s is None or since_s >= HAZARD_PAUSE_S):
        kind, reason, hazard = "SPEAK", f"hazard: {fused.hazard}", fused.hazard
    elif fused.first_notice:
        kind, reason = "SPEAK", "first notice"
    elif fused.directive and fused.new_information and not fused.muted and paused:
        kind, reason = "SPEAK", "new advice"
    else:
        kind, reason = "SILENT", "nothing new, muted, or just spoken"
    return Decision(
        tick=request.tick,
        kind="SPEAK" if kind == "SPEAK" else "SILENT",
        reason=f"without the arbiter: {reason}",
        metrics=SafetyMetrics(h=request.h),
        profile="local",
        hazard=hazard,
    )
