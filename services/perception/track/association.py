"""Assigns sightings to tracks: gating, by the squared Mahalanobis distance, and the cost of each pair."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Sequence

import numpy as np

from services.perception.track.kalman import Fix, Floats, correction, distance, rescaled
from services.perception.track.road_user import Sighting, Tracked


def greedy(pairs: Iterable[tuple[float, int, int]]) -> list[tuple[int, int]]:
    """From (cost, left, right), pairs in the order of their cost, each left and each right at most once.

    Greedy rather than optimal: gates are tight here and crowds small, so that the two hardly ever differ.
    """
    taken_left: set[int] = set()
    taken_right: set[int] = set()
    chosen = []
    for _, left, right in sorted(pairs):
        if left not in taken_left and right not in taken_right:
            chosen.append((left, right))
            taken_left.add(left)
            taken_right.add(right)
    return chosen


GATE = 13.8
"""Squared Mahalanobis distance that one true fix in a thousand exceeds (chi-square, two degrees of freedom)."""
SWERVE_GATE, SWERVE_M = 60.0, 2.5
"""A confirmed track left without a fix takes a measured one that is left over as well, this near: it swerved or braked
harder than its noise allows for. Squared Mahalanobis distance, and metres. After a drop-out only where no two bodies
could stand: else it would take what stands beside it."""
BEFORE_M, BEFORE_S, BEFORE_SIGMAS, BEFORE_SIGMA_M = 2.5, 0.5, 3.0, 0.1
"""A pedestrian does not leap nearer from picture to picture: a range that much short at a known person's bearing is of a post before the
person. For so long the person's bearing alone counts. How well the two bearings agree; and what is added to the across sigma, since
the bearings are not the eye's."""
SURE_SHARE = 0.03
"""A fix with a smaller sigma than this share of its range is a measured one; those by size or ground are not."""
SCALE_SIGMA = 0.2
"""Of the logarithm of the factor by which guessed ranges are wrong."""
MOST_FACTOR, NEAR_M = 2.0, 5.0
"""Between a fix and its track's range; nearer than the second all counts as that."""
CONTRADICTION = 9.2
"""Squared Mahalanobis distance that one true fix in a hundred exceeds: of a first measured range and a second that is so far off, one
is of something else."""
DOUBTED = 0.3
"""Boxes with a lower score go on with tracks that no other box took, and begin none (Zhang et al. 2022)."""


def pairs(tracks: Sequence[Tracked], sightings: Sequence[Sighting]) -> list[tuple[int, int]]:
    """Track and sighting, by index: first of the sightings that are not doubted, then of the others and the tracks left over."""
    found: list[tuple[int, int]] = []
    for doubted in (False, True):
        taken = {left for left, _ in found}
        lefts = [left for left in range(len(tracks)) if left not in taken]
        rights = [right for right, each in enumerate(sightings) if (each.score < DOUBTED) is doubted]
        matched = _pairs([tracks[left] for left in lefts], [sightings[right] for right in rights])
        found += [(lefts[left], rights[right]) for left, right in matched]
    return found


def _pairs(tracks: Sequence[Tracked], sightings: Sequence[Sighting]) -> list[tuple[int, int]]:
    """The likely pairs first, then, of the tracks left over, those that swerved.

    What a track of measured range explains is no first range of another whose own was only guessed.
    """
    costs = list(_costs(tracks, sightings, _likely))
    explained = {right for _, left, right in costs if tracks[left].confirmed and tracks[left].ranged}
    likely = greedy(
        (cost, left, right)
        for cost, left, right in costs
        if not (right in explained and scales(tracks[left], sightings[right].fix))
    )
    lefts, rights = ({pair[side] for pair in likely} for side in (0, 1))
    swerved = greedy(
        (cost, left, right)
        for cost, left, right in _costs(tracks, sightings, _swerved)
        if left not in lefts and right not in rights
    )
    return [*likely, *swerved]


def _costs(
    tracks: Sequence[Tracked], sightings: Sequence[Sighting], fits: Callable[[Tracked, Sighting, float], bool]
) -> Iterator[tuple[float, int, int]]:
    for left, track in enumerate(tracks):
        for right, sighting in enumerate(sightings):
            if track.kind == sighting.kind and _as_far(track.estimate.mean, sighting.fix.place):
                squared, cost = _apart(track, sighting.fix)
                if fits(track, sighting, squared):
                    yield cost, left, right


