"""From actors, ego and friction to the numbers a decision rests on, at the bounds that count for SPEAK and for ACT."""

import math

import msgspec

from domain import kinematics, rss
from domain.road_users import least_gap_m
from proto.decision import SafetyMetrics
from proto.perception import Track
from services.arbiter.assessment.risk import risk
from services.arbiter.profiles.profile import Profile

_ENVELOPE_FLOOR = 0.05


class View(msgspec.Struct, frozen=True, kw_only=True):
    """What one pair of eyes has: the orchestrator's, as asked, or the arbiter's own. An absent field is unknown."""

    ego_speed_mps: float | None = None
    ego_acceleration_mps2: float | None = None
    actors: tuple[Track, ...] = ()
    """Road users in the ego's path."""
    h: float | None = None
    brake_envelope: float | None = None
    mu_low: float | None = None
    mu_high: float | None = None
    following_factor: float = 1.0


class Bounds(msgspec.Struct, frozen=True, kw_only=True):
    """The end of each interval that an action must be tested at."""

    mu: float
    envelope: float
    h: float
    following_factor: float
    sigmas: float
    """How many standard deviations the actor is taken to be farther and slower in closing than measured."""


class Numbers(msgspec.Struct, frozen=True, kw_only=True):
    """One actor at one set of bounds; an absent number is unknown."""

    track: Track
    gap_m: float
    closing_mps: float
    ttc_s: float | None
    d_min_m: float | None
    rss_viol: bool
    r: float


def speak_bounds(view: View, profile: Profile) -> Bounds:
    """The careful end: least grip, worst car, widened distance."""
    envelope = profile.envelope_unknown if view.brake_envelope is None else view.brake_envelope
    mu = profile.mu_unknown_low if view.mu_low is None else view.mu_low
    return Bounds(
        mu=max(profile.mu_floor, mu),
        envelope=min(1.0, max(_ENVELOPE_FLOOR, envelope)),
        h=profile.h_unknown if view.h is None else view.h,
        following_factor=max(1.0, view.following_factor),
        sigmas=0.0,
    )


def act_bounds(view: View, profile: Profile) -> Bounds:
    """The reluctant end: most grip, a sound car where nothing else is known, the actor as far as it may be."""
    high = profile.mu_unknown_high if view.mu_high is None else min(view.mu_high, profile.mu_unknown_high)
    envelope = 1.0 if view.brake_envelope is None else view.brake_envelope
    return Bounds(
        mu=max(profile.mu_floor, high, view.mu_low or 0.0),
        envelope=min(1.0, max(_ENVELOPE_FLOOR, envelope)),
        h=0.0 if view.h is None else view.h,
        following_factor=1.0,
        sigmas=1.0,
    )


def along_mps(track: Track, mps: float) -> float:
    """A road user's speed over ground; below 0 it comes towards the ego, which a vehicle does only where that is known (`oncoming`)."""
    return max(0.0, mps) if track.kind == "vehicle" else mps


def gap_m(track: Track, profile: Profile) -> float:
    """Bumper to bumper along x; below 0 the boxes overlap."""
    return abs(track.x_m) - (track.length_m + profile.ego_length_m) / 2.0


def measure(track: Track, view: View, bounds: Bounds, profile: Profile) -> Numbers:
    """Gap, time to collision, RSS distance and risk of one actor ahead."""
    gap = gap_m(track, profile) + bounds.sigmas * track.sigma_x_m
    closing = -track.vx_mps - bounds.sigmas * track.sigma_vx_mps
    time = _ttc(gap, closing, track, view, profile)
    d_min = _d_min(track, view, bounds, profile)
    nearest = gap if bounds.sigmas else least_gap_m(track, gap)
    viol = d_min is not None and nearest < d_min
    r = risk(time, viol, bounds.h, profile)
    return Numbers(track=track, gap_m=gap, closing_mps=closing, ttc_s=time, d_min_m=d_min, rss_viol=viol, r=r)


def worst(view: View, bounds: Bounds, profile: Profile) -> Numbers | None:
    """The actor with the highest risk; of equals the nearest."""
    return max(each(view, bounds, profile), key=lambda n: (n.r, -n.gap_m, -n.track.track_id), default=None)


def each(view: View, bounds: Bounds, profile: Profile) -> tuple[Numbers, ...]:
    """Everyone ahead that is more than noise."""
    ahead = (track for track in view.actors if track.x_m > 0.0 and track.confidence >= profile.actor_floor)
    return tuple(measure(track, view, bounds, profile) for track in ahead)


