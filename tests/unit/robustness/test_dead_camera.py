"""From the camera to the target: a lead that the camera stops showing goes on to bound how fast we may go."""

from collections.abc import Callable

import pytest

from proto.perception import Tracks
from proto.sensors import CameraFrame
from proto.vehicle import Ego
from services.orchestrator.observations.inputs import Stamped
from services.perception.checks.decoding import Malformed
from services.perception.pipeline import Perception
from tests.unit.services.orchestrator.support import TICK, Drive
from tests.unit.services.perception.pictures import plain, taken
from tests.unit.services.perception.test_pipeline import CALIBRATION, Told, car_at, sweep_of


class _Seeing:
    """A drive behind a car 20 m ahead at our own speed, with perception before the tick."""

    def __init__(self) -> None:
        self.detector = Told()
        self.perception = Perception(self.detector)
        self.perception.calibrate("front", CALIBRATION)
        self.drive = Drive(speed_mps=10.0, road="rural")
        self.tracks: Stamped[Tracks] | None = None
        self.seq = 0

    def look(self, frame: CameraFrame, *, shows_car: bool) -> None:
        """One more picture, and the tick after it."""
        stamp_ns = self.drive.now_ns + TICK
        self.detector.found = [car_at(20.0)] if shows_car else []
        self.perception.ego(stamp_ns, Ego(speed_mps=10.0, yaw_rate_radps=0.0))
        if shows_car:
            self.perception.sweep(stamp_ns, sweep_of(20.0))
        self.seq += 1
        try:
            tracks = self.perception.see("front", stamp_ns, frame).tracks
        except Malformed:
            self.drive.tick(tracks=self.tracks, unhealthy=("perception/tracks",))
            return
        assert tracks is not None
        self.tracks = Stamped(seq=self.seq, stamp_ns=stamp_ns, message=tracks)
        self.drive.tick(tracks=self.tracks)


@pytest.mark.parametrize(
    ("later", "shows_car"),
    [(lambda last: plain(0), False), (lambda last: plain(255), False), (lambda last: last, True)],
    ids=["black", "white", "frozen"],
)
def test_a_lead_bounds_the_target_as_long_as_the_camera_is_dead(
    later: Callable[[CameraFrame], CameraFrame], shows_car: bool
) -> None:
    seeing, last = _Seeing(), taken()
    for _ in range(15):
        last = taken()
        seeing.look(last, shows_car=True)
    bound_mps = seeing.drive.target_mps
    assert bound_mps < 15.0, "it is the car that bounds us, not the road's limit"
    for _ in range(80):
        seeing.look(later(last), shows_car=shows_car)
        assert seeing.drive.target_mps <= bound_mps + 0.2
    assert seeing.drive.state.world.actors is None
    assert "perception/tracks" in seeing.drive.state.world.degraded
