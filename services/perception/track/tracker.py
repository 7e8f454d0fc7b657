"""Tracks of road users over time: confirmation, motion, coasting through drop-outs.

A track keeps its id while it is unseen for up to a second; its sigma grows and its confidence falls meanwhile.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field

import numpy as np
from msgspec.structs import replace

from proto.perception import ActorClass, Track
from services.perception.range.sizes import Body
from services.perception.track.association import (
    DOUBTED,
    GATE,
    by_bearing,
    contradicts,
    falls_short,
    is_measured,
    pairs,
    scales,
)
from services.perception.track.kalman import (
    EgoMotion,
    Estimate,
    Fix,
    Noise,
    displaced,
    distance,
    predict,
    rescaled,
    update,
    widened,
    with_speed,
)
from services.perception.track.road_user import EgoState, Sighting, Tracked
from services.perception.track.sweep_speed import Sweeps, fix_before

CONFIRMING = ((3, 0.35), (6, 0.25), (2, 0.5))
"""A track is published after this many hits when it is so sure."""
TENTATIVE_S = 0.35
COAST_S = 1.0
COAST_PER_HIT_S = 0.15
"""A track coasts for as long as its past supports: 0.45 s after three hits, the whole second from seven on."""
BELIEVING_S, FORGETTING_S, LEAST_STEP_S = 0.5, 0.8, 0.05
BIRTH_SHARE, MOST_SURE = 0.5, 0.97
"""A track is as sure as its pictures are in the mean of the last half second, a picture without it counting as none,
and begins at half of its first. Pictures that follow each other err alike: many that doubt never add up to certainty.
For our own detector that is a probability, since its scores are."""
SHOWN_CONFIDENCE = 0.1
"""Tracks less sure than this are not published; they keep their id until they end."""
BREAK_S = 0.5
LEAP_MPS, LEAP_ACROSS_MPS = 3.0, 1.5
"""A road user that was unseen for longer is seen anew, and so is one whose speed a single fix changed by more, or told. Of small
vehicles that are partly hidden one range in eight is of something else, and one of those was taken for a speed of 20 m/s."""
UNKNOWN_MPS = 8.0
"""One sigma of a new vehicle's speed, beside the ego's own speed: half as much of the latter drew oncoming vehicles, known by
guessed ranges alone, 10 m/s towards standing."""
BEHIND_M = -8.0
RESTART_S = 1.0
"""Stamps that jump back by more tell of a new drive: old tracks mean nothing in it."""
NOISE: dict[ActorClass, Noise] = {
    "vehicle": Noise(along_mps2=5.0, across_mps2=2.0),
    "pedestrian": Noise(along_mps2=1.0, across_mps2=2.5),
    "cyclist": Noise(along_mps2=1.5, across_mps2=1.2),
}
ACCELERATION_SMOOTHING_S = 0.6
SPEED_KNOWN_MPS, MOST_MPS2 = 1.2, 9.0
"""While a speed is less sure than the first (sigma), its changes are the filter's learning, not the road user's doing. Changes
beyond the second are not a road user's either: tyres do not give so much."""
ONCOMING_MPS = -2.0
BODY_SMOOTHING = 0.15
DUPLICATE_M = (2.5, 1.0)


