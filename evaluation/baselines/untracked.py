"""A tracker without memory: `perception.tracking = false`, the ablation of tracking. For simulation only."""

from collections.abc import Callable, Sequence

from msgspec.structs import replace

from proto.perception import Track
from services.perception.track.road_user import EgoState, Sighting
from services.perception.track.sweep_speed import Sweeps
from services.perception.track.tracker import BIRTH_SHARE, Tracker, as_message


class Untracked(Tracker):
    """Each picture's sightings are new tracks of age 0, as sure as their boxes, of unknown speed."""

    def step(
        self,
        stamp_ns: int,
        sightings: Sequence[Sighting],
        ego: EgoState,
        sees: Callable[[float, float], bool] = lambda x_m, y_m: True,
        sweeps: Sweeps | None = None,
    ) -> list[int]:
        """As a tracker does, all that was seen before forgotten."""
        self.tracks = ()
        return super().step(stamp_ns, sightings, ego, sees, sweeps)

    def published(self) -> list[Track]:
        """Everything that this picture shows."""
        sure = (replace(track, sure=min(1.0, track.sure / BIRTH_SHARE)) for track in self.tracks)
        return [as_message(track, self._now_ns, self._ego.speed_mps) for track in sure]
