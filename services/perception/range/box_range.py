"""How far away a box is: from LiDAR returns inside it, from where it stands on the ground, from its size.

A range is the depth along the camera's axis of the surface that faces the camera, with a standard deviation. LiDAR
counts where it agrees with the picture; otherwise ground and size are weighed by their variances.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from proto.perception import ObjectClass
from services.perception.detect.detection import Detection
from services.perception.range.camera import Camera, Floats
from services.perception.range.sizes import PRIORS, prior_of

RangeSource = Literal["lidar", "ground", "size", "none"]
GROUND_CLEARANCE_M = 0.25
"""Returns lower than this are the road."""
CLUSTER_GAP_M = 0.8
CLUSTER_GAP_SHARE = 0.03
"""Returns further apart than the sum of the two (the second of the range) are two surfaces."""
NEAR_QUANTILE = 0.25
SIDES_RETURNS, SIDE_QUANTILE = 8, 0.05
"""So many returns tell how broad a thing is; the outermost of them may be another's."""
AGREEMENT_SIGMAS = 3.0
LONELY_SIGMA_M, HIDDEN_MORE_M = {1: 0.3, 2: 0.1}, {1: 0.7, 2: 0.2}
"""One or two returns may come from something else in the box. Of 1,662 single returns from a whole vehicle seven in a thousand were more
than 2 m off, the others by 0.1 m. From a vehicle that is hidden in part one in twenty to one in two were, and about as
many from two returns."""
SHOWN_M = 1.3
"""A vehicle of which less than this width shows is hidden in part, by something that has no box."""
BOTTOM_SIGMA_PX = 1.5
BOTTOM_SIGMA_SHARE = 0.04
"""How well a box's lower edge sits on the tyres: pixels, plus a share of the box's height."""
LIDAR_SURE_M, BEHIND_M = 45.0, 5.0
"""Nearer than the first a road user ought to give returns; returns further behind than the second are another thing's."""
EDGE_PX = 2.0
COVER_PX, COVER_SHARE = 2.0, 0.05
"""By how much a covering box is widened, for boxes are not exact: pixels, plus a share of its size."""
TOUCHING_SHARE = 0.3
"""Of its height, half a metre of a car: boxes no further apart may be of one that hides the other, for where a part of a road user
is all that shows, its box ends before that part does. Of 4,080 places of parked cars 2.9 % were 0.8 m too far inwards, 3.8 % before."""
BEFORE_PX = 2.0
"""Lower edges nearer to each other than this do not tell which road user stands before which."""
HEIGHT_SLACK_PX = 2.0
"""By how much a box may be lower than the vehicle in it."""
THIN_SHARE, BROAD_SHARE = 0.2, 0.4
"""Of a box's width: a cluster of returns that spans less is a post's, one that spans more a vehicle's."""
POST_PX = 2.0
"""Returns of a post lie no further aside of each other, and go on by more than this above or below a box behind it."""
POST_SHARE: dict[ObjectClass, float] = {"vehicle": 1.0, "pedestrian": 0.25}
"""How many do so, by those in the box. Of 4,820 rendered people with a measured range, 162 had one more than a metre too near;
with this and `TOUCHING_SHARE` 86 have, and none of the right ones was lost."""
FURTHEST_M = 250.0
STANDING = frozenset({"vehicle", "pedestrian"})


@dataclass(frozen=True, slots=True, kw_only=True)
class Range:
    """Depth along the camera's axis, its standard deviation, where it comes from, how many returns support it, between where."""

    depth_m: float
    sigma_m: float
    source: RangeSource
    returns: int = 0
    sides_m: tuple[float, float] | None = None
    """Where its returns begin and end across the camera's axis, to the right; None: they do not tell."""
    seen_through: bool = False
    """LiDAR measured what lies behind there, and nothing there."""


