"""The real arbiter under a grant, as a function that `Played` asks."""

from collections.abc import Callable

from proto.decision import ArbitrationRequest, Decision
from proto.speech import Memory
from services.arbiter.assessment.assess import View, gap_m
from services.arbiter.assessment.reading import Pedals, Reading
from services.arbiter.braking.act import Permission
from services.arbiter.decide import Inputs, decide, request_view
from services.arbiter.profiles.profile import load
from services.arbiter.state import ArbiterState, Attention, Sighting, fresh
from tests.unit.services.orchestrator.support import replace

PROFILE = load("calibrated")
GRANT = Permission(grant_id="g", max_deceleration_mps2=5.0, max_duration_s=3.0, refused="")


def arbiter(
    eyes: ArbitrationRequest | None = None, budget: float = PROFILE.budget_messages
) -> Callable[[ArbitrationRequest], Decision]:
    """The real decision under a grant; its own eyes see what `eyes` says, or what it is asked. Of the attention budget so much is
    left whenever it is asked."""

    memory = Memory()
    asked_ns: int | None = None

    def judge(request: ArbitrationRequest) -> Decision:
        nonlocal memory, asked_ns
        view = request_view(eyes if eyes is not None else request)
        pedals = Pedals(brake=0.0, accelerator=0.2, steering_rad=0.0)
        reading = Reading(view=view, pedals=pedals, tracks_age_s=0.05, ego_age_s=0.02)
        left = Attention(messages=budget, refilled_ns=asked_ns)
        state = replace(watched(view, request.stamp_ns), attention=left, memory=memory)
        inputs = Inputs(reading=reading, state=state, permission=GRANT, now_ns=request.stamp_ns)
        verdict = decide(request, inputs, PROFILE)
        memory, asked_ns = verdict.state.memory, request.stamp_ns
        return verdict.decision

    return judge


def watched(view: View, now_ns: int) -> ArbiterState:
    """As if the arbiter had watched everyone close in for half a second."""
    sightings = tuple(
        Sighting(track_id=t.track_id, gap_m=gap_m(t, PROFILE) - t.vx_mps * 0.5, stamp_ns=now_ns - 550_000_000)
        for t in view.actors
    )
    return replace(fresh(PROFILE), sightings=sightings)
