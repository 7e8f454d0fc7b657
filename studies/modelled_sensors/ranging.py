"""How far measured ranges are off: by what hides a thing, the errors that recorded ones had, and for how long they last."""

import math
from collections import defaultdict
from collections.abc import Sequence
from statistics import NormalDist

import numpy as np

from evaluation.modelled_sensors.card import FEATURES, REGIMES, SPREADS, Line, RangeErrors, Ranging, regime_of
from services.simulator.session import CAMERAS
from studies.modelled_sensors.lines import chains, odds, rows_of
from studies.modelled_sensors.pairing import Look
from training.regression import Floats, memory_s

ENOUGH = 40
"""Measured ranges of a camera and class below which they are not fitted alone: those of all cameras are taken together."""
ENOUGH_ALIKE = 20
"""The same for what hides a thing: below it, all count."""
STANDS_MPS = 0.5
SWEEP_AGE_S = 0.09
"""By how much the sweep is older than the picture: so far off were the ranges of those that drive, per metre a second."""
_NEVER = Line(weights=(-9.0, *(0.0 for _ in FEATURES[1:])))
_NORMAL = NormalDist()


def ranging(looks: Sequence[Look]) -> Ranging:
    """Of one class, in one camera or in all."""
    mine = [each for each in looks if each.box is not None and each.box.range_m is not None]
    measured = [each for each in mine if each.box is not None and each.box.range_source == "lidar"]
    if not measured:
        return Ranging(lidar=_NEVER, pictures=len(mine))
    is_lidar = np.array([float(each.box is not None and each.box.range_source == "lidar") for each in mine])
    return Ranging(
        lidar=odds(mine, rows_of(mine), is_lidar),
        errors={name: _errors(_alike(measured, name)) for name in REGIMES},
        pictures=len(mine),
    )


def _alike(looks: Sequence[Look], regime: str) -> Sequence[Look]:
    """Of things that stand, if there are enough: of others it is not known how far they drove since the sweep."""
    for among in ([each for each in looks if abs(each.thing.ahead_mps) < STANDS_MPS], looks):
        same = [
            each for each in among if regime_of(each.thing.hidden, each.thing.cut, each.thing.full_height_px) == regime
        ]
        if len(same) >= ENOUGH_ALIKE:
            return same
    return looks


def _errors(looks: Sequence[Look]) -> RangeErrors:
    """Their quantiles; and how long an error's rank among them is remembered."""
    off = np.array([range_error(each) for each in looks])
    ranks = np.array([_NORMAL.inv_cdf((rank + 0.5) / len(off)) for rank in _ranks(off)])
    steps = np.quantile(off, [_NORMAL.cdf(step) for step in SPREADS])
    own, rests = _own(looks, ranks)
    return RangeErrors(
        quantiles=tuple(round(float(each), 5) for each in steps),
        own=round(own, 3),
        memory_s=round(memory_s(chains(looks, rests, np.ones(len(off)))), 4),
    )


def _own(looks: Sequence[Look], ranks: Floats) -> tuple[float, Floats]:
    """Share of the variance that lies between things, and what is left within them (one-way analysis of variance)."""
    places: dict[tuple[str, str], list[int]] = defaultdict(list)
    for k, each in enumerate(looks):
        places[each.camera, each.thing.key].append(k)
    rests = ranks.copy()
    for where in places.values():
        rests[where] -= ranks[where].mean()
    many = [where for where in places.values() if len(where) > 1]
    spare = sum(len(where) - 1 for where in many)
    within = sum(float((rests[where] ** 2).sum()) for where in many) / spare if spare else 1.0
    return min(max(1.0 - within / max(float(ranks.var()), 1e-9), 0.0), 0.99), rests


def _ranks(values: Floats) -> list[int]:
    told = [0] * len(values)
    for rank, k in enumerate(np.argsort(values, kind="stable").tolist()):
        told[k] = rank
    return told


def range_error(look: Look) -> float:
    """Share by which a measured range is off; what the thing drove since the sweep the tracker knows of, and it is no error."""
    box, camera = look.box, CAMERAS[look.camera]
    assert box is not None
    assert box.range_m is not None
    u = (box.x0_px + box.x1_px - camera.width_px) / 2 / camera.focal_px
    v = (box.y0_px + box.y1_px - camera.height_px) / 2 / camera.focal_px
    return (box.range_m / math.hypot(1.0, u, v) + look.thing.ahead_mps * SWEEP_AGE_S) / look.thing.depth_m - 1.0
