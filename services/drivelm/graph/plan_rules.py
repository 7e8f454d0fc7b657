"""What the graph says of motion, urgency and actions: small stated rules in DriveLM's words. Not what the car does:
targets and decisions come from fusion and arbitration, which never read these sentences."""

from collections.abc import Sequence
from math import hypot

from proto.perception import Track
from proto.scene import Fact
from proto.vehicle import Ego
from services.drivelm.vocabulary.classes import LIGHTS

MUST_STOP = 1
"""At this urgency and below, stopping is what the rules say."""
IN_WAY, ELEMENT, UNSURE = 2, 3, 4
"""Something in the way that is not near, a sign, and something not known well; the first and the last ask for less speed."""
NO_CONCERN = 9
ABSENT = 0.5
"""Score of what is said because nothing was seen: the eye may have missed it."""
_STILL_MPS = 0.7
_MOVES_MPS = 1.5
"""Between the two, a track's speed is not known well enough to say that it stands or moves."""
_NEAR_S = 4.0
_GENTLE_MPS2 = 3.5
"""A driver's firm but not hard braking; with it the probability after braking is told."""
_CROSSES_MPS = 2.0
_BRAKE_FOR = {"stop", "yield", "no_entry"} | {
    label for label in LIGHTS if label.startswith(("light:red", "light:amber"))
}


def status(track: Track) -> str:
    """DriveLM's status of an object; a track's speed is relative to the ego, so this is relative too."""
    return "Oncoming" if track.oncoming else "Crossing" if abs(track.vy_mps) > _CROSSES_MPS else "Leading"


def moves(track: Track, ego: Ego | None) -> bool | None:
    """Whether an object moves over ground; None where the ego's speed is not known or its own too close to none."""
    if ego is None or ego.speed_mps is None:
        return None
    speed_mps = hypot(ego.speed_mps + track.vx_mps, track.vy_mps)
    return True if speed_mps > _MOVES_MPS else False if speed_mps < _STILL_MPS else None


def moving(track: Track, ego: Ego | None) -> str:
    """How an object moves, seen from the ego."""
    if moves(track, ego) is False:
        return "Stopped."
    if track.oncoming:
        return "Coming towards the ego vehicle."
    if abs(track.vy_mps) > _CROSSES_MPS:
        return "Turn left." if track.vy_mps > 0 else "Turn right."
    if moves(track, ego) is None and track.vx_mps < -_STILL_MPS:
        return "Slower than the ego vehicle."
    return "Going ahead."


def future(track: Track, ego: Ego | None) -> str:
    """What it does next, if it goes on as it moves now."""
    now = moving(track, ego)
    return {"Stopped.": "Stationary.", "Turn left.": now, "Turn right.": now}.get(now, "Keep going straight.")


def urgency(track: Track | None, fact: Fact | None) -> int:
    """Rank among what to consider; lower is more urgent."""
    if track is not None:
        closing = track.x_m / -track.vx_mps if track.vx_mps < -_STILL_MPS else 1e9
        in_way = track.in_ego_path or track.kind != "vehicle"
        return 0 if in_way and closing < _NEAR_S else IN_WAY if in_way else NO_CONCERN
    if fact is None:
        return NO_CONCERN
    if not fact.believed:
        return UNSURE if fact.reading or fact.kind == "light" else ELEMENT
    return MUST_STOP if fact.reading in _BRAKE_FOR else ELEMENT


def stands(ego: Ego | None) -> bool:
    """Whether the ego is known to stand."""
    return ego is not None and ego.speed_mps is not None and ego.speed_mps < _STILL_MPS