@dataclass(frozen=True, slots=True, eq=False)
class ProjectedSweep:
    """The returns of a sweep that lie before a camera: pixels (N, 2), depths (N,), metres to the right of its axis (N,)."""

    pixels: Floats
    depths: Floats
    across: Floats

    @staticmethod
    def of(points: Floats, camera: Camera) -> ProjectedSweep:
        """Ego-frame points (N, 3 or more) above the road, as the camera would see them."""
        standing = points[points[:, 2] > GROUND_CLEARANCE_M, :3]
        pixels, depths = camera.project(standing)
        ahead = depths > 0.5
        pixels, depths = pixels[ahead], depths[ahead]
        c = camera.calibration
        return ProjectedSweep(pixels, depths, (pixels[:, 0] - c.cx_px) / c.fx_px * depths)

    def part(self, chosen: NDArray[np.bool_]) -> ProjectedSweep:
        """The chosen returns alone."""
        return ProjectedSweep(self.pixels[chosen], self.depths[chosen], self.across[chosen])

    def outside(self, boxes: Sequence[Detection]) -> ProjectedSweep:
        """The returns that lie in none of the boxes."""
        free = np.ones(len(self.depths), dtype=np.bool_)
        for box in boxes:
            free &= ~_within(
                box, self.pixels, *(-COVER_PX - COVER_SHARE * size for size in (box.width_px, box.height_px))
            )
        return self.part(free)


def find_range(
    detection: Detection, camera: Camera, sweep: ProjectedSweep | None, hiding: Sequence[Detection] = ()
) -> Range | None:
    """The best range there is for a box (undistorted pixels); None where nothing can be said.

    Returns inside the boxes that hide a part of it belong to those.
    """
    seen = _weigh(_possible(ground_range(detection, camera), detection, camera), size_range(detection, camera))
    nearest_m = 0.0 if hiding else nearest_possible_m(detection, camera)
    measured = lidar_range(detection, sweep.outside(hiding), seen, nearest_m) if sweep is not None else None
    if measured is None:
        through = seen is not None and sweep is not None and _seen_through(detection, sweep, seen)
        return replace(seen, seen_through=True) if seen is not None and through else seen
    shown_m = detection.width_px * measured.depth_m / camera.calibration.fx_px
    if detection.kind == "vehicle" and not hiding and shown_m >= SHOWN_M:
        return measured
    return replace(measured, sigma_m=measured.sigma_m + HIDDEN_MORE_M.get(measured.returns, 0.0))


def nearest_possible_m(detection: Detection, camera: Camera) -> float:
    """Nearer than this a whole vehicle's box would be lower than any vehicle: returns from there are of a post before it.

    0 for people, who must not be thought further away than something in their box is, and for boxes that are cut off.
    """
    c = camera.calibration
    if detection.kind != "vehicle" or detection.y0_px <= EDGE_PX or detection.y1_px >= c.height_px - EDGE_PX:
        return 0.0
    return PRIORS["vehicle"].possible_m[0] * c.fy_px / (detection.height_px + HEIGHT_SLACK_PX)


def hiding(detection: Detection, others: Sequence[Detection]) -> list[Detection]:
    """The road users that stand before this one in the picture and cover a part of its box: their feet are lower."""
    return [
        other
        for other in others
        if other.kind in STANDING
        and other.y1_px > detection.y1_px + BEFORE_PX
        and min(other.x1_px, detection.x1_px) + TOUCHING_SHARE * detection.height_px > max(other.x0_px, detection.x0_px)
        and other.y0_px < detection.y1_px
    ]


