"""Our own logs, written by the logger and played again."""

from pathlib import Path

import cv2
import numpy as np
import pytest
from mcap.writer import Writer

from drivemcp.errors import UserError
from drivemcp.testing import bus
from proto import topics
from proto.sensors import Calibration, CameraFrame
from proto.vehicle import Ego
from services.logger.service import SERVICE as LOGGER
from services.logger.service import LoggerConfig
from services.player.moments import Options
from services.player.service import SERVICE, PlayerConfig
from services.player.source import open_recording

JPEG = cv2.imencode(".jpg", np.full((60, 80, 3), 200, np.uint8))[1].tobytes()
START_NS = 5_000_000_000


def drive(folder: Path, speed_mps: float | None) -> Path:
    """A drive's folder: three pictures 50 ms apart, a calibration, and the ego before each picture."""
    with bus() as b:
        node = b.start(LOGGER, LoggerConfig(out_dir=str(folder), flush_ms=10))
        calibration = Calibration(fx_px=70.0, fy_px=70.0, cx_px=40.0, cy_px=30.0, width_px=80, height_px=60)
        b.probe.publish(topics.CALIBRATION, calibration, id="front", stamp_ns=START_NS - 10**9)
        for number in range(3):
            stamp_ns = START_NS + number * 50_000_000
            b.probe.publish(topics.EGO, Ego(speed_mps=speed_mps), stamp_ns=stamp_ns)
            picture = CameraFrame(jpeg=JPEG, width_px=80, height_px=60, frame=number)
            b.probe.publish(topics.CAMERA, picture, id="front", stamp_ns=stamp_ns)
        b.wait_for(topics.CHAIN, lambda head: head.records >= 7)
        node.close()
    return folder


def test_a_log_says_again_what_its_sensors_said(tmp_path: Path) -> None:
    folder = drive(tmp_path, 13.9)
    recording = open_recording(str(folder), Options())
    assert recording.ego
    assert recording.pictures == 3
    assert recording.duration_s == pytest.approx(0.1)
    with bus() as b:
        frames = b.collect(topics.CAMERA, id="front")
        egos = b.collect(topics.EGO)
        calibrations = b.collect(topics.CALIBRATION, id="front")
        b.start(SERVICE, PlayerConfig(source=str(next((folder / "logs").glob("*.mcap")))))
        played = frames.wait_count(3)
        assert played[0].jpeg == JPEG
        assert (played[0].width_px, played[0].height_px) == (80, 60)
        assert {ego.speed_mps for ego in egos.wait_count(3)} == {13.9}
        assert calibrations.wait().fx_px == 70.0
        assert np.diff([info.stamp_ns for info in frames.infos]).tolist() == [50_000_000, 50_000_000]


def test_a_speed_that_was_unknown_throughout_is_left_to_the_can_service(tmp_path: Path) -> None:
    recording = open_recording(str(drive(tmp_path, None)), Options())
    assert not recording.ego
    assert topics.EGO not in {moment.topic for moment in recording.moments}


def test_a_log_that_was_cut_is_played_as_far_as_it_goes(tmp_path: Path) -> None:
    log = next((drive(tmp_path, 5.0) / "logs").glob("*.mcap"))
    log.write_bytes(log.read_bytes()[:-200])
    assert open_recording(str(log), Options()).pictures == 3


def test_a_log_of_others_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "other.mcap"
    with path.open("wb") as file:
        writer = Writer(file)
        writer.start()
        schema = writer.register_schema("other.Picture", "jsonschema", b"{}")
        channel = writer.register_channel("sensor/camera/front", "json", schema)
        writer.add_message(channel, 1, b"{}", 1)
        writer.finish()  # type: ignore[no-untyped-call]
    with pytest.raises(UserError, match=r"other\.mcap is no drive of ours"):
        open_recording(str(path), Options())


@pytest.mark.parametrize("content", [b"", b"no log at all", b"\x89MCAP0\r\n", b"\x89MCAP0\r\n" + b"\xff" * 64])
def test_a_file_that_is_no_log_is_refused_in_one_line(tmp_path: Path, content: bytes) -> None:
    path = tmp_path / "broken.mcap"
    path.write_bytes(content)
    with pytest.raises(UserError, match=r"broken\.mcap is no") as raised:
        open_recording(str(path), Options())
    assert "\n" not in str(raised.value)
