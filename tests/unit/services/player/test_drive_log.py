"""Our own logs, written by the logger and played again."""

from collections.abc import Sequence
from pathlib import Path

import cv2
import numpy as np
import pytest
from foxglove_schemas_protobuf.CompressedImage_pb2 import CompressedImage
from mcap.writer import Writer

from drivemcp.errors import UserError
from drivemcp.testing import bus
from proto import topics
from proto.sensors import Calibration, CameraFrame
from proto.vehicle import Ego
from services.logger.service import SERVICE as LOGGER
from services.logger.service import LoggerConfig
from services.player.recording import Options
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


def logged(folder: Path, stamps_s: Sequence[float]) -> Path:
    """A log of ours with pictures of these stamps, in this order."""
    path = folder / "drive.mcap"
    with path.open("wb") as file:
        writer = Writer(file)
        writer.start()
        schema = writer.register_schema("foxglove.CompressedImage", "protobuf", b"")
        channel = writer.register_channel("sensor/camera/front", "protobuf", schema)
        for stamp_s in stamps_s:
            stamp_ns = round(stamp_s * 1e9)
            writer.add_message(channel, stamp_ns, CompressedImage(data=JPEG).SerializeToString(), stamp_ns)
        writer.finish()  # type: ignore[no-untyped-call]
    return path


def played_s(path: Path) -> list[float]:
    return [each.at_s for each in open_recording(str(path), Options()).messages if each.topic is topics.CAMERA]


@pytest.mark.parametrize("wrong", [1 << 60, 1 << 40, -(1 << 36)])
@pytest.mark.parametrize("at", [0, 3, 9])
def test_a_stamp_with_a_wrong_bit_is_left_out_and_told(tmp_path: Path, wrong: int, at: int) -> None:
    stamps_s = [100.0 + number / 10 for number in range(10)]
    stamps_s[at] = max(0.0, stamps_s[at] + wrong / 1e9)
    path = logged(tmp_path, stamps_s)
    recording = open_recording(str(path), Options())
    assert recording.pictures == 9
    assert recording.duration_s < 1.0
    assert recording.brings == "a log (messages left out for impossible times: 1)"
    assert len(played_s(path)) == 9
    assert 0.0 <= min(played_s(path)) <= max(played_s(path)) < 1.0


@pytest.mark.parametrize(
    "stamps_s",
    [
        [1.0, 1.1],
        [100.0 + 10.0 * number for number in range(9)],
        [*(100.0 + number / 10 for number in range(9)), *(900.0 + number / 10 for number in range(9))],
        [100.2, 100.0, 100.1, 100.3],
    ],
    ids=["short", "slow", "a gap that lasts", "out of order"],
)
def test_stamps_that_others_bear_out_are_all_played(tmp_path: Path, stamps_s: list[float]) -> None:
    path = logged(tmp_path, stamps_s)
    first_s = min(stamps_s)
    assert played_s(path) == pytest.approx([stamp_s - first_s for stamp_s in stamps_s])
    assert open_recording(str(path), Options()).brings == "a log"


def test_a_speed_that_was_unknown_throughout_is_left_to_the_can_service(tmp_path: Path) -> None:
    recording = open_recording(str(drive(tmp_path, None)), Options())
    assert not recording.ego
    assert topics.EGO not in {each.topic for each in recording.messages}


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