def action(track: Track | None, fact: Fact | None, ego: Ego | None) -> str:
    """The most possible action in DriveLM's words."""
    if track is not None:
        return "Brake gently to a stop." if urgency(track, None) == 0 else "Keep going at the same speed."
    if fact is None or not fact.believed:
        return "Slow down slightly."
    if fact.reading in _BRAKE_FOR:
        return "Keep stationary." if stands(ego) else "Brake gently to a stop."
    if fact.kind == "limit" and fact.value is not None:
        return f"Keep to the speed limit of {fact.value:.0f} {fact.unit or ''}".rstrip() + "."
    return "Keep going at the same speed."


def action_and_reason(track: Track | None, fact: Fact | None, ego: Ego | None) -> str:
    """The action, why, and how probable, by urgency."""
    done = action(track, fact, ego).rstrip(".")
    reason = "to keep a safe distance" if track is not None else "to follow the traffic rules"
    rank = urgency(track, fact)
    probable = "high" if rank <= MUST_STOP else "medium" if rank < NO_CONCERN else "low"
    return f"The action is to {done[0].lower()}{done[1:]}. The reason is {reason}, and the probability is {probable}."


def colliding(track: Track, side: str) -> str:
    """Which action of the ego leads into an object."""
    if track.in_ego_path or side == "front":
        return "Accelerating and going straight."
    return f"Changing to the {side.removeprefix('front ')} lane."


def risk_going_on(track: Track) -> str:
    """How probable a collision is at the same speed straight on."""
    rank = urgency(track, None)
    return "High." if rank == 0 else "Low." if rank == NO_CONCERN else "Medium."


def risk_braking(track: Track) -> str:
    """How probable a collision is after braking: whether the closing speed is gone before the gap is."""
    closing_mps = max(0.0, -track.vx_mps)
    needed_m = closing_mps**2 / (2 * _GENTLE_MPS2)
    in_way = urgency(track, None) != NO_CONCERN
    return "High." if in_way and needed_m >= track.x_m - track.length_m / 2 else "Low."


def target(urgencies: Sequence[int]) -> str:
    """What the ego aims at, by what is most urgent of what is seen."""
    return (
        "Stationary." if min(urgencies) <= MUST_STOP else "Slow down." if _asks_for_less(urgencies) else "Keep going."
    )


def _asks_for_less(urgencies: Sequence[int]) -> bool:
    return IN_WAY in urgencies or UNSURE in urgencies


def safe(urgencies: Sequence[int], ego: Ego | None) -> str:
    """Actions without danger. Never a change of lane: what is beside and behind is not seen."""
    must_stop = min(urgencies) <= MUST_STOP
    if stands(ego) and (must_stop or _asks_for_less(urgencies)):
        return "Remain stationary."
    if must_stop:
        return "Brake gently to a stop, slow down."
    less = _asks_for_less(urgencies)
    return "Slow down slightly, keep a safe distance." if less else "Slow down slightly, keep going at the same speed."


def dangerous(urgencies: Sequence[int], sides: Sequence[str]) -> str:
    """Actions with danger: into what is ahead, into what is beside; and backing up, since nothing behind is seen."""
    ahead = ["accelerate and go ahead"] if min(urgencies) < NO_CONCERN else []
    beside = [f"change to the {way} lane" for way in ("left", "right") if f"front {way}" in sides]
    said = ", ".join([*ahead, *beside, "back up"])
    return f"{said[0].upper()}{said[1:]}."


def behavior(ego: Ego | None) -> tuple[str, float]:
    """How the ego moves now, and how sure that is."""
    if ego is None or ego.speed_mps is None:
        return "The behavior of the ego vehicle is not known.", 0.0
    turn = ego.yaw_rate_radps or 0.0
    way = "going straight" if abs(turn) < 0.03 else "steering to the left" if turn > 0 else "steering to the right"
    paces = ((_STILL_MPS, "not moving"), (8.0, "driving slowly"), (25.0, "driving with normal speed"))
    pace = next((words for below_mps, words in paces if ego.speed_mps < below_mps), "driving fast")
    return f"The ego vehicle is {way}. The ego vehicle is {pace}.", 1.0
