"""The road users as they truly are, published as perception's tracks with its pictures' stamps."""

import msgspec

from proto import topics
from proto.perception import Track, Tracks
from proto.truth import TrueActor, Truth
from services.perception.lanes.lead_vehicle import crosses, place
from services.perception.lanes.model import lane_model

ONCOMING_MPS = -2.0
BEHIND_M = -8.0
_STRAIGHT = lane_model(None)
"""A road user that crosses soon does so near enough for the way to be straight ahead."""
SETTLED_S = 0.2
"""Over which an acceleration is measured: two truths a step apart differ by rounding."""


class TrueTracks:
    """The truth's actors, moved to each picture's stamp."""

    topic = topics.TRACKS

    def __init__(self) -> None:
        self._now: tuple[int, Truth] | None = None
        self._first_ns: dict[int, int] = {}
        self._speeds: dict[int, tuple[int, float, float]] = {}
        """Actor to stamp, speed along the road over ground, and acceleration."""

    def truth(self, truth: Truth, stamp_ns: int) -> None:
        """Take what is so at a stamp; the tracks leave with the pictures."""
        self._now = (stamp_ns, truth)
        here = {actor.actor_id for actor in truth.actors}
        self._first_ns = {each: self._first_ns.get(each, stamp_ns) for each in here}
        self._speeds = {actor.actor_id: self._sped(actor, truth, stamp_ns) for actor in truth.actors}

    def instead(self, message: Tracks, stamp_ns: int) -> Tracks | None:
        """The true tracks of a picture; none before there is truth."""
        if self._now is None:
            return None
        truth_ns, truth = self._now
        dt_s = (stamp_ns - truth_ns) / 1e9
        tracks = tuple(self._track(actor, truth, stamp_ns, dt_s) for actor in truth.actors if actor.x_m > BEHIND_M)
        ahead = [t for t in tracks if t.in_ego_path and t.kind == "vehicle" and not t.oncoming and t.x_m > 0.0]
        lead = min(ahead, key=lambda track: track.x_m, default=None)
        return msgspec.structs.replace(message, tracks=tracks, lead_track_id=lead.track_id if lead else None)

    def _sped(self, actor: TrueActor, truth: Truth, stamp_ns: int) -> tuple[int, float, float]:
        ground = actor.vx_mps + truth.speed_mps
        known = self._speeds.get(actor.actor_id)
        if known is None:
            return stamp_ns, ground, 0.0
        dt_s = (stamp_ns - known[0]) / 1e9
        return known if dt_s < SETTLED_S else (stamp_ns, ground, (ground - known[1]) / dt_s)

    def _track(self, actor: TrueActor, truth: Truth, stamp_ns: int, dt_s: float) -> Track:
        ground = actor.vx_mps + truth.speed_mps
        age_s = max(0.0, (stamp_ns - self._first_ns[actor.actor_id]) / 1e9)
        track = Track(
            track_id=actor.actor_id + 1,
            kind="pedestrian" if actor.kind == "pedestrian" else "vehicle",
            x_m=actor.x_m + actor.vx_mps * dt_s,
            y_m=actor.y_m + actor.vy_mps * dt_s,
            vx_mps=actor.vx_mps,
            vy_mps=actor.vy_mps,
            ax_mps2=self._speeds[actor.actor_id][2],
            length_m=actor.length_m,
            width_m=actor.width_m,
            sigma_x_m=0.1,
            sigma_vx_mps=0.1,
            confidence=1.0,
            age_s=age_s,
            steady_s=age_s,
            in_ego_path=actor.in_ego_path,
            oncoming=actor.kind != "pedestrian" and ground < ONCOMING_MPS,
        )
        if track.in_ego_path or not crosses(track, truth.speed_mps):
            return track
        soon = place(track, _STRAIGHT, truth.speed_mps).track.in_ego_path  # truth says only who is in the path now
        return msgspec.structs.replace(track, in_ego_path=soon)