def lidar_range(
    detection: Detection, sweep: ProjectedSweep, seen: Range | None, nearest_m: float = 0.0
) -> Range | None:
    """From the returns in the inner part of the box: the nearest surface of enough returns that the picture allows.

    Rain gives single returns before the object, the background returns behind it; both fall into clusters of their own.
    None is nearer than `nearest_m`.
    """
    inner = sweep.part(_inside(detection, sweep.pixels))
    depths = np.sort(inner.depths)
    if not len(depths):
        return None
    breaks = np.flatnonzero(np.diff(depths) > CLUSTER_GAP_M + CLUSTER_GAP_SHARE * depths[:-1]) + 1
    enough = max(1 if seen is not None else 2, math.ceil(0.15 * len(depths)))
    allowed = [
        cluster
        for cluster in np.split(depths, breaks)
        if len(cluster) >= enough
        and cluster[0] >= nearest_m
        and (seen is None or _agrees(float(cluster[0]), seen))
        and not _post(cluster, detection, inner, sweep)
    ]
    if not allowed:
        return None
    cluster = _broad(allowed, detection, inner)
    return replace(_of_cluster(cluster), sides_m=_sides(detection, sweep, cluster))


def _broad(clusters: Sequence[Floats], detection: Detection, inner: ProjectedSweep) -> Floats:
    """The nearest cluster; but of a vehicle's box the nearest that spans it, where what is nearer is as thin as a post."""
    nearest = clusters[0]
    if detection.kind != "vehicle" or len(clusters) == 1 or _span(nearest, detection, inner) > THIN_SHARE:
        return nearest
    return next((each for each in clusters[1:] if _span(each, detection, inner) > BROAD_SHARE), nearest)


def _post(cluster: Floats, detection: Detection, inner: ProjectedSweep, sweep: ProjectedSweep) -> bool:
    """Whether returns in a road user's box are of a post before it: thin, and going on above and below the box, within its height."""
    if detection.kind not in POST_SHARE or _span(cluster, detection, inner) > THIN_SHARE:
        return False
    columns = inner.pixels[_as_deep(inner, cluster, CLUSTER_GAP_M), 0]
    beside = (sweep.pixels[:, 0] >= columns.min() - POST_PX) & (sweep.pixels[:, 0] <= columns.max() + POST_PX)
    rows = sweep.pixels[beside & _as_deep(sweep, cluster, CLUSTER_GAP_M), 1]
    beyond = np.maximum(detection.y0_px - rows, rows - detection.y1_px)
    return bool(
        ((beyond > POST_PX) & (beyond < detection.height_px)).sum() >= POST_SHARE[detection.kind] * len(cluster)
    )


def _span(cluster: Floats, detection: Detection, inner: ProjectedSweep) -> float:
    """Across how much of the box's width a cluster's returns lie."""
    own = _as_deep(inner, cluster)
    return float(np.ptp(inner.pixels[own, 0])) / max(detection.width_px, 1.0)


def _as_deep(sweep: ProjectedSweep, cluster: Floats, slack_m: float = 0.0) -> NDArray[np.bool_]:
    """Which returns lie no nearer and no further than the cluster."""
    found: NDArray[np.bool_] = (sweep.depths >= cluster[0] - slack_m) & (sweep.depths <= cluster[-1] + slack_m)
    return found


def _sides(detection: Detection, sweep: ProjectedSweep, cluster: Floats) -> tuple[float, float] | None:
    """Of the returns in the whole box that lie no nearer and no further than the cluster; too few do not tell."""
    own = _within(detection, sweep.pixels, 0.0, 0.0) & _as_deep(sweep, cluster)
    if own.sum() < SIDES_RETURNS:
        return None
    low, high = np.quantile(sweep.across[own], [SIDE_QUANTILE, 1.0 - SIDE_QUANTILE])
    return float(low), float(high)


def _seen_through(detection: Detection, sweep: ProjectedSweep, found: Range) -> bool:
    """Whether returns come from well behind where the road user in the box is said to be, and none from there."""
    if detection.kind not in STANDING or found.depth_m > LIDAR_SURE_M:
        return False
    depths = sweep.depths[_inside(detection, sweep.pixels)]
    edge = found.depth_m + max(AGREEMENT_SIGMAS * found.sigma_m, BEHIND_M)
    return bool(len(depths) >= 2 and (depths > edge).mean() > 0.7)


