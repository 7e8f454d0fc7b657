"""When the harder braking of an emergency is due: both views agree, the road user is surely there, and waiting avoids nothing."""

from collections.abc import Callable

from domain.rss import GRAVITY_MPS2
from proto.perception import Track
from services.arbiter.assessment.assess import Numbers, View, act_bounds
from services.arbiter.braking.act import Permission
from services.arbiter.braking.guard import Case
from services.arbiter.profiles.profile import Profile


def is_certain(track: Track, profile: Profile) -> bool:
    """Whether a road user is surely there: seen in the last pictures without a break, and surely enough to brake hard for."""
    return (
        track.confidence >= profile.emergency_confidence
        and track.steady_s is not None
        and track.steady_s >= profile.act_track_age_s
        and track.unseen_s <= profile.emergency_unseen_s
    )


def can_brake_mps2(view: View, permission: Permission, profile: Profile) -> float:
    """The hardest braking to count on at the upper bound of friction (m/s2): an assumed better grip delays, and never begins."""
    bounds = act_bounds(view, profile)
    most = min(permission.max_deceleration_mps2, profile.emergency_brake_max_mps2)
    return min(most, min(profile.brake_max_mps2, bounds.mu * GRAVITY_MPS2) * bounds.envelope)


def is_last_moment(case: Case, permission: Permission, profile: Profile) -> bool:
    """Whether braking that begins later no longer avoids the impact, by both views: the way to build it up and to end the closing."""
    can_mps2 = can_brake_mps2(case.reading.view, permission, profile)
    if case.asked is None or case.own is None or can_mps2 <= 0.0:
        return False
    return all(_way_m(each, can_mps2, profile) >= each.gap_m for each in (case.asked, case.own))


def _way_m(numbers: Numbers, can_mps2: float, profile: Profile) -> float:
    """By how much the gap shrinks until the closing has ended, if the braking is asked for now."""
    closing = max(0.0, numbers.closing_mps)
    late_s = profile.emergency_delay_s + can_mps2 / (2.0 * profile.act_jerk_mps3)
    return closing * late_s + closing * closing / (2.0 * can_mps2) + profile.emergency_spare_m


def _agree(asked: Numbers | None, own: Numbers | None, profile: Profile) -> bool:
    if asked is None or own is None:
        return False
    return abs(asked.closing_mps - own.closing_mps) <= profile.speed_known_mps


ROWS: tuple[tuple[str, Callable[[Case, Permission, Profile], bool]], ...] = (
    ("the grant is not for emergencies", lambda c, g, p: g.envelope == "emergency"),
    ("request and own reading disagree on the closing speed", lambda c, g, p: _agree(c.asked, c.own, p)),
    ("the actor is not certain in the request", lambda c, g, p: c.asked is not None and is_certain(c.asked.track, p)),
    ("the actor is not certain in the own reading", lambda c, g, p: c.own is not None and is_certain(c.own.track, p)),
    ("later braking still avoids it", lambda c, g, p: is_last_moment(c, g, p)),
)
"""(what is wrong if it does not hold, whether it holds)."""


def is_emergency(case: Case, permission: Permission, profile: Profile) -> bool:
    """Whether every row holds. The guard's rows are asked beside these, not here."""
    return all(holds(case, permission, profile) for _, holds in ROWS)
