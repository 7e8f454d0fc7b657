"""Whether the right one leads, and how soon after it has come into our path.

The true lead is the next vehicle whose body reaches into the strip the ego needs along its lane (the simulator's
`in_ego_path`). A told lead is right where its track is paired with that vehicle.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from proto.perception import Tracks
from studies.tracking.pairing import GATE_M, REACH_M, Scene, Vehicle, near_m
from studies.tracking.seeing import View

FAR_ENOUGH_M = 2.0
"""Nearer vehicles stand beside the ego's own body."""
LOOKED_AT_S = 0.5
"""A vehicle that comes into our path from beside it was in view, beside it, for this long before."""
WAITED_S = 2.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Leads:
    """Shares of pictures: the right lead of those with one in view; a lead within reach of those with none there."""

    right: float
    pictures: int
    false: float
    free_pictures: int
    cut_ins: int
    cut_in_delays_s: tuple[float, ...]
    """Of each cut-in, from the body's entering the strip until it is the lead; 2 s stands for later or never."""


def leads(views: Sequence[View], scenes: Sequence[Scene]) -> Leads:
    """Over a drive's pictures and their scenes."""
    told = [_told(view, scene) for view, scene in zip(views, scenes, strict=True)]
    true = [true_lead(scene) for scene in scenes]
    wanted = [k for k, lead in enumerate(true) if lead is not None and lead.counts]
    free = [k for k, lead in enumerate(true) if lead is None or lead.x_m > REACH_M + GATE_M]
    delays = tuple(_delays_s(scenes, true, told))
    return Leads(
        right=sum(told[k] == true[k].actor_id for k in wanted) / max(len(wanted), 1),  # type: ignore[union-attr]
        pictures=len(wanted),
        false=sum(_leads_near(views[k].tracks) for k in free) / max(len(free), 1),
        free_pictures=len(free),
        cut_ins=len(delays),
        cut_in_delays_s=delays,
    )


def _leads_near(tracks: Tracks) -> bool:
    return any(each.track_id == tracks.lead_track_id and near_m(each) < REACH_M for each in tracks.tracks)


def true_lead(scene: Scene) -> Vehicle | None:
    """The next vehicle in the ego's path, counted or not."""
    ahead = [each for each in scene.everyone if each.in_ego_path and each.x_m > FAR_ENOUGH_M]
    return min(ahead, key=lambda each: each.x_m, default=None)


def _told(view: View, scene: Scene) -> int | None:
    """The actor that is told to lead; `None`: no track leads, or the leading track is of no actor."""
    owners = {track: actor for actor, track in scene.pairs.items()}
    lead = view.tracks.lead_track_id
    return owners.get(lead) if lead is not None else None


def _delays_s(scenes: Sequence[Scene], true: Sequence[Vehicle | None], told: Sequence[int | None]) -> Iterator[float]:
    for k in range(1, len(scenes)):
        lead = true[k]
        if lead is not None and lead.counts and _came_from_beside(scenes, k, lead.actor_id):
            yield _delay_s(scenes[k:], told[k:], lead.actor_id)


def _came_from_beside(scenes: Sequence[Scene], k: int, actor_id: int) -> bool:
    """Whether this picture is the first with the actor in our path, after a while of pictures beside it."""
    since_ns = scenes[k].stamp_ns - round(LOOKED_AT_S * 1e9)
    before = [scene for scene in scenes[:k] if scene.stamp_ns >= since_ns]
    beside = [any(v.actor_id == actor_id and v.counts and not v.in_ego_path for v in s.vehicles) for s in before]
    return scenes[k].stamp_ns - scenes[0].stamp_ns >= LOOKED_AT_S * 1e9 and all(beside)


def _delay_s(scenes: Sequence[Scene], told: Sequence[int | None], actor_id: int) -> float:
    for scene, lead in zip(scenes, told, strict=True):
        waited_s = (scene.stamp_ns - scenes[0].stamp_ns) / 1e9
        if lead == actor_id or waited_s >= WAITED_S:
            return min(waited_s, WAITED_S)
    return WAITED_S
