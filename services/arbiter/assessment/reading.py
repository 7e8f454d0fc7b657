"""The arbiter's own reading of the road: the checker beside the doer."""

from typing import TypeVar

import msgspec

from domain import ego_speed
from domain.ego_speed import Believed
from proto.perception import Track, Tracks
from proto.vehicle import Degradation, Ego
from proto.weather import Conditions
from services.arbiter.assessment.assess import View

M = TypeVar("M", bound=msgspec.Struct)
WALKS_MPS = 1.0
"""Slower sideways a person may not walk at all: the speed of a standing person is measured with 0.1 to 0.3 m/s."""
SKEW_NS = 1_000_000_000
"""Clocks of two hosts may differ by so much."""


class Pedals(msgspec.Struct, frozen=True, kw_only=True):
    """What the driver does with feet and hands; None: not seen."""

    brake: float | None = None
    accelerator: float | None = None
    steering_rad: float | None = None


class Reading(msgspec.Struct, frozen=True, kw_only=True):
    """What the arbiter read itself, and how old each part is."""

    view: View = View()
    neighbours: tuple[Track, ...] = ()
    lateral_neighbours_known: bool = False
    coming: tuple[Track, ...] = ()
    """People ahead beside the path that walk towards it: watched before they are in it, and nothing else."""
    pedals: Pedals = Pedals()
    tracks_age_s: float | None = None
    ego_age_s: float | None = None


class Latest(msgspec.Struct, frozen=True, kw_only=True):
    """The newest message of each of the arbiter's own subscriptions, with its stamp (ns)."""

    tracks: tuple[Tracks, int] | None = None
    ego: tuple[Ego, int] | None = None
    conditions: tuple[Conditions, int] | None = None
    degradation: tuple[Degradation, int] | None = None
    speed: Believed | None = None
    """The ego's speed as it was last believed, before this reading."""


def believed(latest: Latest, now_ns: int) -> Believed | None:
    """The ego's speed: the newest one or, where that is no speed or is not told, the last that was believed.

    One from well after now, as a clock that was set back leaves it, is forgotten.
    """
    before = latest.speed if latest.speed is not None and latest.speed.stamp_ns <= now_ns + SKEW_NS else None
    if latest.ego is None or latest.ego[0].speed_mps is None:
        return before
    return ego_speed.believed(Believed(latest.ego[0].speed_mps, latest.ego[1]), before, latest.ego[0].acceleration_mps2)


def read(latest: Latest, now_ns: int, max_age_s: float) -> Reading:
    """One reading; tracks and ego older than `max_age_s` are unknown, friction and health stay as last read."""
    tracks, tracks_age = _fresh(latest.tracks, now_ns, max_age_s)
    ego, ego_age = _fresh(latest.ego, now_ns, max_age_s)
    conditions = latest.conditions[0] if latest.conditions is not None else None
    degradation = latest.degradation[0] if latest.degradation is not None else None
    speed = _young_speed(latest, ego, now_ns, max_age_s)
    view = View(
        ego_speed_mps=speed.mps if speed is not None else None,
        ego_acceleration_mps2=ego_speed.acceleration_mps2(ego.acceleration_mps2, speed) if ego is not None else None,
        actors=in_path(tracks),
        h=degradation.h if degradation is not None else None,
        brake_envelope=degradation.brake_envelope if degradation is not None else None,
        mu_low=conditions.mu_low if conditions is not None else None,
        mu_high=conditions.mu_high if conditions is not None else None,
        following_factor=conditions.following_factor if conditions is not None else 1.0,
    )
    return Reading(
        view=view,
        neighbours=tuple(track for track in tracks.tracks if abs(track.x_m) < 15.0) if tracks is not None else (),
        lateral_neighbours_known=tracks is not None,
        coming=_coming(tracks),
        pedals=_pedals(ego),
        tracks_age_s=tracks_age,
        ego_age_s=ego_age,
    )


def _young_speed(latest: Latest, ego: Ego | None, now_ns: int, max_age_s: float) -> Believed | None:
    """The speed, unless it is not told, or only one that was believed too long ago."""
    speed = believed(latest, now_ns)
    if ego is None or ego.speed_mps is None or speed is None:
        return None
    return speed if abs(now_ns - speed.stamp_ns) / 1e9 <= max_age_s else None


def in_path(tracks: Tracks | None) -> tuple[Track, ...]:
    """Road users ahead in the ego's path, the lead that perception named included."""
    if tracks is None:
        return ()
    return tuple(t for t in tracks.tracks if t.x_m > 0.0 and (t.in_ego_path or t.track_id == tracks.lead_track_id))


def _coming(tracks: Tracks | None) -> tuple[Track, ...]:
    beside = (t for t in tracks.tracks if t.x_m > 0.0 and not t.in_ego_path) if tracks is not None else ()
    return tuple(t for t in beside if t.kind == "pedestrian" and t.vy_mps * t.y_m < 0.0 and abs(t.vy_mps) >= WALKS_MPS)


def _fresh(pair: tuple[M, int] | None, now_ns: int, max_age_s: float) -> tuple[M | None, float | None]:
    if pair is None:
        return None, None
    age = (now_ns - pair[1]) / 1e9
    return (pair[0] if -max_age_s <= age <= max_age_s else None), age


def _pedals(ego: Ego | None) -> Pedals:
    if ego is None:
        return Pedals()
    return Pedals(brake=ego.brake_pedal, accelerator=ego.accelerator_pedal, steering_rad=ego.steering_angle_rad)