@dataclass(slots=True)
class Tracker:
    """Feed it the sightings of each picture in order of their stamps."""

    ids: Iterator[int] = field(default_factory=lambda: itertools.count(1))
    tracks: tuple[Tracked, ...] = ()
    _now_ns: int = 0
    _ego: EgoState = field(default_factory=EgoState)

    def step(
        self,
        stamp_ns: int,
        sightings: Sequence[Sighting],
        ego: EgoState,
        sees: Callable[[float, float], bool] = lambda x_m, y_m: True,
        sweeps: Sweeps | None = None,
    ) -> list[int]:
        """Move all tracks to `stamp_ns` and take the sightings in. Returns the track id of each sighting.

        A picture older than the last one (another camera's) is taken in without moving time backwards. `sees`: whether
        a place lies in the picture's view; a track outside it is not missed. `sweeps`: the last two, where there are.
        The id of a doubted sighting that no track takes is 0.
        """
        self._advance(stamp_ns, ego)
        tracks = list(self.tracks)
        owners = [0] * len(sightings)
        for left, right in pairs(tracks, sightings):
            known = _told_speed(tracks[left].estimate, sightings[right], ego)
            tracks[left] = _hit(replace(tracks[left], estimate=known), sightings[right], self._now_ns, sweeps)
            owners[right] = tracks[left].track_id
        for right, sighting in enumerate(sightings):
            if not owners[right] and sighting.score >= DOUBTED:
                tracks.append(_born(next(self.ids), sighting, self._now_ns, ego))
                owners[right] = tracks[-1].track_id
        seen = tuple(_looked_for(track, self._now_ns, sees) for track in tracks if _alive(track, self._now_ns))
        self.tracks = _without_duplicates(seen)
        return owners

    def _advance(self, stamp_ns: int, ego: EgoState) -> None:
        dt = (stamp_ns - self._now_ns) / 1e9
        if dt < -RESTART_S:
            self.tracks, self._now_ns = (), 0
            dt = 0.0
        if dt > 0 and self._now_ns:
            motion = EgoMotion(
                dt_s=min(dt, COAST_S),
                speed_mps=ego.speed_mps if self._ego.speed_mps is not None else None,
                speed_before_mps=self._ego.speed_mps,
                yaw_rate_radps=ego.yaw_rate_radps,
            )
            fading = tuple(_faded(track, dt) for track in self.tracks)
            self.tracks = tuple(_moved(track, motion, ego.speed_mps) for track in fading)
        if dt > 0 or not self._now_ns:
            self._now_ns, self._ego = stamp_ns, ego

    def published(self) -> list[Track]:
        """The confirmed tracks now that are still believed in, without lanes."""
        told = (as_message(track, self._now_ns, self._ego.speed_mps) for track in self.tracks if track.confirmed)
        return [track for track in told if track.confidence >= SHOWN_CONFIDENCE]


def _hit(track: Tracked, sighting: Sighting, now_ns: int, sweeps: Sweeps | None) -> Tracked:
    share = BODY_SMOOTHING
    body = Body(
        length_m=track.body.length_m + share * (sighting.body.length_m - track.body.length_m),
        width_m=track.body.width_m + share * (sighting.body.width_m - track.body.width_m),
    )
    hits, sure = track.hits + 1, _believed(track, sighting.score, now_ns)
    fix = sighting.fix
    squared, _ = distance(track.estimate, fix)
    short = falls_short(track, fix, squared)
    if short:
        fix = by_bearing(track, fix)
        squared, _ = distance(track.estimate, fix)
    elsewhere = contradicts(track, fix, squared)
    estimate = _taken_in(track, fix, squared, sweeps, elsewhere=elsewhere)
    off = squared > GATE or elsewhere
    leaps = sighting.boxed and (off or _leaps(track.estimate, estimate))
    anew = leaps or now_ns - track.seen_ns > BREAK_S * 1e9
    return replace(
        track,
        estimate=estimate,
        body=body,
        seen_ns=now_ns,
        steady_ns=now_ns if anew else track.steady_ns,
        placed_ns=track.placed_ns if short else now_ns,
        hits=hits,
        sure=sure,
        ranges=track.ranges + is_measured(sighting.fix),
        confirmed=track.confirmed or any(hits >= least and sure >= needed for least, needed in CONFIRMING),
    )


def _leaps(before: Estimate, after: Estimate) -> bool:
    """Whether the speed rests on what came between the two alone."""
    ahead_mps, across_mps = np.abs(after.mean - before.mean)[2:].tolist()
    was_known, is_known = (float(each.covariance[2, 2]) <= LEAP_MPS**2 for each in (before, after))
    return ahead_mps > LEAP_MPS or across_mps > LEAP_ACROSS_MPS or (is_known and not was_known)


def _believed(track: Tracked, score: float, now_ns: int) -> float:
    passed_s = max(LEAST_STEP_S, (now_ns - track.seen_ns) / 1e9)
    return min(MOST_SURE, track.sure + (1.0 - math.exp(-passed_s / BELIEVING_S)) * (score - track.sure))