def _inside(detection: Detection, pixels: Floats) -> NDArray[np.bool_]:
    return _within(detection, pixels, 0.1 * detection.width_px, 0.08 * detection.height_px)


def _within(detection: Detection, pixels: Floats, margin_u: float, margin_v: float) -> NDArray[np.bool_]:
    low = (detection.x0_px + margin_u, detection.y0_px + margin_v)
    high = (detection.x1_px - margin_u, detection.y1_px - margin_v)
    inside: NDArray[np.bool_] = np.all((pixels >= low) & (pixels <= high), axis=1)
    return inside


def _agrees(depth_m: float, seen: Range) -> bool:
    return abs(depth_m - seen.depth_m) <= AGREEMENT_SIGMAS * max(seen.sigma_m, 0.15 * seen.depth_m)


def _of_cluster(cluster: Floats) -> Range:
    near = float(np.quantile(cluster, NEAR_QUANTILE))
    spread = float(np.quantile(cluster, 0.5)) - near
    sigma = 0.1 + 0.3 * spread + LONELY_SIGMA_M.get(len(cluster), 0.0)
    return Range(depth_m=near, sigma_m=sigma, source="lidar", returns=len(cluster))


def ground_range(detection: Detection, camera: Camera) -> Range | None:
    """From the lower edge of a box that stands on a level road; None for what hangs, or where the picture cuts it off."""
    c = camera.calibration
    if detection.kind not in STANDING or detection.y1_px >= c.height_px - EDGE_PX:
        return None
    ray = camera.ray(detection.centre_px[0], detection.y1_px)
    if ray[2] >= -1e-4:
        return None
    depth = float(-camera.eye[2] / ray[2])
    sigma_px = math.hypot(BOTTOM_SIGMA_PX + BOTTOM_SIGMA_SHARE * detection.height_px, camera.pitch_sigma_rad * c.fy_px)
    sigma = depth * depth / float(camera.eye[2]) * sigma_px / c.fy_px
    return Range(depth_m=depth, sigma_m=sigma, source="ground") if depth < FURTHEST_M else None


def size_range(detection: Detection, camera: Camera) -> Range | None:
    """From the usual height of the class; a box cut off by the picture's edge only says that the object is near."""
    c, prior = camera.calibration, prior_of(detection.kind, detection.width_px, detection.height_px)
    cut = detection.y1_px >= c.height_px - EDGE_PX or detection.y0_px <= EDGE_PX
    depth = float(prior.height_m * c.fy_px / max(detection.height_px, 1.0))
    spread = math.hypot(prior.spread, 2.0 / max(detection.height_px, 1.0)) * (2.0 if cut else 1.0)
    return Range(depth_m=depth, sigma_m=depth * spread, source="size") if depth < FURTHEST_M else None


def _possible(ground: Range | None, detection: Detection, camera: Camera) -> Range | None:
    """The ground's range unless the object would have an impossible height there: then the road is not level."""
    if ground is None:
        return None
    low, high = PRIORS[detection.kind].possible_m
    return ground if low <= detection.height_px * ground.depth_m / camera.calibration.fy_px <= high else None


def _weigh(ground: Range | None, size: Range | None) -> Range | None:
    """Both weighed by variance; where they contradict each other the ground counts, and the doubt shows in its sigma."""
    if ground is None or size is None:
        return ground or size
    apart = abs(ground.depth_m - size.depth_m)
    if apart > 2.5 * math.hypot(ground.sigma_m, size.sigma_m):
        return Range(depth_m=ground.depth_m, sigma_m=math.hypot(ground.sigma_m, apart / 3), source="ground")
    weights = ground.sigma_m**-2, size.sigma_m**-2
    depth = (ground.depth_m * weights[0] + size.depth_m * weights[1]) / sum(weights)
    source: RangeSource = "ground" if weights[0] >= weights[1] else "size"
    return Range(depth_m=depth, sigma_m=sum(weights) ** -0.5, source=source)
