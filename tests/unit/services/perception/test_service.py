"""The service on a real in-process bus, with rendered pictures and our own detector."""

import numpy as np
import pytest

from drivemcp.testing import bus
from proto import topics
from proto.health import ServiceHealth
from proto.sensors import Calibration, CameraFrame, LidarSweep
from proto.weather import CameraWeather
from services.perception.service import SERVICE, PerceptionConfig

REAR_M = 18.0


def rear_sweep() -> LidarSweep:
    rows = np.array([(REAR_M, y, z, 0.4) for y in np.linspace(-0.8, 0.8, 9) for z in (0.5, 0.8, 1.1)], "<f4")
    return LidarSweep(points=rows.tobytes(), count=len(rows))


def test_pictures_become_boxes_tracks_and_lanes_with_the_pictures_stamp(
    street_frame: CameraFrame, front_calibration: Calibration
) -> None:
    with bus() as b:
        b.start(SERVICE, PerceptionConfig(late_ms=60_000, stale_ms=60_000))
        boxes, lanes, tracks = b.collect(topics.BOXES), b.collect(topics.LANES), b.collect(topics.TRACKS)
        start_ns = b.probe.clock.now_ns()
        for k in range(6):
            stamp_ns = start_ns + k * 100_000_000
            b.probe.publish(topics.CALIBRATION, front_calibration, id="front")
            b.probe.publish(topics.LIDAR, rear_sweep(), id="top", stamp_ns=stamp_ns)
            b.probe.publish(topics.CAMERA, street_frame, id="front", stamp_ns=stamp_ns)
        tracks.wait_count(6)
        assert [info.stamp_ns for info in tracks.infos] == [start_ns + k * 100_000_000 for k in range(6)]
        assert lanes.wait_count(6)[0].source == "corridor"
        last = tracks.messages[-1]
        lead = next(track for track in last.tracks if track.track_id == last.lead_track_id)
        assert lead.x_m - lead.length_m / 2 == pytest.approx(REAR_M, abs=0.6)
        assert last.ego_speed_used_mps is None
        assert last.frame == street_frame.frame
        shown = boxes.wait_count(6)[-1]
        assert shown.detector == "detector"
        assert lead.track_id in {box.track_id for box in shown.boxes}
        answer = b.call("list_tracks")
        assert answer.status == "ok"
        assert answer.result is not None
        assert answer.result["lead_track_id"] == lead.track_id


def test_a_picture_that_waited_is_looked_at_once_and_says_so(
    street_frame: CameraFrame, front_calibration: Calibration
) -> None:
    for closer_ms, looked_at_once in ((0.0, "3"), (60_000.0, None)):
        with bus() as b:
            b.start(SERVICE, PerceptionConfig(late_ms=60_000, closer_ms=closer_ms))
            boxes, health = b.collect(topics.BOXES), b.collect(topics.HEALTH)
            b.probe.publish(topics.CALIBRATION, front_calibration, id="front")
            for _ in range(3):
                b.probe.publish(topics.CAMERA, street_frame, id="front")
            assert all(each.boxes for each in boxes.wait_count(3)), "once is enough for what is near"
            after = len(health.messages) + 1
            assert health.wait_count(after)[-1].detail.get("looked_at_once") == looked_at_once


def test_the_weather_comes_once_a_second_with_its_pictures_stamp(
    street_frame: CameraFrame, front_calibration: Calibration
) -> None:
    with bus() as b:
        b.start(SERVICE, PerceptionConfig(late_ms=60_000))
        weather, tracks = b.collect(topics.CAMERA_WEATHER), b.collect(topics.TRACKS)
        start_ns = b.probe.clock.now_ns()
        b.probe.publish(topics.CALIBRATION, front_calibration, id="front")
        for second in range(2):
            for k in range(3):
                stamp_ns = start_ns + second * 1_000_000_000 + k * 100_000_000
                b.probe.publish(topics.CAMERA, street_frame, id="front", stamp_ns=stamp_ns)
            weather.wait_count(second + 1)
        tracks.wait_count(6)
        assert [info.stamp_ns for info in weather.infos] == [start_ns, start_ns + 1_000_000_000]
        assert weather.messages[-1].camera == "front"
        assert weather.messages[-1].snow_cover is None


def test_without_a_calibration_the_weather_is_unknown(street_frame: CameraFrame) -> None:
    with bus() as b:
        b.start(SERVICE, PerceptionConfig(late_ms=60_000))
        weather = b.collect(topics.CAMERA_WEATHER)
        b.probe.publish(topics.CAMERA, street_frame, id="front")
        told = weather.wait_count(1)[0]
        assert told == CameraWeather(camera="front", reasons=("the camera is not calibrated",))


def test_malformed_pictures_sweeps_and_calibrations_are_counted_and_harm_nothing(
    street_frame: CameraFrame, front_calibration: Calibration
) -> None:
    with bus() as b:
        b.start(SERVICE, PerceptionConfig(late_ms=60_000))
        health = b.collect(topics.HEALTH, id="perception")
        boxes = b.collect(topics.BOXES)
        broken = CameraFrame(jpeg=street_frame.jpeg[:300], width_px=9, height_px=9)
        b.probe.publish(topics.CAMERA, broken, id="front")
        b.probe.publish(topics.LIDAR, LidarSweep(points=b"123", count=7), id="top")
        impossible = Calibration(fx_px=0.0, fy_px=0.0, cx_px=0.0, cy_px=0.0, width_px=0, height_px=0)
        b.probe.publish(topics.CALIBRATION, impossible, id="front")
        b.probe.publish(topics.CAMERA, street_frame, id="front")
        assert len(boxes.wait_count(1)[0].boxes) > 0

        def counted(message: ServiceHealth) -> bool:
            told = message.detail
            return all(told.get(f"dropped_{what}") == "1" for what in ("pictures", "sweeps", "calibrations"))

        assert health.wait(counted).detail["detector"].startswith("detector sha256:")


def test_without_any_picture_the_tool_says_what_is_wrong() -> None:
    with bus() as b:
        b.start(SERVICE)
        answer = b.call("list_tracks")
        assert answer.status == "tool_error"
        assert "check the cameras" in answer.error