def _taken_in(track: Tracked, fix: Fix, squared: float, sweeps: Sweeps | None, *, elsewhere: bool) -> Estimate:
    """The estimate with the fix; with the first measured one also where the same thing was a sweep before, which tells its speed."""
    estimate = update(_ready(track, fix, squared, elsewhere=elsewhere), fix)
    before = fix_before(estimate, fix, sweeps) if sweeps is not None and scales(track, fix) else None
    return update(estimate, before) if before is not None else estimate


def _ready(track: Tracked, fix: Fix, squared: float, *, elsewhere: bool) -> Estimate:
    """The track's estimate such that it can take the fix in, so far off: a swerve widens it, the first measured range scales it."""
    estimate = track.estimate
    if elsewhere:
        estimate = displaced(estimate, fix)
    elif squared > GATE:
        estimate = widened(estimate, squared / GATE)
    return rescaled(estimate, fix) if scales(track, fix) else estimate


def _born(track_id: int, sighting: Sighting, now_ns: int, ego: EgoState) -> Tracked:
    """Its speed is unknown: a person is taken to stand, a vehicle to do anything from coming towards us to going ahead."""
    ego_mps = ego.speed_mps or 0.0
    person = sighting.kind != "vehicle"
    vx, sigma = (-ego_mps, 1.5) if person else (-0.3 * ego_mps, UNKNOWN_MPS + ego_mps)
    if person and ego.speed_mps is None:
        vx, sigma = -5.0, 8.0
    covariance = np.zeros((4, 4))
    covariance[:2, :2] = sighting.fix.covariance
    covariance[2, 2], covariance[3, 3] = sigma**2, sighting.across_sigma_mps**2
    # a range from a moment ago: where it is now depends on a speed that is not known yet
    age_s, (x, y) = sighting.fix.age_s, sighting.fix.place.tolist()
    covariance[0, 0] += (age_s * sigma) ** 2
    covariance[0, 2] = covariance[2, 0] = age_s * sigma**2
    estimate = Estimate(np.array([x + age_s * vx, y, vx, 0.0]), covariance)
    return Tracked(
        track_id,
        sighting.kind,
        _told_speed(estimate, sighting, ego),
        sighting.body,
        born_ns=now_ns,
        seen_ns=now_ns,
        steady_ns=now_ns,
        placed_ns=now_ns,
        sure=BIRTH_SHARE * sighting.score,
        ranges=int(is_measured(sighting.fix)),
    )


def _told_speed(estimate: Estimate, sighting: Sighting, ego: EgoState) -> Estimate:
    """The estimate with the velocity that two sweeps tell, where it was known less well."""
    told = sighting.over_ground
    if told is None or ego.speed_mps is None:
        return estimate
    if max(float(estimate.covariance[2, 2]), float(estimate.covariance[3, 3])) <= told.sigma_mps**2:
        return estimate
    return with_speed(estimate, np.array([told.ahead_mps - ego.speed_mps, told.across_mps]), told.sigma_mps)


def _looked_for(track: Tracked, now_ns: int, sees: Callable[[float, float], bool]) -> Tracked:
    if track.seen_ns == now_ns:
        return replace(track, missed=False)
    return replace(track, missed=True) if sees(float(track.estimate.mean[0]), float(track.estimate.mean[1])) else track


def _faded(track: Tracked, dt_s: float) -> Tracked:
    """Less sure with time where the last picture of its place did not show it."""
    return replace(track, sure=track.sure * math.exp(-dt_s / FORGETTING_S)) if track.missed else track


def _moved(track: Tracked, motion: EgoMotion, ego_mps: float | None) -> Tracked:
    estimate = predict(track.estimate, motion, NOISE[track.kind])
    known = ego_mps is not None and float(track.estimate.covariance[2, 2]) <= SPEED_KNOWN_MPS**2
    ground = float(track.estimate.mean[2]) + (motion.speed_before_mps or 0.0) if known else None
    if ground is None or track.ground_vx_mps is None or motion.dt_s <= 0:
        return replace(track, estimate=estimate, ground_vx_mps=ground, ax_mps2=0.0 if ground is None else track.ax_mps2)
    share = min(1.0, motion.dt_s / ACCELERATION_SMOOTHING_S)
    raw = max(-MOST_MPS2, min(MOST_MPS2, (ground - track.ground_vx_mps) / motion.dt_s))
    ax = track.ax_mps2 + share * (raw - track.ax_mps2)
    return replace(track, estimate=estimate, ground_vx_mps=ground, ax_mps2=ax)