def _ttc(gap: float, closing: float, track: Track, view: View, profile: Profile) -> float | None:
    if profile.ttc == "paper":
        return kinematics.paper_ttc_s(max(0.0, gap), closing, profile.epsilon_mps)
    if view.ego_speed_mps is None or track.oncoming:
        # Speeds over ground are unknown here: braking that would end at standstill, or reverse the motion, is not counted on.
        return kinematics.relative_ttc_s(gap, closing, max(0.0, -track.ax_mps2))
    ego_accel = view.ego_acceleration_mps2 or 0.0
    lead = along_mps(track, view.ego_speed_mps - closing)
    # A track's acceleration is over ground. A lead that speeds up is not counted on.
    return kinematics.ttc_s(gap, view.ego_speed_mps, lead, ego_accel, min(track.ax_mps2, 0.0))


def _d_min(track: Track, view: View, bounds: Bounds, profile: Profile) -> float | None:
    ego = view.ego_speed_mps
    if ego is None:
        return None
    if profile.rss == "paper":
        return rss.paper_d_min_m(ego, bounds.mu, profile.t_r_s, profile.d0_m)
    brake = bounds.mu * rss.GRAVITY_MPS2 * bounds.envelope
    follower = rss.Longitudinal(rho_s=profile.t_r_s, accel_max_mps2=profile.accel_max_mps2, brake_min_mps2=brake)
    wrong = rss.Longitudinal(
        rho_s=profile.oncoming_rho_s,
        accel_max_mps2=profile.accel_max_mps2,
        brake_min_mps2=bounds.mu * rss.GRAVITY_MPS2,
    )
    if track.oncoming:
        distance = rss.opposite_direction_m(ego, max(0.0, -(ego + track.vx_mps)), follower, wrong)
    else:
        lead = along_mps(track, ego + track.vx_mps + bounds.sigmas * track.sigma_vx_mps)
        distance = rss.same_direction_m(ego, lead, follower, profile.brake_max_mps2)
        # A person who comes nearer goes on while the driver reacts, and halts without speeding up before that.
        comes = msgspec.structs.replace(wrong, accel_max_mps2=0.0)
        distance += rss.stopping_distance_m(-lead, comes)
    # Grip stands in the braking part already; weather's factor widens the part that is driven before anyone brakes.
    return distance + (bounds.following_factor - 1.0) * ego * profile.t_r_s + profile.d0_m


def lateral_violation(tracks: tuple[Track, ...], ego_speed_mps: float | None, profile: Profile) -> bool | None:
    """Whether a neighbour alongside is nearer than RSS allows sideways; None: the ego's speed is unknown."""
    if ego_speed_mps is None:
        return None
    who = rss.Lateral(
        rho_s=profile.t_r_s,
        accel_max_mps2=profile.lat_accel_mps2,
        brake_min_mps2=profile.lat_brake_mps2,
        fluctuation_m=profile.lat_fluctuation_m,
    )
    return any(_too_near(track, who, profile) for track in tracks if not track.in_ego_path)


def _too_near(track: Track, who: rss.Lateral, profile: Profile) -> bool:
    if gap_m(track, profile) > 0.0 or track.kind == "pedestrian":
        return False
    aside = abs(track.y_m) - (track.width_m + profile.ego_width_m) / 2.0
    # Left of the ego, motion to the right (vy < 0) closes in; mirrored on the other side. The ego keeps its lane.
    towards = -track.vy_mps if track.y_m > 0.0 else track.vy_mps
    return aside < rss.lateral_m(towards, 0.0, who, who)


def metrics(speak: Numbers | None, act: Numbers | None, view: View, profile: Profile) -> SafetyMetrics:
    """The numbers as they are published; utilities and thresholds are the decision's to add."""
    base = SafetyMetrics(h=view.h, r=risk(None, False, speak_bounds(view, profile).h, profile))
    if speak is None:
        return base
    ego = view.ego_speed_mps
    return msgspec.structs.replace(
        base,
        ttc_s=speak.ttc_s,
        headway_s=speak.gap_m / ego if ego is not None and ego > 0.5 else None,
        gap_m=speak.gap_m,
        closing_mps=speak.closing_mps,
        d_min_low_mu_m=_finite(speak.d_min_m),
        rss_viol_low_mu=speak.rss_viol if speak.d_min_m is not None else None,
        d_min_high_mu_m=_finite(act.d_min_m) if act is not None else None,
        rss_viol_high_mu=act.rss_viol if act is not None and act.d_min_m is not None else None,
        r=speak.r,
        r_act=act.r if act is not None else 0.0,
        lead_track_id=speak.track.track_id,
    )


def _finite(value: float | None) -> float | None:
    return value if value is not None and math.isfinite(value) else None
