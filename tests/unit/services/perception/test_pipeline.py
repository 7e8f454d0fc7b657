"""The pipeline with a detector that finds what the test says: which inputs are used, and what happens without them."""

import contextlib
import math
from dataclasses import dataclass, field, replace

import msgspec
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from proto.perception import ObjectClass
from proto.sensors import Calibration, LanePath, LidarSweep, MapView
from proto.vehicle import Ego
from services.perception.checks.decoding import Malformed
from services.perception.detect.detection import Detection
from services.perception.detect.detector import Picture
from services.perception.pipeline import Perception, Seen
from tests.unit.services.perception.pictures import taken

STEP_NS = 100_000_000
CALIBRATION = Calibration(fx_px=457, fy_px=457, cx_px=320, cy_px=180, width_px=640, height_px=360, z_m=1.35)
MAP = MapView(
    segment_id="s", lanes=(LanePath(lane_id="a", points=((0.0, 0.0), (99.0, 0.0)), width_m=3.5, is_ego=True),)
)


@dataclass
class Told:
    """Finds what it was told."""

    name: str = "told"
    found: list[Detection] = field(default_factory=list)

    def detect(self, rgb: Picture, *, closer: bool = False) -> list[Detection]:
        """As told."""
        return self.found


def car_at(x_m: float, y_m: float = 0.0, kind: ObjectClass = "vehicle") -> Detection:
    u = 320 - 457 * y_m / x_m
    bottom, half = 180 + 457 * 1.35 / x_m, 457 * 0.9 / x_m
    return Detection(
        x0_px=u - half,
        y0_px=bottom - 457 * 1.5 / x_m,
        x1_px=u + half,
        y1_px=bottom,
        kind=kind,
        score=0.9,
    )


def sweep_of(x_m: float, y_m: float = 0.0) -> LidarSweep:
    rows = np.array([(x_m, y_m + y, z, 0.5) for y in np.linspace(-0.8, 0.8, 9) for z in (0.5, 0.9, 1.2)], "<f4")
    return LidarSweep(points=rows.tobytes(), count=len(rows))


def follow(
    perception: Perception, detector: Told, steps: int = 12, *, camera: str = "front", lidar: bool = True
) -> Seen:
    for k in range(1, steps + 1):
        detector.found = [car_at(30.0)]
        perception.ego(k * STEP_NS, Ego(speed_mps=15.0, yaw_rate_radps=0.0))
        perception.map(k * STEP_NS, MAP)
        if lidar:
            perception.sweep(k * STEP_NS, sweep_of(30.0))
        seen = perception.see(camera, k * STEP_NS, taken())
    return seen


def test_a_vehicle_ahead_becomes_the_lead_with_a_lidar_range() -> None:
    detector = Told()
    perception = Perception(detector)
    perception.calibrate("front", CALIBRATION)
    seen = follow(perception, detector)
    assert seen.tracks is not None
    (track,) = seen.tracks.tracks
    assert seen.tracks.lead_track_id == track.track_id == seen.boxes.boxes[0].track_id
    assert seen.boxes.boxes[0].range_source == "lidar"
    assert track.x_m - track.length_m / 2 == pytest.approx(30.0, abs=0.3)
    assert seen.tracks.lidar_used
    assert seen.tracks.ego_speed_used_mps == 15.0


@pytest.mark.parametrize("yaw_rate_radps", [-0.4, 0.4])
def test_returns_lie_in_the_box_of_what_gave_them_though_the_ego_has_turned_since(yaw_rate_radps: float) -> None:
    detector = Told()
    perception = Perception(detector)
    perception.calibrate("front", CALIBRATION)
    perception.ego(STEP_NS, Ego(speed_mps=0.0, yaw_rate_radps=yaw_rate_radps))
    perception.sweep(STEP_NS, sweep_of(40.0))
    turned_rad = 0.1 * yaw_rate_radps
    detector.found = [car_at(40.0 * math.cos(turned_rad), -40.0 * math.sin(turned_rad))]
    (box,) = perception.see("front", STEP_NS + 100_000_000, taken()).boxes.boxes
    assert box.range_source == "lidar"


def test_without_lidar_the_track_is_less_sure_but_there() -> None:
    sigmas = []
    for lidar in (True, False):
        detector = Told()
        perception = Perception(detector)
        perception.calibrate("front", CALIBRATION)
        seen = follow(perception, detector, lidar=lidar)
        assert seen.tracks is not None
        assert seen.tracks.lidar_used is lidar
        sigmas.append(seen.tracks.tracks[0].sigma_x_m)
    assert sigmas[1] > 2 * sigmas[0]


