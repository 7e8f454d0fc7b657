"""A turn at a junction ends the limits of the road that is left; a bend of the road does not."""

import math

import msgspec

from services.orchestrator.observations.validity import Motion
from services.orchestrator.signs.limits import changed, ended
from services.orchestrator.state import Signs

TURN_RAD = math.radians(50.0)
JUNCTION_NEAR_M = 15.0
JUNCTION_BEHIND_M = 25.0
"""A turn from near a junction to so far behind it is a turn at the junction."""
OTHER_JUNCTION_M = 20.0
"""A junction reported so much farther than the one that was near is another one."""


def turned_off(signs: Signs, motion: Motion, now_ns: int) -> Signs:
    """The limits after a tick near a junction: what was posted on the road that the ego left there ends."""
    signs = _near_junction(signs, motion)
    if not signs.near_junction:
        return signs
    # A car that stands does not turn, whatever its yaw rate drifts to.
    turned = signs.turned_rad + (motion.turned_rad if motion.travelled_m > 0.0 else 0.0)
    if abs(turned) < TURN_RAD:
        return msgspec.structs.replace(signs, turned_rad=turned)
    cleared = changed(signs, now_ns, permanent=None, conditional=(), ended=ended(signs, "junction"))
    return msgspec.structs.replace(cleared, near_junction=False, turned_rad=0.0, junction_m=0.0)


def _near_junction(signs: Signs, motion: Motion) -> Signs:
    """The junction that is near, by the way travelled since it came near: what the map says of it may stand still."""
    known = signs.junction_m - motion.travelled_m
    reported = motion.junction_m if motion.junction_m is not None else math.inf
    near = -JUNCTION_BEHIND_M <= reported <= JUNCTION_NEAR_M
    still = signs.near_junction and known >= -JUNCTION_BEHIND_M
    if near and (not still or reported >= known + OTHER_JUNCTION_M):
        return msgspec.structs.replace(signs, near_junction=True, junction_m=reported, turned_rad=0.0)
    if still:
        return msgspec.structs.replace(signs, junction_m=min(known, reported) if near else known)
    return msgspec.structs.replace(signs, near_junction=False, junction_m=0.0, turned_rad=0.0)