def _alive(track: Tracked, now_ns: int) -> bool:
    unseen_s = (now_ns - track.seen_ns) / 1e9
    coast_s = min(COAST_S, COAST_PER_HIT_S * track.hits) if track.confirmed else TENTATIVE_S
    if unseen_s > coast_s:
        return False
    return float(track.estimate.mean[0]) > BEHIND_M


def _without_duplicates(tracks: tuple[Tracked, ...]) -> tuple[Tracked, ...]:
    """Of two tracks of one kind on the same spot, moving alike, the older stays."""
    kept: list[Tracked] = []
    for track in sorted(tracks, key=lambda each: (not each.confirmed, each.born_ns, each.track_id)):
        if not any(_same_spot(track, other) for other in kept):
            kept.append(track)
    return tuple(sorted(kept, key=lambda each: each.track_id))


def _same_spot(one: Tracked, other: Tracked) -> bool:
    if one.kind != other.kind or one.kind != "vehicle":
        return False
    apart = np.abs(one.estimate.mean - other.estimate.mean)
    return bool(apart[0] < DUPLICATE_M[0] and apart[1] < DUPLICATE_M[1] and one.seen_ns != other.seen_ns)


def as_message(track: Tracked, now_ns: int, ego_mps: float | None) -> Track:
    """The track on the wire: its place is the middle of its body, half a length behind the surface that is seen."""
    _, _, vx, vy = track.estimate.mean.tolist()
    unseen_s = max(0.0, (now_ns - track.seen_ns) / 1e9)
    ground_vx = None if ego_mps is None else vx + ego_mps
    oncoming = track.kind == "vehicle" and ground_vx is not None and ground_vx < ONCOMING_MPS
    heading = _heading(ground_vx, vy, oncoming)
    x_m, y_m = _middle(track, heading)
    sigma = np.sqrt(np.maximum(np.diagonal(track.estimate.covariance), 0.0)).tolist()
    return Track(
        track_id=track.track_id,
        kind=track.kind,
        x_m=x_m,
        y_m=y_m,
        vx_mps=vx,
        vy_mps=vy,
        ax_mps2=track.ax_mps2,
        length_m=track.body.length_m,
        width_m=track.body.width_m,
        heading_rad=heading,
        sigma_x_m=sigma[0],
        sigma_y_m=sigma[1],
        sigma_vx_mps=sigma[2],
        sigma_vy_mps=sigma[3],
        confidence=max(0.0, min(1.0, track.sure * (1.0 - 0.7 * unseen_s / COAST_S))),
        age_s=(now_ns - track.born_ns) / 1e9,
        unseen_s=unseen_s,
        steady_s=(track.seen_ns - track.steady_ns) / 1e9,
        oncoming=oncoming,
    )


def _heading(ground_vx: float | None, vy: float, oncoming: bool) -> float:
    """Its direction of motion where it moves over ground; otherwise along ours."""
    if ground_vx is None or math.hypot(ground_vx, vy) < 2.0:
        return math.pi if oncoming else 0.0
    return math.atan2(vy, ground_vx)


def _middle(track: Tracked, heading_rad: float) -> tuple[float, float]:
    """Half its extent along our axis behind the near surface, and aside by as much as it stands askew to us.

    In bends the middle of a road user beside our axis lies aside of the end that shows, by half its length along its own axis, or
    less where its flank shows too: then it lies behind what shows. A road user right ahead shows both of its sides, and the
    middle between them is its own.
    """
    near_m, left_m = track.estimate.mean[:2].tolist()
    ahead, aside = math.cos(heading_rad), math.sin(heading_rad)
    half_m, half_wide_m = track.body.length_m / 2, track.body.width_m / 2
    behind_m = abs(ahead) * half_m + abs(aside) * half_wide_m
    aside_m = min(1.0, abs(left_m) / half_wide_m) * aside * ahead * half_m
    in_line_m = behind_m * left_m / max(near_m, behind_m)
    if aside_m * in_line_m > 0:
        aside_m = min(aside_m, in_line_m, key=abs)
    return near_m + behind_m, left_m + aside_m
