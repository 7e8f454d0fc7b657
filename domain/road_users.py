"""Predicates over tracks of road users, each once. Every reader passes its own thresholds: the orchestrator those of its
advice, the arbiter those of its profile, so that the checker stays independent of what it checks.

Tracks are relative to the ego: x ahead, y to the left, m and m/s. A speed over ground is along the road; None: unknown.
"""

import math
from collections.abc import Sequence
from typing import NamedTuple

from domain import kinematics
from proto.perception import Track

STANDS_SLACK_MPS = 1.0
"""So much of a measured speed may be noise, at most."""


class Sight(NamedTuple):
    """From when on a track counts as well seen, as certain, as known."""

    young_s: float
    """Younger tracks may be ghosts of one picture."""
    lost_s: float
    """Tracks out of sight for longer are predictions."""
    certain: float
    """Confidence from which a track is certain."""
    known_s: float
    """Age from which a track is known."""


class Across(NamedTuple):
    """From when on a vehicle drives across the ego's way."""

    least_mps: float
    """Slower sideways a vehicle changes its lane, or is measured badly."""
    sigmas: float
    """A speed sideways of fewer standard deviations may be no motion at all."""


def seen_well(track: Track, sight: Sight) -> bool:
    """Whether a track is old enough and in sight. A vehicle that is seen again after a break, or where it was not expected, is as young
    as its sightings since: it may have been taken for another one."""
    since_s = track.steady_s if track.kind == "vehicle" and track.steady_s is not None else track.age_s
    return min(track.age_s, since_s) >= sight.young_s and track.unseen_s <= sight.lost_s


def crosses_over(track: Track, speed_mps: float | None, across: Across) -> bool:
    """Whether a vehicle drives across the way rather than along it; with an unknown speed, whether it moves sideways."""
    return abs(track.vy_mps) >= max(across.least_mps, abs(speed_mps or 0.0))


def surely_moves_across(track: Track, across: Across) -> bool:
    """Whether the speed sideways is more than measurement noise; where no deviation is stated, it is."""
    return track.sigma_vy_mps is None or abs(track.vy_mps) >= across.sigmas * track.sigma_vy_mps


def is_vehicle_there(track: Track, speed_mps: float | None, sight: Sight, across: Across) -> bool:
    """Whether a track that is called a vehicle is one: certain, or known for a while, or surely crossing, where no time is left.

    Two kinds are mistaken often, and must be certain as well as known. One is traffic that comes towards the ego in its own lane.
    The other is a vehicle beside the way that is in it only if its lateral speed is right. Other kinds are not judged here.
    """
    if track.kind != "vehicle":
        return True
    crosses, surely = crosses_over(track, speed_mps, across), surely_moves_across(track, across)
    certain, known = track.confidence >= sight.certain, track.age_s >= sight.known_s or (crosses and surely)
    aside = track.clearance_m is not None and track.clearance_m > 0.0
    doubtful = track.oncoming or (aside and crosses and not surely)
    return certain and known if doubtful else certain or known


def is_passed(track: Track, gap_m: float, speed_mps: float | None, *, stands_mps: float, across_mps: float) -> bool:
    """Whether the ego passes a vehicle beside its way that stands, comes towards it, or is alongside already and does not cross.

    `gap_m`: bumper to bumper, 0 or less alongside. An unknown speed passes only what is alongside or oncoming. A speed that may
    be measured by one standard deviation too high, `STANDS_SLACK_MPS` at most, is a standstill.
    """
    if track.kind != "vehicle" or track.clearance_m is None or track.clearance_m <= 0.0:
        return False
    alongside = gap_m <= 0.0 and abs(track.vy_mps) < across_mps
    slack_mps = min(max(0.0, track.sigma_vx_mps), STANDS_SLACK_MPS)
    stands = speed_mps is not None and math.hypot(max(0.0, abs(speed_mps) - slack_mps), track.vy_mps) < stands_mps
    return track.oncoming or alongside or stands


def hides_others(track: Track, gap_m: float, sight: Sight) -> bool:
    """Whether a road user is surely between the ego and what is farther away: certain and known, or seen without a break for five times
    as long. One that overlaps the ego is a mistake, and hides nothing."""
    steady_s = track.steady_s or 0.0
    sure = steady_s >= 5.0 * sight.known_s or (track.confidence >= sight.certain and track.age_s >= sight.known_s)
    return track.in_ego_path and gap_m > 0.0 and sure and seen_well(track, sight)


def shows_beyond_others(track: Track, sight: Sight) -> bool:
    """Whether a vehicle behind another one in the path is surely there all the same: certain, and known for twice as long."""
    return track.confidence >= sight.certain and track.age_s >= 2.0 * sight.known_s


def shrinking_mps(seen: Sequence[tuple[int, float]], least_s: float) -> float | None:
    """How fast a distance shrank over sightings (stamp in ns, m), oldest first; None: watched for less than `least_s`."""
    if not seen:
        return None
    (first_ns, first_m), (last_ns, last_m) = seen[0], seen[-1]
    seconds = (last_ns - first_ns) / 1e9
    return (first_m - last_m) / seconds if seconds >= least_s else None


def braking_needed_mps2(track: Track, gap_m: float, closing_mps: float, spare_m: float, ego_mps: float | None) -> float:
    """What braking keeps `spare_m` to a vehicle ahead that goes on braking as it does; of one that comes towards the ego, or at an
    unknown speed of the ego, as if that one never stood."""
    brakes_mps2 = max(0.0, -track.ax_mps2)
    if ego_mps is None or closing_mps > ego_mps:
        return kinematics.needed_mps2(closing_mps, gap_m - spare_m) + brakes_mps2
    return kinematics.needed_behind_mps2(gap_m - spare_m, ego_mps, ego_mps - closing_mps, brakes_mps2)


def least_gap_m(track: Track, gap_m: float) -> float:
    """A gap to a track, shorter by one sigma of its range where the camera's field of view is a guess."""
    return gap_m - track.range_spread * abs(track.x_m)
