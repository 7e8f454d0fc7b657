"""Boxes of nothing: which came, and how they went on from picture to picture."""

import math
from collections.abc import Mapping, Sequence
from itertools import accumulate, pairwise

from evaluation.modelled_sensors.card import NEAREST_GHOST_M, Clutter, Ghost, GhostBox, Surroundings, pace_of
from evaluation.modelled_sensors.sight import Lens, turn_rad
from proto.perception import Box
from services.simulator.session import CAMERA_STEPS, CAMERAS
from services.simulator.world import STEP_S
from studies.modelled_sensors.pairing import Stray

JOINED_S, JOINED_SIZES, JOINED_PX = 0.95, 0.8, 4.0
"""Boxes of nothing are one where the next comes within so many seconds and lies within so many of its sizes and pixels."""


def clutter(
    runs: Sequence[Sequence[Stray]], camera: str, minutes: Mapping[Surroundings, Sequence[float]]
) -> dict[Surroundings, tuple[Clutter, ...]]:
    """Of one camera's pictures. `minutes`: how long the ego went at each of `PACES_MPS` there."""
    lens = Lens(CAMERAS[camera])
    chains = [chain for strays in runs for chain in _chains([s for s in strays if s.camera == camera], lens)]
    picture_s = CAMERA_STEPS[camera][0] * STEP_S

    def began(where: Surroundings, pace: int) -> list[Ghost]:
        begun = [chain for chain in chains if (chain[0].surroundings, pace_of(chain[0].speed_mps)) == (where, pace)]
        return [_ghost(chain, picture_s) for chain in begun]

    return {
        where: tuple(_at_pace(began(where, pace), driven) for pace, driven in enumerate(at_pace))
        for where, at_pace in minutes.items()
    }


def _at_pace(ghosts: Sequence[Ghost], minutes: float) -> Clutter:
    return Clutter(per_minute=round(len(ghosts) / minutes, 4) if minutes > 0.0 else 0.0, ghosts=tuple(ghosts))


def _chains(strays: Sequence[Stray], lens: Lens) -> list[list[Stray]]:
    done: list[list[Stray]] = []
    for each in strays:
        joined = (chain for chain in done if _goes_on(chain[-1], each, lens))
        last = min(joined, key=lambda chain: _apart_px(chain[-1], each, lens), default=None)
        if last is None:
            done.append([each])
        else:
            last.append(each)
    return done


def _goes_on(last: Stray, now: Stray, lens: Lens) -> bool:
    if last.box.kind != now.box.kind or not 0 < now.stamp_ns - last.stamp_ns <= JOINED_S * 1e9:
        return False
    return _apart_px(last, now, lens) <= JOINED_SIZES * (last.box.y1_px - last.box.y0_px) + JOINED_PX


def _apart_px(last: Stray, now: Stray, lens: Lens) -> float:
    """How far the later box lies from where the ego's turn put the earlier one."""
    (u, v), (now_u, now_v) = (((b.x0_px + b.x1_px) / 2, (b.y0_px + b.y1_px) / 2) for b in (last.box, now.box))
    return math.hypot(now_u - lens.aside(u, turn_rad(last.heading_rad, now.heading_rad)), now_v - v)


def _ghost(chain: Sequence[Stray], picture_s: float) -> Ghost:
    began_ns = chain[0].stamp_ns
    steps_m = [
        (now.speed_mps + last.speed_mps) / 2 * (now.stamp_ns - last.stamp_ns) / 1e9 for last, now in pairwise(chain)
    ]
    boxes = (
        GhostBox(
            after_s=round((each.stamp_ns - began_ns) / 1e9, 3),
            driven_m=round(driven_m, 2),
            step_m=round(each.speed_mps * picture_s, 3),
            turned_rad=round(turn_rad(chain[0].heading_rad, each.heading_rad), 5),
            box=_edges(each.box),
            score=round(each.box.score, 3),
            range_m=_away(each.box) if each.box.range_source == "lidar" else None,
            seen_through=each.box.seen_through,
        )
        for each, driven_m in zip(chain, accumulate(steps_m, initial=0.0), strict=True)
    )
    return Ghost(kind=chain[0].box.kind, boxes=tuple(boxes), moving=pace_of(chain[0].speed_mps) > 0)


def _edges(box: Box) -> tuple[float, float, float, float]:
    return round(box.x0_px, 1), round(box.y0_px, 1), round(box.x1_px, 1), round(box.y1_px, 1)


def _away(box: Box) -> float:
    return round(max(box.range_m or NEAREST_GHOST_M, NEAREST_GHOST_M), 2)