def _apart(track: Tracked, fix: Fix) -> tuple[float, float]:
    """Squared distance and cost; of a first measured range those of the scaled estimate, and of how much it scales."""
    if not scales(track, fix):
        return distance(track.estimate, fix)
    squared, cost = distance(rescaled(track.estimate, fix), fix)
    doubt = (math.log(correction(track.estimate, fix)) / SCALE_SIGMA) ** 2
    return squared + doubt, cost + doubt


def scales(track: Tracked, fix: Fix) -> bool:
    """Whether a fix is the first measured range of a vehicle whose own were only guessed."""
    return track.kind == "vehicle" and not track.ranged and is_measured(fix)


def contradicts(track: Tracked, fix: Fix, squared: float) -> bool:
    """Whether a fix so far off speaks against the one measured range that its track has, rather than of a speed or a swerve."""
    return squared > CONTRADICTION and track.ranges == 1 and is_measured(fix)


def _likely(track: Tracked, sighting: Sighting, squared: float) -> bool:
    return squared <= GATE


def falls_short(track: Tracked, fix: Fix, squared: float) -> bool:
    """Whether a fix has a known person's bearing, but the range of something before the person."""
    known = track.kind == "pedestrian" and track.confirmed and track.ranged
    if not known or squared <= GATE or track.seen_ns - track.placed_ns > BEFORE_S * 1e9 or not is_measured(fix):
        return False
    ray, aside = _sight(fix)
    off = fix.matrix() @ track.estimate.mean - fix.place
    spread = float(aside @ (track.estimate.covariance[:2, :2] + fix.covariance) @ aside) + BEFORE_SIGMA_M**2
    return 0.0 < float(ray @ off) <= BEFORE_M and float(aside @ off) ** 2 <= BEFORE_SIGMAS**2 * spread


def by_bearing(track: Tracked, fix: Fix) -> Fix:
    """The fix at the range where its track is expected, which tells nothing of the range."""
    ray, aside = _sight(fix)
    expected = fix.matrix() @ track.estimate.mean
    place = float(ray @ expected) * ray
    stretch = float(np.linalg.norm(place)) / max(float(np.linalg.norm(fix.place)), 1e-6)
    across = stretch**2 * float(aside @ fix.covariance @ aside) + BEFORE_SIGMA_M**2
    along = float(np.trace(track.estimate.covariance[:2, :2])) + BEFORE_M**2
    covariance: Floats = along * np.outer(ray, ray) + across * np.outer(aside, aside)
    return Fix(place, covariance, fix.age_s)


def _sight(fix: Fix) -> tuple[Floats, Floats]:
    """The directions towards a fix and across it, to the left."""
    ray = fix.place / max(float(np.linalg.norm(fix.place)), 1e-6)
    return ray, np.array([-ray[1], ray[0]])


def _swerved(track: Tracked, sighting: Sighting, squared: float) -> bool:
    if falls_short(track, sighting.fix, squared):
        return True
    if not (track.confirmed and squared <= SWERVE_GATE and is_measured(sighting.fix)):
        return False
    along_m, across_m = np.abs(sighting.fix.place - sighting.fix.matrix() @ track.estimate.mean).tolist()
    # Two bodies cannot stand in each other: what is seen in the track's own is the same one.
    one_body = along_m < track.body.length_m and across_m < (track.body.width_m + sighting.body.width_m) / 2
    return math.hypot(along_m, across_m) <= SWERVE_M and (not track.missed or one_body)


def _as_far(mean: Floats, place: Floats) -> bool:
    """Whether both are about equally far away: a range by size is vague, but vague as a factor, and nothing is it all along a ray."""
    ours, theirs = (max(NEAR_M, math.hypot(float(x), float(y))) for x, y in (mean[:2], place))
    return 1.0 / MOST_FACTOR <= ours / theirs <= MOST_FACTOR


def is_measured(fix: Fix) -> bool:
    """Whether its range is measured, not guessed by size or ground."""
    return math.sqrt(float(fix.covariance[0, 0])) < SURE_SHARE * max(NEAR_M, math.hypot(*fix.place.tolist()))
