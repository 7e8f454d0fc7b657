"""What must hold before the arbiter brakes: every rule is a row, every row that fails is named."""

from collections.abc import Callable

import msgspec

from domain.road_users import surely_moves_across
from proto.decision import ArbitrationRequest
from proto.messages import Kind
from proto.perception import Track
from services.arbiter.assessment.assess import Numbers, View, act_bounds, measure
from services.arbiter.assessment.reading import Reading
from services.arbiter.braking.own_hazards import across
from services.arbiter.braking.watching import shrinks
from services.arbiter.profiles.profile import Profile
from services.arbiter.state import ArbiterState

SEEING = frozenset({"perception/tracks", "perception", "can/ego", "can", "snapshot"})
"""Degradations under which nothing may rest on sight or motion."""

GIVES_WAY_NS = 30_000_000_000
"""For so long a word to give way counts: the way to the place, and the wait there."""


class Case(msgspec.Struct, frozen=True, kw_only=True):
    """All that the rows look at: the request, the arbiter's own reading, and the worst undoubted actor that both have."""

    request: ArbitrationRequest
    reading: Reading
    seen: tuple[bool, bool]
    """Whether request and own reading have any undoubted actor."""
    actors: tuple[tuple[Track, ...], tuple[Track, ...]]
    """All actors of the request and of the own reading."""
    asked: Numbers | None
    own: Numbers | None
    """The same actor in both: the pair of highest risk."""
    watched: bool
    """Whether the arbiter saw the gap to that actor shrink."""
    gives_way: bool
    """Whether the driver was told to give way so lately that the place is ahead: a vehicle from the side may count on that."""
    c_min: float
    profile: Profile
    due: bool = False
    """Whether braking may begin for that actor."""


def case(
    request: ArbitrationRequest,
    asked: View,
    reading: Reading,
    state: ArbiterState,
    profile: Profile,
    due: Callable[[Case], bool],
    now_ns: int,
) -> Case:
    """Measure both views at the bounds for ACT, doubted actors left out, and pick the pair of the highest risk, `due` ones first.

    Actors are taken in pairs, one from each view: a further actor in either can only add a reason to brake, so that
    losing sight of one never enables ACT.
    """
    told = state.memory.last(Kind.GIVE_WAY)
    gives_way = told is not None and now_ns - told.stamp_ns <= GIVES_WAY_NS
    theirs, ours = (_undoubted(view, profile, gives_way=gives_way) for view in (asked, reading.view))
    unpaired = Case(
        request=request, reading=reading, seen=(bool(theirs), bool(ours)), actors=(asked.actors, reading.view.actors),
        asked=None, own=None, watched=False, gives_way=gives_way, c_min=state.adapted.c_min, profile=profile,
    )  # fmt: skip
    pairs = (
        msgspec.structs.replace(
            unpaired, asked=a, own=o, watched=shrinks(state.sightings, o.track.track_id, -o.track.vx_mps, profile)
        )
        for a in theirs
        for o in ours
        if abs(a.gap_m - o.gap_m) <= profile.act_disagree_m
    )
    judged = (msgspec.structs.replace(pair, due=due(pair)) for pair in pairs)
    return max(judged, key=lambda pair: (pair.due, *_risk(pair)), default=unpaired)


def _risk(pair: Case) -> tuple[bool, float]:
    assert pair.asked is not None
    assert pair.own is not None
    return pair.asked.rss_viol and pair.own.rss_viol, min(pair.asked.r, pair.own.r)


def undoubted(track: Track, profile: Profile, *, gives_way: bool) -> bool:
    """Seen now, for long enough, without a break, surely enough to brake for, by a camera that is known, and surely in the way."""
    return (
        _measured(track)
        and track.steady_s is not None
        and track.steady_s > 0.0
        and track.confidence >= profile.act_confidence
        and track.unseen_s <= profile.act_unseen_s
        and track.age_s >= profile.act_track_age_s
        and track.sigma_vx_mps <= profile.speed_known_mps
        and not track.range_spread
        and not track.oncoming
        and meets(track, profile, gives_way=gives_way)
    )


def _measured(track: Track) -> bool:
    """Whether its deviations and its confidence are such as a measurement can have: a negative deviation would spare the wrong side."""
    sigmas = (track.sigma_x_m, track.sigma_y_m, track.sigma_vx_mps, track.sigma_vy_mps or 0.0)
    return min(sigmas) >= 0.0 and track.confidence <= 1.0


def meets(track: Track, profile: Profile, *, gives_way: bool) -> bool:
    """Whether its body and the ego's would meet, as far aside as it may be, or it drives across and cannot halt before that.

    A person is braked for beside the way too; a vehicle of unknown clearance is not.
    """
    return track.kind != "vehicle" or overlaps(track, profile) or drives_across(track, profile, gives_way=gives_way)


def overlaps(track: Track, profile: Profile) -> bool:
    """Whether a body lies in the ego's way, as far aside as it may be."""
    return track.clearance_m is not None and track.clearance_m + track.sigma_y_m <= -profile.act_overlap_m


def drives_across(track: Track, profile: Profile, *, gives_way: bool) -> bool:
    """Whether a vehicle comes across the way, so fast and near that a driver about to let the ego pass would brake by now.

    One that the ego gives way to is not expected to brake.
    """
    if track.clearance_m is None or track.sigma_vy_mps is None or track.vy_mps * track.y_m >= 0.0:
        return False
    least_mps = abs(track.vy_mps) - track.sigma_vy_mps
    if least_mps < profile.stands_mps or not surely_moves_across(track, across(profile)):
        return False
    room_m = front_m(track) + track.sigma_y_m - profile.d0_m
    return gives_way or room_m <= 0.0 or least_mps**2 > 2.0 * profile.vehicle_stops_mps2 * room_m


def front_m(track: Track) -> float:
    """From the front of a vehicle that drives across to the ego's way: its clearance is reckoned by its width."""
    assert track.clearance_m is not None
    return track.clearance_m - max(0.0, track.length_m - track.width_m) / 2.0


def in_way_s(track: Track, profile: Profile) -> tuple[float, float]:
    """From when until when a vehicle that drives across is in the ego's way, at its speed now."""
    comes_s = front_m(track) / abs(track.vy_mps)
    return comes_s, comes_s + (profile.ego_width_m + max(track.length_m, track.width_m)) / abs(track.vy_mps)


def may_still_halt(track: Track, profile: Profile) -> bool:
    """Whether a person on foot beside the way has room to halt before it, one standard deviation spared; where that is unknown, it may."""
    if track.kind != "pedestrian" or track.clearance_m is None:
        return track.kind == "pedestrian"
    needed_m = track.vy_mps * track.vy_mps / (2.0 * profile.person_stops_mps2)
    return track.clearance_m - track.sigma_y_m - needed_m > profile.act_overlap_m


def _undoubted(view: View, profile: Profile, *, gives_way: bool) -> tuple[Numbers, ...]:
    bounds = act_bounds(view, profile)
    ahead = (track for track in view.actors if track.x_m > 0.0 and undoubted(track, profile, gives_way=gives_way))
    return tuple(measure(track, view, bounds, profile) for track in ahead)


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
DOUBTS = frozenset({"no undoubted actor in the request", "no undoubted actor in the arbiter's own reading"})
"""Rows that doubt the road user, not how it is seen."""


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
