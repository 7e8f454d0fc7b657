"""Whom the arbiter warns of by itself: soon met, and seen well enough to be shouted about."""

import math
from collections.abc import Iterable

from proto.perception import Track
from services.arbiter.assess import Numbers, View, each, gap_m, speak_bounds
from services.arbiter.profiles import Profile
from services.arbiter.state import Sighting
from services.arbiter.watching import contradicted

ANSWERED = frozenset({"closing_lead", "slow_traffic", "pedestrian"})
"""Hazards of road users: what they need of the driver is known from gap and closing speed."""
HAZARDS: dict[str, str] = {"vehicle": "closing_lead", "pedestrian": "pedestrian", "cyclist": "pedestrian"}
"""As the orchestrator names them: one hazard that both see is one hazard."""


def seen_hazards(views: Iterable[View], sightings: tuple[Sighting, ...], profile: Profile) -> tuple[str, ...]:
    """What either pair of eyes must be spoken of whatever the budget: each hazard once, whom one meets first before others."""
    seen = [(n, view) for view in views for n in each(view, speak_bounds(view, profile), profile)]
    next_m = min((n.gap_m for n, _ in seen if _hides_others(n, profile)), default=math.inf)
    near = [n for n, view in seen if _hazardous(n, view, sightings, profile) and not _queued(n, view, next_m, profile)]
    ordered = sorted(near, key=lambda n: (n.ttc_s or 0.0, n.track.track_id))
    return tuple(dict.fromkeys(HAZARDS[n.track.kind] for n in ordered))


def passed(track: Track, ego_mps: float | None, profile: Profile) -> bool:
    """Whether the ego passes a vehicle that stands, comes towards us, or is beside us already, close by; unknown speeds pass nobody."""
    if track.kind != "vehicle" or track.clearance_m is None or track.clearance_m <= 0.0:
        return False
    beside = gap_m(track, profile) <= 0.0 and abs(track.vy_mps) < profile.stands_mps
    return (
        track.oncoming
        or beside
        or (ego_mps is not None and math.hypot(ego_mps + track.vx_mps, track.vy_mps) < profile.stands_mps)
    )


def _hazardous(numbers: Numbers, view: View, sightings: tuple[Sighting, ...], profile: Profile) -> bool:
    """Soon met, and seen well enough to be shouted about: no ghost of one frame, none whose speed is not known yet."""
    track = numbers.track
    if track.kind == "vehicle" and view.ego_speed_mps is not None and view.ego_speed_mps < profile.standing_mps:
        return False
    return (
        numbers.ttc_s is not None
        and numbers.ttc_s < profile.tau_hazard_s
        and numbers.closing_mps > max(0.5, profile.speed_sigmas * track.sigma_vx_mps)
        and track.sigma_vx_mps <= profile.speed_known_mps
        and _well_seen(track, profile)
        and track.confidence >= profile.hazard_confidence
        and _believed(track, view.ego_speed_mps, profile)
        and not passed(track, view.ego_speed_mps, profile)
        and not contradicted(sightings, track.track_id, numbers.closing_mps, profile)
    )


def _believed(track: Track, ego_mps: float | None, profile: Profile) -> bool:
    """Whether a vehicle ahead is one: it is certain, or known for a while, or surely comes from the side, where no time is left.

    Two are mistaken often, and must be certain as well as known: traffic that comes towards us in our own lane, and one
    that stands aside and is in the way only if the speed across is right that it may not have.
    """
    if track.kind != "vehicle":
        return True
    crosses, surely = _crosses(track, ego_mps, profile), _surely_moves_across(track, profile)
    certain = track.confidence >= profile.act_confidence
    known = track.age_s >= profile.hazard_known_s or (crosses and surely)
    aside = track.clearance_m is not None and track.clearance_m > 0.0
    doubtful = track.oncoming or (aside and crosses and not surely)
    return certain and known if doubtful else certain or known


def _crosses(track: Track, ego_mps: float | None, profile: Profile) -> bool:
    """Whether a vehicle drives across our way rather than along it; with an unknown speed of our own, whether it moves sideways."""
    ahead_mps = 0.0 if ego_mps is None else abs(ego_mps + track.vx_mps)
    return abs(track.vy_mps) >= max(profile.stands_mps, ahead_mps)


def _surely_moves_across(track: Track, profile: Profile) -> bool:
    """Whether its speed sideways may not be none at all; where nobody tells how sure that is, it may not."""
    return track.sigma_vy_mps is None or abs(track.vy_mps) >= profile.across_sigmas * track.sigma_vy_mps


def _well_seen(track: Track, profile: Profile) -> bool:
    if track.kind == "vehicle" and track.steady_s is not None and track.steady_s <= 0.0:
        return False  # seen again for the first time after a break
    return track.age_s >= profile.act_track_age_s and track.unseen_s <= profile.act_unseen_s


def _hides_others(numbers: Numbers, profile: Profile) -> bool:
    """Whether a vehicle is surely in our path, before us, and just seen: who is behind it can be met only through it. One that
    overlaps us is a mistake, and hides nobody.
    """
    track = numbers.track
    return (
        track.kind == "vehicle"
        and track.in_ego_path
        and numbers.gap_m > 0.0
        and _well_seen(track, profile)
        and track.age_s >= profile.hazard_known_s
        and track.confidence >= profile.act_confidence
    )


def _queued(numbers: Numbers, view: View, next_m: float, profile: Profile) -> bool:
    """Whether one crawls in a queue and this vehicle is behind the next one, a gap of `next_m` away."""
    crawls = view.ego_speed_mps is not None and view.ego_speed_mps < profile.crawl_mps
    return crawls and numbers.track.kind == "vehicle" and numbers.gap_m > next_m + profile.queued_m