def test_an_old_ego_speed_counts_as_unknown_and_an_old_map_as_none() -> None:
    detector = Told()
    perception = Perception(detector)
    perception.calibrate("front", CALIBRATION)
    follow(perception, detector)
    seen = perception.see("front", 12 * STEP_NS + 900_000_000, taken())
    assert seen.tracks is not None
    assert seen.lanes is not None
    assert seen.tracks.ego_speed_used_mps is None
    assert not seen.tracks.lidar_used
    assert seen.lanes.source == "corridor"


def test_an_ego_speed_that_is_no_number_counts_as_unknown() -> None:
    detector = Told()
    perception = Perception(detector)
    perception.ego(STEP_NS, Ego(speed_mps=math.nan, yaw_rate_radps=math.inf))
    seen = perception.see("front", STEP_NS, taken())
    assert seen.tracks is not None
    assert seen.tracks.ego_speed_used_mps is None


def test_tele_pictures_give_boxes_and_the_front_camera_carries_the_tracks() -> None:
    detector = Told()
    perception = Perception(detector)
    follow(perception, detector)
    seen = perception.see("tele", 12 * STEP_NS + 1, taken())
    assert seen.tracks is None
    assert seen.lanes is None
    assert len(seen.boxes.boxes) == 1


def test_no_other_camera_carries_the_tracks_of_a_front_camera_that_fell_silent() -> None:
    detector = Told()
    perception = Perception(detector)
    follow(perception, detector)
    detector.found = []
    for k in range(13, 60):
        perception.ego(k * STEP_NS, Ego(speed_mps=15.0, yaw_rate_radps=0.0))
        seen = perception.see("tele", k * STEP_NS, taken())
        assert (seen.tracks, seen.lanes) == (None, None)
        assert seen.boxes.camera == "tele"


def test_a_front_camera_that_is_calibrated_or_sends_what_cannot_be_read_is_not_stood_in_for() -> None:
    calibrated, broken = Perception(Told()), Perception(Told())
    calibrated.calibrate("front", CALIBRATION)
    with pytest.raises(Malformed):
        broken.see("front", STEP_NS, msgspec.structs.replace(taken(), jpeg=b""))
    for perception in (calibrated, broken):
        assert perception.see("tele", 2 * STEP_NS, taken()).tracks is None


def test_a_front_camera_that_comes_back_carries_the_tracks_again() -> None:
    detector = Told()
    perception = Perception(detector)
    follow(perception, detector)
    for k in range(13, 31):
        assert perception.see("tele", k * STEP_NS, taken()).tracks is None
    assert perception.see("front", 31 * STEP_NS, taken()).tracks is not None


def test_of_several_cameras_none_of_them_in_front_the_first_by_name_that_still_comes_carries_the_tracks() -> None:
    perception = Perception(Told())
    assert perception.see("left", STEP_NS, taken()).tracks is not None
    carried = [perception.see("right", k * STEP_NS, taken()).tracks is not None for k in range(2, 20)]
    assert carried == [False] * 9 + [True] * 9


