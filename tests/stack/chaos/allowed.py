"""What the truth allows: the target that the road itself bears, without weather, car or doubt."""

import math
from collections.abc import Iterator

from proto.truth import TrueActor, Truth
from services.orchestrator.target.target import GAP_TIME_S, HEADWAY_S, STANDSTILL_M, UNLIMITED_MPS
from services.orchestrator.world.actors import EGO_HALF_M, LOOK_AHEAD_M, NEAR_PATH_M, WITHIN_S
from services.orchestrator.world.giving_way import READY_MPS
from services.orchestrator.world.stops import PERSON_M, Stop
from services.orchestrator.world.stops import STANDSTILL_M as BEFORE_LINE_M


def allowed_mps(truth: Truth) -> float:
    """The least of the true limit and of what the true road users and lines ahead ask for."""
    law_mps = UNLIMITED_MPS if truth.law_limit_mps is None else truth.law_limit_mps
    return min(law_mps, *_lines(truth), *(mps for actor in truth.actors for mps in _actor(truth, actor)))


def _lines(truth: Truth) -> Iterator[float]:
    yield math.inf
    if truth.stop_kind == "yield":
        yield READY_MPS
    elif truth.stop_kind and truth.stop_distance_m is not None:
        yield Stop(truth.stop_kind, truth.stop_distance_m - BEFORE_LINE_M, 1.0).approach_mps()


def _actor(truth: Truth, actor: TrueActor) -> Iterator[float]:
    gap_m = actor.x_m - actor.length_m / 2.0 - EGO_HALF_M
    if not 0.0 < actor.x_m < LOOK_AHEAD_M:
        return
    if actor.kind == "pedestrian" and (actor.in_ego_path or _steps_in(actor)):
        yield Stop("person", gap_m - PERSON_M, 1.0).approach_mps()
    speed_mps = truth.speed_mps + actor.vx_mps
    if actor.kind == "vehicle" and actor.in_ego_path and speed_mps > -1.0:
        along_mps = max(0.0, speed_mps)
        yield max(0.0, along_mps + (gap_m - STANDSTILL_M - HEADWAY_S * along_mps) / GAP_TIME_S)


def _steps_in(person: TrueActor) -> bool:
    """Whether a person beside the path walks towards it and is there soon."""
    towards = person.vy_mps * person.y_m < 0.0
    return towards and abs(person.y_m) - WITHIN_S * abs(person.vy_mps) < NEAR_PATH_M / 2.0
