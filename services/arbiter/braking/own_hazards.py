"""Hazards that the arbiter warns of by itself: road users met soon, and seen well enough for a warning."""

import math
from collections.abc import Iterable

from domain.road_users import (
    Across,
    Sight,
    braking_needed_mps2,
    crosses_over,
    hides_others,
    is_passed,
    is_vehicle_there,
    seen_well,
    shows_beyond_others,
)
from services.arbiter.assessment.assess import Numbers, View, each, speak_bounds
from services.arbiter.braking.watching import contradicted
from services.arbiter.profiles.profile import Profile
from services.arbiter.state import Sighting

ANSWERED = frozenset({"closing_lead", "slow_traffic", "pedestrian"})
"""Hazards of road users: what they need of the driver is known from gap and closing speed."""
CONFIRMING = 3
"""Pictures of the last `watching.KEPT_NS` that show a doubted person, or a vehicle that comes, in the path before a warning: as the
orchestrator asks."""
AT_ONCE_S = 2.0
"""A person known for a while is told of at the first picture in the path when met so soon: as the orchestrator's alarm."""
HAZARDS: dict[str, str] = {"vehicle": "closing_lead", "pedestrian": "pedestrian", "cyclist": "pedestrian"}
"""As the orchestrator names them: one hazard that both see is one hazard."""


def seen_hazards(views: Iterable[View], sightings: tuple[Sighting, ...], profile: Profile) -> tuple[str, ...]:
    """Hazards of either view that must be spoken whatever the budget: each once, in the order of the time to collision."""
    seen = [(n, view) for view in views for n in each(view, speak_bounds(view, profile), profile)]
    hiding = (n.gap_m for n, view in seen if n.track.kind == "vehicle" and _hides(n, view, profile))
    next_m = min(hiding, default=math.inf)
    near = [n for n, view in seen if _hazardous(n, view, sightings, profile) and not _queued(n, view, next_m, profile)]
    ordered = sorted(near, key=lambda n: (n.ttc_s or 0.0, n.track.track_id))
    return tuple(dict.fromkeys(HAZARDS[n.track.kind] for n in ordered))


def sight(profile: Profile) -> Sight:
    """The arbiter's own thresholds."""
    return Sight(profile.act_track_age_s, profile.act_unseen_s, profile.act_confidence, profile.hazard_known_s)


def across(profile: Profile) -> Across:
    """The arbiter's own thresholds."""
    return Across(profile.stands_mps, profile.across_sigmas)


def _hides(numbers: Numbers, view: View, profile: Profile) -> bool:
    """Whether a vehicle may hide what is behind it; one that the ego passes beside its way hides nothing in it."""
    return hides_others(numbers.track, numbers.gap_m, sight(profile)) and not _passed(numbers, view, profile)


def _passed(numbers: Numbers, view: View, profile: Profile) -> bool:
    speed_mps = None if view.ego_speed_mps is None else view.ego_speed_mps + numbers.track.vx_mps
    least_mps = profile.stands_mps
    return is_passed(numbers.track, numbers.gap_m, speed_mps, stands_mps=least_mps, across_mps=least_mps)


def _hazardous(numbers: Numbers, view: View, sightings: tuple[Sighting, ...], profile: Profile) -> bool:
    """Whether a road user is met soon and seen well enough for a warning: no ghost of one frame, and of known speed."""
    track, ego_mps = numbers.track, view.ego_speed_mps
    speed_mps = ego_mps + track.vx_mps if ego_mps is not None else None
    if track.kind == "vehicle" and view.ego_speed_mps is not None and view.ego_speed_mps < profile.standing_mps:
        return False
    return (
        numbers.ttc_s is not None
        and numbers.ttc_s < profile.tau_hazard_s
        and _needs_braking(numbers, view, profile)
        and numbers.closing_mps > max(0.5, profile.speed_sigmas * track.sigma_vx_mps)
        and track.sigma_vx_mps <= profile.speed_known_mps
        and seen_well(track, sight(profile))
        and track.confidence >= profile.hazard_confidence
        and _confirmed(numbers, sightings, profile)
        and is_vehicle_there(track, speed_mps, sight(profile), across(profile))
        and not _passed(numbers, view, profile)
        and not contradicted(sightings, track.track_id, numbers.closing_mps, profile)
    )


def _needs_braking(numbers: Numbers, view: View, profile: Profile) -> bool:
    """Whether a vehicle needs more than comfortable braking, and more than the driver brakes already: in a crawling queue every time to
    collision is short."""
    if numbers.track.kind != "vehicle" or crosses_over(numbers.track, None, across(profile)):
        return True
    spare_m, ego_mps = profile.hazard_spare_m, view.ego_speed_mps
    need_mps2 = braking_needed_mps2(numbers.track, numbers.gap_m, numbers.closing_mps, spare_m, ego_mps)
    return need_mps2 > max(profile.hazard_need_mps2, -(view.ego_acceleration_mps2 or 0.0))


def _confirmed(numbers: Numbers, sightings: tuple[Sighting, ...], profile: Profile) -> bool:
    """Whether a person is certain or was seen in the path often enough, or known for a while where no time is left.

    Ghosts of people last one or two pictures, and so do steps of a walker beside the path. A vehicle that comes towards the ego has to be
    seen in the path often enough: one of the other lane lies in ours for a look or two. Of other vehicles `is_vehicle_there` asks enough.
    """
    track = numbers.track
    often = sum(each.track_id == track.track_id for each in sightings) >= CONFIRMING
    if track.kind == "vehicle":
        return often or not track.oncoming
    known = track.age_s >= profile.hazard_known_s and numbers.ttc_s is not None and numbers.ttc_s < AT_ONCE_S
    return often or known or track.confidence >= profile.act_confidence


def _queued(numbers: Numbers, view: View, next_m: float, profile: Profile) -> bool:
    """Whether this vehicle is behind the next one, a gap of `next_m` away, and one crawls in a queue or it does not surely show."""
    crawls = view.ego_speed_mps is not None and view.ego_speed_mps < profile.crawl_mps
    hidden = crawls or not shows_beyond_others(numbers.track, sight(profile))
    return hidden and numbers.track.kind == "vehicle" and numbers.gap_m > next_m + profile.queued_m