def follow_both(perception: Perception, detector: Told, first: int, steps: int) -> None:
    """Front and long camera alternate; only the front one has the vehicle in view."""
    for k in range(first, first + steps):
        perception.ego(k * STEP_NS, Ego(speed_mps=15.0, yaw_rate_radps=0.0))
        detector.found = [car_at(30.0)]
        assert perception.see("front", k * STEP_NS, taken()).tracks is not None
        detector.found = []
        perception.see("tele", k * STEP_NS + STEP_NS // 2, taken())


@settings(max_examples=40, deadline=None)
@given(apart_ns=st.integers(1_200_000_000, 10**14), ahead=st.booleans(), times=st.integers(1, 4))
def test_a_picture_with_a_stamp_that_all_others_contradict_is_refused_and_wipes_no_track(
    apart_ns: int, ahead: bool, times: int
) -> None:
    detector = Told()
    perception = Perception(detector)
    follow_both(perception, detector, 10**7, 12)
    for k in range(10**7 + 12, 10**7 + 12 + times):
        with pytest.raises(Malformed):
            perception.see("tele", k * STEP_NS + (apart_ns if ahead else -apart_ns), taken())
        perception.ego(k * STEP_NS, Ego(speed_mps=15.0, yaw_rate_radps=0.0))
        detector.found = [car_at(30.0)]
        seen = perception.see("front", k * STEP_NS, taken())
        assert seen.tracks is not None
        assert [track.track_id for track in seen.tracks.tracks] == [1]


def test_a_front_camera_whose_clock_strays_once_is_refused_and_believed_again() -> None:
    detector = Told()
    perception = Perception(detector)
    follow_both(perception, detector, 1, 12)
    with pytest.raises(Malformed):
        perception.see("front", 13 * STEP_NS + 10**10, taken())
    follow_both(perception, detector, 13, 3)


def test_a_long_camera_whose_clock_is_wrong_from_the_start_harms_no_track() -> None:
    detector = Told()
    perception = Perception(detector)
    perception.see("tele", 10**11, taken())
    for k in range(1, 30):
        perception.ego(k * STEP_NS, Ego(speed_mps=15.0, yaw_rate_radps=0.0))
        detector.found = [car_at(30.0)]
        seen = perception.see("front", k * STEP_NS, taken())
        with pytest.raises(Malformed):
            perception.see("tele", 10**11 + k * STEP_NS, taken())
    assert seen.tracks is not None
    assert len(seen.tracks.tracks) == 1


@pytest.mark.parametrize("first", [1000, 1])
@pytest.mark.parametrize("ego", [False, True])
def test_a_recording_that_jumps_is_followed_once_the_sources_agree(first: int, ego: bool) -> None:
    detector = Told()
    perception = Perception(detector)
    follow_both(perception, detector, 500, 12)
    refused = 0
    for k in range(first, first + 15):
        for camera in ("front", "tele"):
            try:
                perception.see(camera, k * STEP_NS, taken())
            except Malformed:
                refused += 1
        if ego:
            perception.ego(k * STEP_NS, Ego(speed_mps=15.0, yaw_rate_radps=0.0))
    assert refused <= 1


def test_a_camera_alone_is_followed_wherever_it_jumps() -> None:
    perception = Perception(Told())
    for stamp_ns in (10**10, 10**12, 10**9):
        assert perception.see("dashcam", stamp_ns, taken()).tracks is not None


def test_a_camera_goes_on_after_the_ego_motion_ended_and_after_a_jump_that_nobody_confirms() -> None:
    perception = Perception(Told())
    perception.ego(STEP_NS, Ego(speed_mps=15.0, yaw_rate_radps=0.0))
    for k in range(1, 40):
        assert perception.see("dashcam", k * STEP_NS, taken()).tracks is not None
    answered = []
    for k in range(1000, 1030):
        with contextlib.suppress(Malformed):
            perception.see("dashcam", k * STEP_NS, taken())
            answered.append(k)
    assert answered == list(range(1011, 1030))


def test_a_long_camera_goes_on_once_nobody_else_comes() -> None:
    detector = Told()
    perception = Perception(detector)
    follow_both(perception, detector, 1, 12)
    for k in range(13, 60):
        assert perception.see("tele", k * STEP_NS, taken()).boxes.camera == "tele"


@pytest.mark.parametrize("camera", ["tele", "dashcam"])
def test_one_camera_alone_carries_the_tracks_whatever_its_name(camera: str) -> None:
    detector = Told()
    perception = Perception(detector)
    seen = follow(perception, detector, camera=camera)
    assert seen.tracks is not None
    assert seen.tracks.camera == camera
    assert len(seen.tracks.tracks) == 1


def test_track_ids_of_signs_and_vehicles_never_collide() -> None:
    detector = Told(found=[car_at(30.0), car_at(25.0, 4.0, "sign"), car_at(40.0, -4.0, "light")])
    perception = Perception(detector)
    ids = {box.track_id for box in perception.see("front", STEP_NS, taken()).boxes.boxes}
    ids |= {box.track_id for box in perception.see("tele", STEP_NS + 1, taken()).boxes.boxes if box.kind != "vehicle"}
    assert len(ids) == 5
    assert 0 not in ids


def test_a_vehicle_seen_by_both_cameras_is_one_track() -> None:
    detector = Told()
    perception = Perception(detector)
    perception.calibrate("front", CALIBRATION)
    perception.calibrate("tele", CALIBRATION)
    for k in range(1, 12):
        detector.found = [car_at(30.0)]
        front = perception.see("front", k * STEP_NS, taken())
        tele = perception.see("tele", k * STEP_NS, taken())
        assert front.boxes.boxes[0].track_id == tele.boxes.boxes[0].track_id == 1


def test_a_motorcyclist_is_one_track_whatever_the_detector_calls_him_besides() -> None:
    detector = Told()
    perception = Perception(detector)
    perception.calibrate("front", CALIBRATION)
    for k in range(1, 12):
        vehicle = car_at(30.0)
        person = replace(vehicle, kind="pedestrian", score=0.8, y0_px=vehicle.y0_px + 1.0)
        detector.found = [vehicle, person] if k % 2 else [person, vehicle]
        seen = perception.see("front", k * STEP_NS, taken())
        assert {box.kind for box in seen.boxes.boxes if box.track_id} == {"vehicle"}
        assert len(seen.boxes.boxes) == 2, "what was found is published all the same"
    assert seen.tracks is not None
    (track,) = seen.tracks.tracks
    assert track.kind == "vehicle"


def test_a_calibration_that_cannot_be_is_refused_and_the_last_one_kept() -> None:
    perception = Perception(Told())
    perception.calibrate("front", CALIBRATION)
    for broken in (math.nan, 0.0, -1.0):
        with pytest.raises(Malformed):
            perception.calibrate(
                "front", Calibration(fx_px=broken, fy_px=457, cx_px=0, cy_px=0, width_px=640, height_px=360)
            )
    assert perception.calibrated("front")


@pytest.mark.parametrize(
    "distortion", [(0.1, 0.2, 0.3), (0.0,) * 3, (1e6,) * 4, (1e300,) * 8, (0.0, 0.0, 0.0, 0.0, 1e200), (0.1,) * 15]
)
def test_a_lens_distortion_that_cannot_be_undone_is_refused(distortion: tuple[float, ...]) -> None:
    perception = Perception(Told(found=[car_at(30.0)]))
    with pytest.raises(Malformed):
        perception.calibrate("front", msgspec.structs.replace(CALIBRATION, distortion=distortion))
    assert not perception.calibrated("front")
    assert len(perception.see("front", STEP_NS, taken()).boxes.boxes) == 1


@settings(max_examples=60, deadline=None)
@given(
    distortion=st.lists(st.floats(-1e7, 1e7) | st.floats(-0.6, 0.6), max_size=15).map(tuple),
    x0_px=st.integers(0, 600),
    y0_px=st.integers(0, 300),
)
def test_no_lens_distortion_stops_pictures_from_being_understood(
    distortion: tuple[float, ...], x0_px: int, y0_px: int
) -> None:
    box = Detection(x0_px=x0_px, y0_px=y0_px, x1_px=x0_px + 40, y1_px=y0_px + 60, kind="vehicle", score=0.9)
    perception = Perception(Told(found=[box]))
    with contextlib.suppress(Malformed):
        perception.calibrate("front", msgspec.structs.replace(CALIBRATION, distortion=distortion))
    perception.sweep(STEP_NS, sweep_of(30.0))
    for k in range(1, 5):
        seen = perception.see("front", k * STEP_NS, taken())
    assert seen.tracks is not None
    assert all(math.isfinite(track.x_m + track.y_m + track.vx_mps) for track in seen.tracks.tracks)


@pytest.mark.parametrize("distortion", [(-0.3, 0.1, 0.0, 0.0), (-0.3, 0.1, 0.001, -0.001, -0.01), (0.0,) * 14])
def test_a_usual_lens_distortion_is_worked_with(distortion: tuple[float, ...]) -> None:
    perception = Perception(Told(found=[car_at(30.0)]))
    perception.calibrate("front", msgspec.structs.replace(CALIBRATION, distortion=distortion))
    assert perception.calibrated("front")
    assert perception.see("front", STEP_NS, taken()).boxes.boxes[0].range_m == pytest.approx(30.0, rel=0.1)


@pytest.mark.parametrize("told", [False, True])
def test_an_uncalibrated_camera_that_looks_down_learns_its_pitch(told: bool) -> None:
    """Vehicles low in the picture of a level camera would be near; their sizes say they are not."""
    detector = Told()
    perception = Perception(detector)
    if told:
        perception.calibrate("dashcam", msgspec.structs.replace(CALIBRATION, assumed=True))
    focal = 457 if told else 554
    shift = 60.0
    for k in range(1, 40):
        seen_at = 30.0 + k % 5
        level = car_at(seen_at)
        detector.found = [
            Detection(
                x0_px=level.x0_px,
                y0_px=level.y0_px - shift,
                x1_px=level.x1_px,
                y1_px=level.y1_px - shift,
                kind="vehicle",
                score=0.9,
            )
        ]
        seen = perception.see("dashcam", k * STEP_NS, taken())
    assert seen.boxes.boxes[0].range_m == pytest.approx(seen_at * focal / 457, rel=0.25)
