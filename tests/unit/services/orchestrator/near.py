"""A state with road users near the ego."""

from typing import TypeVar

from proto.observed import Observed
from proto.perception import Track
from proto.world import EgoState, WorldState
from services.orchestrator.law import rules_question
from services.orchestrator.speech.candidates.candidates import candidates
from services.orchestrator.state import Held, State
from services.orchestrator.target.target import target
from tests.unit.services.orchestrator.support import START, limit_answer, replace

T = TypeVar("T")


def seen(*tracks: Track, speed_mps: float | None = 13.0) -> State:
    """A moment with these actors, on a road where the law allows much."""
    speed = None if speed_mps is None else observed(speed_mps)
    world = WorldState(stamp_ns=START, tick=60, ego=EgoState(speed_mps=speed), actors=observed(tracks))
    state = State(tick=60, now_ns=START, world=world)
    key = rules_question.key(rules_question.situation_arguments(state))
    return replace(state, held=Held(legal=limit_answer(130), legal_key=key, legal_ns=START))


def observed(value: T) -> Observed[T]:
    """Just now, and for sure."""
    return Observed(value=value, confidence=1.0, source="perception", stamp_ns=START, valid_for_ns=10**9)


def car(x_m: float, vx_mps: float, track_id: int = 1, **fields: object) -> Track:
    """A well-seen car in the path."""
    given = Track(
        track_id=track_id, kind="vehicle", x_m=x_m, y_m=0.0, vx_mps=vx_mps, vy_mps=0.0, confidence=0.9, age_s=2.0,
        sigma_x_m=0.3, sigma_vx_mps=0.3, length_m=4.5, in_ego_path=True,
    )  # fmt: skip
    return replace(given, **fields)


def hazards(state: State) -> set[str]:
    """What the driver would be warned of."""
    return {each.topic for each in candidates(state, target(state), ()) if each.hazard}
