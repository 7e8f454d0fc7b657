"""Whether the danger of an intervention under way is still there: what began it may be over before the danger is.

RSS and time to collision ease while the car brakes, because it does. What counts here is the gap that is left.
"""

import math

import msgspec

from proto.perception import Track
from services.arbiter.assessment.assess import Numbers
from services.arbiter.braking.guard import (
    DOUBTS,
    Case,
    drives_across,
    in_way_s,
    is_read,
    lasting_objections,
    may_still_halt,
    undoubted,
)
from services.arbiter.profiles.profile import Profile
from services.arbiter.state import Intervention

STILL_MPS = 0.3
"""Slower than this the car stands."""
NEAR_M = 4.0
"""Nearer ahead a picture cuts boxes off, and their ranges and speeds leap."""
BLIND_NS = 1_500_000_000
"""So long braking to standstill goes on without a good sighting."""
UNSEEN_ACROSS_NS = 2_500_000_000
"""So long braking for a vehicle that drives across goes on without one, and no longer than that vehicle takes to be through."""
DOUBTED_NS = 500_000_000
"""So long braking goes on for a road user that is surely there and whose range or speed leaps."""


def stands(ego_mps: float | None) -> bool:
    """Whether the car stands; an unknown speed is no standstill."""
    return ego_mps is not None and ego_mps < STILL_MPS


def lasts(case: Case, running: Intervention, run_ns: int, profile: Profile) -> bool:
    """Whether the danger is still there: a road user that both views see, and to which the gap closes. Not at standstill."""
    ego_mps = case.reading.view.ego_speed_mps
    if ego_mps is None or stands(ego_mps):
        return False
    return (
        _closing(case) is not None
        or _is_before_bumper(case, running, ego_mps, run_ns, profile)
        or _comes_unseen(case, running, run_ns, profile)
        or _leaps(case, running, run_ns, profile)
    )


def sighted(running: Intervention, before: Intervention, case: Case, run_ns: int, profile: Profile) -> Intervention:
    """The intervention with where the standing road user is: as seen now, or as seen last and less by the way driven since."""
    ego_mps = case.reading.view.ego_speed_mps
    if running.since_ns is None or ego_mps is None:
        return running
    if (own := _closing(case)) is not None:
        across = drives_across(own.track, profile, gives_way=case.gives_way)
        return msgspec.structs.replace(
            running,
            track_id=own.track.track_id,
            sighted_ns=run_ns,
            stood_m=own.gap_m if is_standing(own, ego_mps, profile) and not across else None,
            through_ns=run_ns + round(in_way_s(own.track, profile)[1] * 1e9) if across else None,
        )
    left_m = before.stood_m
    if left_m is not None and before.last_ns is not None:
        left_m -= ego_mps * (run_ns - before.last_ns) / 1e9
    return msgspec.structs.replace(
        running, track_id=before.track_id, sighted_ns=before.sighted_ns, stood_m=left_m, through_ns=before.through_ns
    )


def is_standing(own: Numbers, ego_mps: float, profile: Profile) -> bool:
    """Whether a road user stands, or hardly moves, over ground."""
    return ego_mps + own.track.vx_mps < profile.stands_mps


def _closing(case: Case) -> Numbers | None:
    """The road user that both views see well, and to which the gap still closes."""
    own = case.own
    return own if own is not None and own.track.vx_mps < 0.0 and not lasting_objections(case) else None


def _comes_unseen(case: Case, running: Intervention, run_ns: int, profile: Profile) -> bool:
    """Whether a vehicle that drives across has left the pictures sideways, and at its speed is not through yet.

    One that is still seen, or seen again for some pictures, is judged by what is seen. Pictures and ego have to be fresh here as well.
    """
    if running.through_ns is None:
        return False
    seen = any(
        track.track_id == running.track_id
        and track.unseen_s <= profile.act_unseen_s
        and (track.steady_s or 0.0) >= profile.act_track_age_s
        for track in (*case.reading.view.actors, *case.reading.neighbours)
    )
    lately = run_ns < running.through_ns and run_ns - running.sighted_ns <= UNSEEN_ACROSS_NS
    return not seen and lately and is_read(case)


def _leaps(case: Case, running: Intervention, run_ns: int, profile: Profile) -> bool:
    """Whether both views still see the road user in the way, surely enough to brake for, and only its measured motion is doubted."""

    def is_there(track: Track) -> bool:
        steady = msgspec.structs.replace(track, steady_s=math.inf, sigma_vx_mps=min(0.0, track.sigma_vx_mps))
        closes = track.track_id == running.track_id and track.vx_mps < 0.0
        return closes and not may_still_halt(track, profile) and undoubted(steady, profile, gives_way=case.gives_way)

    lately = run_ns - running.sighted_ns <= DOUBTED_NS and DOUBTS.issuperset(lasting_objections(case))
    return lately and all(any(map(is_there, actors)) for actors in case.actors)


def _is_before_bumper(case: Case, running: Intervention, ego_mps: float, run_ns: int, profile: Profile) -> bool:
    """Whether what stood right ahead must still be there though no picture shows it well: so near, measurements leap.

    Pictures and ego have to be fresh: neither silence nor a stale reading prolongs an intervention.
    """
    return (
        running.stood_m is not None
        and -profile.d0_m < running.stood_m <= NEAR_M
        and ego_mps <= profile.crawl_mps
        and run_ns - running.sighted_ns <= BLIND_NS
        and is_read(case)
    )
