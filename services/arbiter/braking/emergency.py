"""When the harder braking of an emergency is due: both views agree, the road user is surely there, and waiting avoids nothing."""

from collections.abc import Callable

from domain.rss import GRAVITY_MPS2
from proto.perception import Track
from services.arbiter.assessment.assess import Numbers, View, act_bounds
from services.arbiter.braking.act import Permission, braking_on
from services.arbiter.braking.guard import Case, in_way_s, may_still_halt, overlaps
from services.arbiter.profiles.profile import Profile


def is_certain(track: Track, case: Case, profile: Profile) -> bool:
    """Whether a road user is surely there: seen in the last pictures without a break, and surely enough to brake for as hard as can be."""
    return (
        track.confidence >= asked_confidence(case, profile)
        and track.steady_s is not None
        and track.steady_s >= profile.act_track_age_s
        and track.unseen_s <= profile.emergency_unseen_s
    )


def asked_confidence(case: Case, profile: Profile) -> float:
    """How sure a road user must be there: surer than for soft braking, unless this car cannot brake harder than that."""
    hard = hardest_mps2(case, profile) > profile.act_brake_max_mps2
    return profile.emergency_confidence if hard else profile.act_confidence


def hardest_mps2(case: Case, profile: Profile) -> float:
    """What brakes and road give at most (m/s2), by the upper bound of friction, in either view."""
    bounds = [act_bounds(view, profile) for view in _views(case)]
    return max(_given_mps2(each.mu, each.envelope, profile) for each in bounds)


def _given_mps2(mu: float, envelope: float, profile: Profile) -> float:
    return min(profile.brake_max_mps2, mu * GRAVITY_MPS2) * envelope


def _views(case: Case) -> tuple[View, View]:
    """Grip and brakes as the orchestrator and the arbiter have them."""
    request = case.request
    theirs = View(mu_low=request.mu_low, mu_high=request.mu_high, brake_envelope=request.brake_envelope)
    return theirs, case.reading.view


def can_brake_mps2(view: View, permission: Permission, profile: Profile, *, surely: bool) -> float:
    """The hardest braking to count on (m/s2), by the upper bound of friction, or `surely` by the lower one, where that is known.

    A lower bound below what an unknown road is taken to give counts as that: a doubt about the grip is no ice.
    """
    bounds = act_bounds(view, profile)
    mu = bounds.mu
    if surely and view.mu_low is not None:
        mu = min(mu, max(profile.mu_unknown_low, view.mu_low))
    most = min(permission.max_deceleration_mps2, profile.emergency_brake_max_mps2)
    return min(most, _given_mps2(mu, bounds.envelope, profile))


def is_last_moment(case: Case, permission: Permission, profile: Profile) -> bool:
    """Whether braking that begins later no longer avoids the impact, by both views.

    Before the time to a hazard the upper bound of friction alone counts, so that doubt about the grip begins nothing early.
    """
    return any(
        _is_last(case, permission, profile, within_s, surely=surely)
        for within_s, surely in ((profile.tau_s, False), (profile.tau_hazard_s, True))
    )


def is_due(case: Case, permission: Permission, profile: Profile) -> bool:
    """Whether braking may begin for this road user: one in the way at any time, one beside it at the last moment alone.

    A vehicle beside the way must also come into it while the ego is there: one that is through by then, or comes behind
    the ego, is no reason to brake.
    """
    if case.own is None:
        return False
    track, ego_mps = case.own.track, case.reading.view.ego_speed_mps
    if track.kind == "vehicle" and not overlaps(track, profile):
        return (
            ego_mps is not None
            and meets_in_time(track, case.own.gap_m, ego_mps, profile)
            and is_last_moment(case, permission, profile)
        )
    return not may_still_halt(track, profile) or is_last_moment(case, permission, profile)


def meets_in_time(track: Track, gap_m: float, ego_mps: float, profile: Profile) -> bool:
    """Whether a vehicle that drives across is in the ego's way while the ego passes there, both at their speeds."""
    if ego_mps <= 0.0:
        return False
    comes_s, gone_s = in_way_s(track, profile)
    enters_s = max(0.0, gap_m) / ego_mps
    leaves_s = enters_s + (profile.ego_length_m + track.length_m) / ego_mps
    return comes_s < leaves_s and gone_s > enters_s


def _is_last(case: Case, permission: Permission, profile: Profile, within_s: float, *, surely: bool) -> bool:
    request, view = case.request, case.reading.view
    can_mps2 = max(can_brake_mps2(each, permission, profile, surely=surely) for each in _views(case))
    if case.asked is None or case.own is None or can_mps2 <= 0.0:
        return False
    pairs = ((case.asked, request.ego_speed_mps), (case.own, view.ego_speed_mps))
    return all(
        ego is not None and each.ttc_s is not None and each.ttc_s < within_s and _meets(each, ego, can_mps2, profile)
        for each, ego in pairs
    )


def _meets(numbers: Numbers, ego_mps: float, can_mps2: float, profile: Profile) -> bool:
    """Whether the gap is used up by the way to build braking up and to end the closing, or to stop behind a lead that brakes on."""
    closing = max(0.0, numbers.closing_mps)
    late_s = profile.emergency_delay_s + can_mps2 / (2.0 * profile.act_jerk_mps3)
    ways = [closing * late_s + closing * closing / (2.0 * can_mps2)]
    lead_mps, lead_mps2 = braking_on(numbers, ego_mps, profile)
    if lead_mps2 > 0.0:
        ways.append(ego_mps * late_s + ego_mps * ego_mps / (2.0 * can_mps2) - lead_mps * lead_mps / (2.0 * lead_mps2))
    return max(ways) + profile.emergency_spare_m >= numbers.gap_m


def _agree(asked: Numbers | None, own: Numbers | None, profile: Profile) -> bool:
    if asked is None or own is None:
        return False
    return abs(asked.closing_mps - own.closing_mps) <= profile.speed_known_mps


ROWS: tuple[tuple[str, Callable[[Case, Permission, Profile], bool]], ...] = (
    ("request and own reading disagree on the closing speed", lambda c, g, p: _agree(c.asked, c.own, p)),
    (
        "the actor is not certain in the request",
        lambda c, g, p: c.asked is not None and is_certain(c.asked.track, c, p),
    ),
    (
        "the actor is not certain in the own reading",
        lambda c, g, p: c.own is not None and is_certain(c.own.track, c, p),
    ),
    ("later braking still avoids it", lambda c, g, p: is_last_moment(c, g, p)),
)
"""(what is wrong if it does not hold, whether it holds)."""


def is_surely_last_moment(case: Case, permission: Permission, profile: Profile) -> bool:
    """Whether every row holds, whatever the envelope: no time is left for a warning."""
    return all(holds(case, permission, profile) for _, holds in ROWS)


def is_emergency(case: Case, permission: Permission, profile: Profile) -> bool:
    """Whether hard braking is due. The guard's rows are asked beside these, not here."""
    return permission.envelope == "emergency" and is_surely_last_moment(case, permission, profile)
