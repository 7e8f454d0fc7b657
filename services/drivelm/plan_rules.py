"""What the graph says of motion, urgency and actions: small stated rules in DriveLM's words. Not what the car does:
targets and decisions come from fusion and arbitration, which never read these sentences."""

from proto.perception import Track
from proto.scene import QA, Fact
from proto.vehicle import Ego
from services.drivelm.classes import LIGHTS

NO_CONCERN = 9
_STILL_MPS = 0.7
_NEAR_S = 4.0
_BRAKE_FOR = {"stop", "yield", "no_entry"} | {
    label for label in LIGHTS if label.startswith(("light:red", "light:amber"))
}


def status(track: Track) -> str:
    """DriveLM's status of an object; a track's speed is relative to the ego, so this is relative too."""
    return "Oncoming" if track.oncoming else "Crossing" if abs(track.vy_mps) > 2.0 else "Leading"


def moving(track: Track) -> str:
    """How an object moves, seen from the ego."""
    if track.oncoming:
        return "Coming towards the ego vehicle."
    if abs(track.vy_mps) > 2.0:
        return "Turn left." if track.vy_mps > 0 else "Turn right."
    if track.vx_mps < -_STILL_MPS:
        return "Slower than the ego vehicle."
    return "Going ahead."


def urgency(track: Track | None, fact: Fact | None) -> int:
    """Rank among what to consider; lower is more urgent."""
    if track is not None:
        closing = track.x_m / -track.vx_mps if track.vx_mps < -_STILL_MPS else 1e9
        in_way = track.in_ego_path or track.kind != "vehicle"
        return 0 if in_way and closing < _NEAR_S else 2 if in_way else NO_CONCERN
    if fact is None or not fact.believed:
        return 4 if fact is not None else NO_CONCERN
    return 1 if fact.reading in _BRAKE_FOR else 3


def action(track: Track | None, fact: Fact | None, ego: Ego | None) -> str:
    """The most possible action in DriveLM's words."""
    standing = ego is not None and ego.speed_mps is not None and ego.speed_mps < _STILL_MPS
    if track is not None:
        return "Brake gently to a stop." if urgency(track, None) == 0 else "Keep going at the same speed."
    if fact is None or not fact.believed:
        return "Slow down slightly."
    if fact.reading in _BRAKE_FOR:
        return "Keep stationary." if standing else "Brake gently to a stop."
    if fact.kind == "limit" and fact.value is not None:
        return f"Keep to the speed limit of {fact.value:.0f} {fact.unit or ''}".rstrip() + "."
    return "Keep going at the same speed."


def behavior(ego: Ego | None) -> QA:
    """How the ego moves now."""
    if ego is None or ego.speed_mps is None:
        answer, score = "The behavior of the ego vehicle is not known.", 0.0
    else:
        turn = ego.yaw_rate_radps or 0.0
        way = "going straight" if abs(turn) < 0.03 else "steering to the left" if turn > 0 else "steering to the right"
        pace = (
            "not moving"
            if ego.speed_mps < _STILL_MPS
            else "driving slowly"
            if ego.speed_mps < 8
            else "driving with normal speed"
        )
        pace = "driving fast" if ego.speed_mps > 25 else pace
        answer, score = f"The ego vehicle is {way}. The ego vehicle is {pace}.", 1.0
    return QA(layer="behavior", question="Predict the behavior of the ego vehicle.", answer=answer, score=score)
