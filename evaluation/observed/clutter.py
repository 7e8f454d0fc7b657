"""Boxes of nothing: which came, how long they stayed, and how they moved in the picture meanwhile."""

import math
from collections.abc import Sequence

import numpy as np

from evaluation.observed.card import Clutter, Ghost
from evaluation.observed.pairing import Stray
from proto.perception import Box

NEAREST_GHOST_M = 3.0
JOINED_S, JOINED_SIZES, JOINED_PX = 0.45, 0.6, 3.0
"""Boxes of nothing are one where the next comes within so many seconds and lies within so many of its sizes and pixels."""


def clutter(runs: Sequence[Sequence[Stray]], camera: str, minutes: float, period_s: float) -> Clutter:
    """Of one camera's pictures, which come each `period_s`."""
    ghosts = [
        _ghost(chain, period_s) for strays in runs for chain in _chains([s for s in strays if s.camera == camera])
    ]
    return Clutter(per_minute=round(len(ghosts) / max(minutes, 1e-9), 4), ghosts=tuple(ghosts))


def _chains(strays: Sequence[Stray]) -> list[list[Stray]]:
    done: list[list[Stray]] = []
    for each in strays:
        last = min(
            (c for c in done if _goes_on(c[-1], each)), key=lambda c: _apart_px(c[-1].box, each.box), default=None
        )
        if last is None:
            done.append([each])
        else:
            last.append(each)
    return done


def _goes_on(last: Stray, now: Stray) -> bool:
    if last.box.kind != now.box.kind or not 0 < now.stamp_ns - last.stamp_ns <= JOINED_S * 1e9:
        return False
    return _apart_px(last.box, now.box) <= JOINED_SIZES * (last.box.y1_px - last.box.y0_px) + JOINED_PX


def _apart_px(a: Box, b: Box) -> float:
    return math.hypot(a.x0_px + a.x1_px - b.x0_px - b.x1_px, a.y0_px + a.y1_px - b.y0_px - b.y1_px) / 2


def _ghost(chain: Sequence[Stray], period_s: float) -> Ghost:
    first, last = chain[0].box, chain[-1].box
    seconds = (chain[-1].stamp_ns - chain[0].stamp_ns) / 1e9
    ranges = [_away(each.box) for each in chain if each.box.range_source == "lidar"]
    return Ghost(
        kind=first.kind,
        box=_edges(first),
        last_box=_edges(last),
        score=round(float(np.mean([each.box.score for each in chain])), 3),
        lidar=round(len(ranges) / len(chain), 3),
        range_m=ranges[0] if ranges else None,
        last_range_m=ranges[-1] if ranges else None,
        seconds=round(seconds, 2),
        shown=round(min(1.0, len(chain) / (seconds / period_s + 1.0)), 3),
    )


def _edges(box: Box) -> tuple[float, float, float, float]:
    return round(box.x0_px, 1), round(box.y0_px, 1), round(box.x1_px, 1), round(box.y1_px, 1)


def _away(box: Box) -> float:
    return round(max(box.range_m or NEAREST_GHOST_M, NEAREST_GHOST_M), 2)
