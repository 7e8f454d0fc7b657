"""What must hold before the arbiter brakes: every rule is a row, every row that fails is named."""

from collections.abc import Callable

import msgspec

from proto.decision import ArbitrationRequest
from proto.perception import Track
from services.arbiter.assessment.assess import Numbers, View, act_bounds, measure
from services.arbiter.assessment.reading import Reading
from services.arbiter.braking.watching import shrinks
from services.arbiter.profiles.profile import Profile
from services.arbiter.state import Sighting

SEEING = frozenset({"perception/tracks", "perception", "can/ego", "can", "snapshot"})
"""Degradations under which nothing may rest on sight or motion."""


class Case(msgspec.Struct, frozen=True, kw_only=True):
    """All that the rows look at: the request, the arbiter's own reading, and the worst undoubted actor that both have."""

    request: ArbitrationRequest
    reading: Reading
    seen: tuple[bool, bool]
    """Whether request and own reading have any undoubted actor."""
    asked: Numbers | None
    own: Numbers | None
    """The same actor in both: the pair of highest risk."""
    watched: bool
    """Whether the arbiter saw the gap to that actor shrink."""
    c_min: float
    profile: Profile


def case(
    request: ArbitrationRequest,
    asked: View,
    reading: Reading,
    c_min: float,
    sightings: tuple[Sighting, ...],
    profile: Profile,
) -> Case:
    """Measure both views at the bounds for ACT, doubted actors left out, and pick whom both see worst.

    Actors are taken in pairs, one from each view: a further actor in either can only add a reason to brake, so that
    losing sight of one never enables ACT.
    """
    theirs, ours = _undoubted(asked, profile), _undoubted(reading.view, profile)
    pairs = [(a, o) for a in theirs for o in ours if abs(a.gap_m - o.gap_m) <= profile.act_disagree_m]
    pair = max(pairs, key=lambda p: (p[0].rss_viol and p[1].rss_viol, min(p[0].r, p[1].r)), default=None)
    return Case(
        request=request,
        reading=reading,
        seen=(bool(theirs), bool(ours)),
        asked=pair[0] if pair is not None else None,
        own=pair[1] if pair is not None else None,
        watched=pair is not None and shrinks(sightings, pair[1].track.track_id, -pair[1].track.vx_mps, profile),
        c_min=c_min,
        profile=profile,
    )


def undoubted(track: Track, profile: Profile) -> bool:
    """Seen now, for long enough, without a break, surely enough to brake for, by a camera that is known, and surely in the way."""
    return (
        track.steady_s is not None
        and track.steady_s > 0.0
        and track.confidence >= profile.act_confidence
        and track.unseen_s <= profile.act_unseen_s
        and track.age_s >= profile.act_track_age_s
        and track.sigma_vx_mps <= profile.speed_known_mps
        and not track.range_spread
        and not track.oncoming
        and meets(track, profile)
    )


def meets(track: Track, profile: Profile) -> bool:
    """Whether its body and the ego's would meet, as far aside as it may be; a person is braked for beside the way too."""
    if track.kind != "vehicle" or track.clearance_m is None:
        return True
    return track.clearance_m + track.sigma_y_m <= -profile.act_overlap_m


def may_still_halt(track: Track, profile: Profile) -> bool:
    """Whether a person on foot beside the way has room to halt before it, one standard deviation spared."""
    if track.kind != "pedestrian" or track.clearance_m is None:
        return False
    needed_m = track.vy_mps * track.vy_mps / (2.0 * profile.person_stops_mps2)
    return track.clearance_m - track.sigma_y_m - needed_m > profile.act_overlap_m


def _undoubted(view: View, profile: Profile) -> tuple[Numbers, ...]:
    bounds = act_bounds(view, profile)
    return tuple(measure(t, view, bounds, profile) for t in view.actors if t.x_m > 0.0 and undoubted(t, profile))


def _young(age_s: float | None, limit_s: float) -> bool:
    return age_s is not None and abs(age_s) <= limit_s


ROWS: tuple[tuple[str, Callable[[Case], bool]], ...] = (
    ("a routed tool timed out", lambda c: not c.request.tool_timed_out),
    ("the tick is degraded in what it sees", lambda c: not SEEING & set(c.request.degraded)),
    ("the advice is less sure than c_min", lambda c: c.request.fused.confidence >= c.c_min),
    ("the ego's motion is unknown to the orchestrator", lambda c: _moving_known(c.request)),
    ("no undoubted actor in the request", lambda c: c.seen[0]),
    ("no RSS violation in the request at the upper bound of friction", lambda c: _violates(c.asked)),
    ("own tracks are missing or stale", lambda c: _young(c.reading.tracks_age_s, c.profile.act_reading_age_s)),
    ("own ego reading is missing or stale", lambda c: _young(c.reading.ego_age_s, c.profile.act_reading_age_s)),
    ("the ego's motion is unknown to the arbiter", lambda c: _view_moving(c.reading.view)),
    ("no undoubted actor in the arbiter's own reading", lambda c: c.seen[1]),
    ("no RSS violation in the arbiter's own reading at the upper bound of friction", lambda c: _violates(c.own)),
    ("the arbiter has not seen the gap shrink itself", lambda c: c.own is None or c.watched),
    ("request and own reading disagree on the gap", lambda c: not all(c.seen) or c.own is not None),
)
"""(what is wrong if it does not hold, whether it holds)."""
RSS_ROWS = frozenset(
    {
        "no RSS violation in the request at the upper bound of friction",
        "no RSS violation in the arbiter's own reading at the upper bound of friction",
    }
)
BEGINS = RSS_ROWS | {"a routed tool timed out", "the advice is less sure than c_min"}
"""Rows that bear on the beginning alone: they do not say that a danger under way is over."""


def lasting_objections(c: Case) -> tuple[str, ...]:
    """Why an intervention under way may not go on; empty: it may."""
    return tuple(text for text, holds in ROWS if text not in BEGINS and not holds(c))


def is_read(c: Case) -> bool:
    """Whether the arbiter's own pictures and ego are fresh, and nothing that sees is degraded."""
    ages = (c.reading.tracks_age_s, c.reading.ego_age_s)
    return all(_young(age, c.profile.act_reading_age_s) for age in ages) and not SEEING & set(c.request.degraded)


def emergency_objections(c: Case) -> tuple[str, ...]:
    """Why the arbiter may not brake hard; empty: it may. RSS is violated at the last moment, with the braking that it counts on."""
    return tuple(text for text, holds in ROWS if text not in RSS_ROWS and not holds(c))


def objections(c: Case) -> tuple[str, ...]:
    """Why the arbiter may not brake; empty: it may."""
    return tuple(text for text, holds in ROWS if not holds(c))


def _violates(numbers: Numbers | None) -> bool:
    return numbers is not None and numbers.rss_viol


def _moving_known(request: ArbitrationRequest) -> bool:
    return request.ego_speed_mps is not None and request.ego_acceleration_mps2 is not None


def _view_moving(view: View) -> bool:
    return view.ego_speed_mps is not None and view.ego_acceleration_mps2 is not None
