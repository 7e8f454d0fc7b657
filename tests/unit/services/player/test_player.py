"""Recordings through the sensor topics."""

import itertools
import re
from itertools import accumulate, pairwise
from pathlib import Path

import cv2
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from drivemcp.errors import UserError
from drivemcp.testing import bus
from proto import topics
from proto.sensors import CameraFrame
from services.player.picture_names import ordered
from services.player.pictures import PICTURES, live_pictures, passed_over, thinned, webcam_number
from services.player.recording import Options, bits_in, read_picture
from services.player.service import SERVICE, PlayerConfig
from services.player.source import open_recording


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """Four pictures, each of one grey."""
    for number in range(4):
        cv2.imwrite(str(tmp_path / f"{number}.png"), np.full((90, 160, 3), 40 * number, np.uint8))
    return tmp_path


@pytest.fixture
def video(tmp_path: Path) -> Path:
    """A second of black."""
    path = tmp_path / "clip.mp4"
    writer = cv2.VideoWriter(str(path), cv2.VideoWriter.fourcc(*"mp4v"), 20.0, (1200, 600))
    for _ in range(20):
        writer.write(np.zeros((600, 1200, 3), np.uint8))
    writer.release()
    return path


def test_a_folder_of_pictures_is_published_in_order_with_a_calibration_and_an_end(folder: Path) -> None:
    with bus() as b:
        frames = b.collect(topics.CAMERA, id="front")
        states = b.collect(topics.SCENARIO)
        calibrations = b.collect(topics.CALIBRATION, id="front")
        b.start(SERVICE, PlayerConfig(source=str(folder), picture_period_s=0.05))
        frames.wait_count(4)
        decoded = [cv2.imdecode(np.frombuffer(f.jpeg, np.uint8), cv2.IMREAD_GRAYSCALE) for f in frames.messages]
        means = [np.mean(grey) for grey in decoded if grey is not None]
        assert means == pytest.approx([0, 40, 80, 120], abs=3)
        stamps = [info.stamp_ns for info in frames.infos]
        assert np.diff(stamps).tolist() == pytest.approx([50_000_000] * 3, abs=1000), "as far apart as in the recording"
        ended = states.wait(lambda state: state.finished)
        assert ended.scenario == folder.name
        assert not ended.problem
        assert calibrations.wait().width_px == 160
        assert calibrations.wait().assumed, "nobody measured this camera"


@pytest.mark.parametrize("ending", PICTURES)
def test_each_kind_of_picture_that_is_named_is_read(ending: str, tmp_path: Path) -> None:
    path = tmp_path / f"0{ending.upper()}"
    path.write_bytes(cv2.imencode(ending, np.full((90, 160, 3), 120, np.uint8))[1].tobytes())
    recording = open_recording(str(tmp_path), Options())
    frame = next(each.message for each in recording.messages if isinstance(each.message, CameraFrame))
    grey = cv2.imdecode(np.frombuffer(frame.jpeg, np.uint8), cv2.IMREAD_GRAYSCALE)
    assert grey is not None
    assert np.mean(grey) == pytest.approx(120, abs=3)


def test_pictures_that_are_not_read_are_named_with_what_to_do(
    folder: Path, tmp_path_factory: pytest.TempPathFactory
) -> None:
    assert passed_over(folder) == ""
    phone = tmp_path_factory.mktemp("phone")
    for place in (folder, phone):
        for name in ("IMG_1.HEIC", "IMG_2.heic", "IMG_3.dng", "._IMG_1.HEIC"):
            (place / name).write_bytes(b"x")
    told = r"3 pictures \(.dng, .heic\) are not read, first IMG_1.HEIC: convert them to .jpg or .png"
    assert re.fullmatch(told, passed_over(folder))
    assert len(list(open_recording(str(folder), Options()).messages)) > 0
    with pytest.raises(UserError, match=told):
        open_recording(str(phone), Options())


def test_a_picture_that_is_cut_is_left_out_and_told(tmp_path: Path) -> None:
    whole = cv2.imencode(".jpg", np.random.default_rng(1).integers(0, 255, (90, 160, 3), np.uint8))[1].tobytes()
    for name, content in (("1", whole), ("2", whole + b"maker's own"), ("3", whole[: len(whole) // 2])):
        (tmp_path / f"{name}.jpg").write_bytes(content)
    assert open_recording(str(tmp_path), Options()).pictures == 2
    assert passed_over(tmp_path) == "1 pictures are cut and left out, first 3.jpg"


@pytest.mark.parametrize(
    ("names", "told"),
    [
        (("1714557600000", "1714557600100", "cover"), "since cover.png holds none: take it away, or give --period"),
        (
            ("1714557600000", "1714557600100", "1714557700000"),
            "or pause for more than 30 s: divide the folder, or give --period",
        ),
        (
            ("20240501_100000_000", "20240501_100000_030", "20240501_100000_060"),
            "number the pictures of a second, or pause for more than 30 s: divide the folder, or give --period",
        ),
        (
            ("123456789012345", "123456839012345", "123456889012345"),
            "since their unit or form is not known: rename the pictures by seconds since 1970, or give --period",
        ),
        (("at 2024-05-01 9.59.58 AM", "at 2024-05-01 9.59.59 AM"), "by seconds since 1970, or give --period"),
        (("100000001", "100000002", "100000003"), ""),
        (("1", "2", "3"), ""),
        (("1714557600000", "1714557600100"), ""),
    ],
)
def test_times_that_do_not_count_are_told(names: tuple[str, ...], told: str, tmp_path: Path) -> None:
    for name in names:
        cv2.imwrite(str(tmp_path / f"{name}.png"), np.zeros((60, 90, 3), np.uint8))
    assert passed_over(tmp_path).endswith(told)
    assert bool(passed_over(tmp_path)) == bool(told)


def test_pictures_of_several_cameras_are_asked_for_by_camera(tmp_path: Path) -> None:
    for at, camera in itertools.product(range(3), ("CAM_BACK", "CAM_FRONT")):
        name = f"n008-2018-08-01-15-16-36-0400__{camera}__{1533151603537558 + 500_000 * at}.png"
        cv2.imwrite(str(tmp_path / name), np.zeros((60, 90, 3), np.uint8))
    with pytest.raises(UserError, match=r"pictures of several cameras: .*CAM_BACK, .*CAM_FRONT; give each a folder"):
        open_recording(str(tmp_path), Options())


@pytest.mark.parametrize(
    ("names", "cameras"),
    [
        (("left000001.png", "right000001.png", "left000002.png", "right000002.png"), "left, right"),
        (("01_left.png", "01_right.png", "02_left.png", "02_right.png"), "left, right"),
        (("cam0_001.png", "cam1_001.png", "cam0_002.png", "cam1_002.png"), "cam0, cam1"),
        (("0001.png", "0001_mask.png", "0002.png", "0002_mask.png"), "0001.png, mask"),
        (("img_001.png", "img_001_thumb.png", "img_002.png", "img_002_thumb.png", "img_003.png"), "img, img__thumb"),
        (("frame1.jpg", "frame1.png", "frame2.jpg", "frame2.png"), "frame.jpg, frame.png"),
        (("20240501_100000_0001F.png", "20240501_100000_0002R.png", "20240501_100030_0003F.png", "20240501_100030_0004R.png"), "F, R"),
        (("20240501_100000_0001F.png", "20240501_100000_0001R.png", "20240501_110000_0002F.png", "20240501_110000_0002R.png"), "F, R"),
        (("24-05-01 front_1.png", "24-05-01 front_2.png", "24-05-01 back_1.png", "24-05-01 back_2.png"), "back, front"),
    ],
)  # fmt: skip
def test_pictures_of_several_cameras_are_asked_for_by_camera_also_without_times(
    names: tuple[str, ...], cameras: str, tmp_path: Path
) -> None:
    for name in names:
        cv2.imwrite(str(tmp_path / name), np.zeros((60, 90, 3), np.uint8))
    with pytest.raises(UserError, match=rf"pictures of several cameras: {cameras}; give each a folder of its own"):
        open_recording(str(tmp_path), Options())


@pytest.mark.parametrize(
    "names",
    [
        ("IMG_0001.png", "IMG_0002.png", "DSC_0003.png", "DSC_0004.png"),
        ("img1.png", "img1 (1).png", "img2.png"),
        ("frame1.png", "frame2.png", "frame3.png", "cover.png", "frame1_mask.png"),
        ("cam1.png", "cam2.png", "cam3.png"),
        ("a1b2.png", "a1b10.png", "a2b1.png"),
        ("1.png", "2.png", "3.jpg", "4.jpg"),
    ],
)
def test_names_that_differ_otherwise_are_of_one_camera(names: tuple[str, ...], tmp_path: Path) -> None:
    for name in names:
        cv2.imwrite(str(tmp_path / name), np.zeros((60, 90, 3), np.uint8))
    assert open_recording(str(tmp_path), Options()).pictures == len(names)


def test_of_a_folder_of_videos_one_has_to_be_named(video: Path) -> None:
    with pytest.raises(UserError, match=r"it holds 1 videos; name one, as clip\.mp4"):
        open_recording(str(video.parent), Options())


def test_a_picture_that_does_not_decode_costs_itself_alone(folder: Path) -> None:
    (folder / "2.png").write_bytes(b"no picture")
    with bus() as b:
        states = b.collect(topics.SCENARIO)
        frames = b.collect(topics.CAMERA)
        b.start(SERVICE, PlayerConfig(source=str(folder), picture_period_s=0.02))
        problem = states.wait(lambda state: state.finished).problem
        assert "2.png does not decode as a picture and is left out" in problem
        frames.wait(lambda frame: frame.frame == len(list(folder.iterdir())) - 2)


def test_a_dark_picture_of_a_deep_camera_stays_dark(tmp_path: Path) -> None:
    for number, grey in enumerate((900, 40_000, 900)):
        cv2.imwrite(str(tmp_path / f"{number}.png"), np.full((60, 90), grey, np.uint16))
    files = sorted(tmp_path.iterdir())
    assert bits_in(files) == 16
    assert [int(read_picture(file, bits_in(files)).max()) for file in files] == [3, 156, 3]


@pytest.mark.parametrize("bits", [10, 12, 14, 16])
def test_pictures_of_more_than_eight_bits_are_as_bright_as_their_cameras_saw(tmp_path: Path, bits: int) -> None:
    grey = np.linspace(0, (1 << bits) - 1, 90).round().astype(np.uint16)
    cv2.imwrite(str(tmp_path / "deep.png"), np.tile(grey, (60, 1)))
    assert np.array_equal(read_picture(tmp_path / "deep.png")[0, :, 0], grey >> (bits - 8))


@pytest.mark.parametrize(
    ("names", "times"),
    [
        (["cam__1533280036162460", "cam__1533280039162460", "cam__1533280042612460"], [0.0, 3.0, 6.45]),
        (["1403636579763555584", "1403636579863555584", "1403636580063555584"], [0.0, 0.1, 0.3]),
        (["1305031102.175304", "1305031102.475304", "1305031103.175304"], [0.0, 0.3, 1.0]),
        (["1305031102175", "1305031102205", "1305031102275"], [0.0, 0.1]),  # thinned to ten a second
        (["0000000000", "0000000001", "0000000002"], [0.0, 0.5, 1.0]),
        (["1533280036162460", "1533280036162460a", "1533280042612460"], [0.0, 0.5, 1.0]),
        (["1533280036162460", "1533280136162460", "1533280142612460"], [0.0, 0.5, 1.0]),  # a pause of 100 s
        (["20180803150036", "20180803150037", "20180803150039"], [0.0, 1.0, 3.0]),
        (["IMG_20240531_235959", "IMG_20240601_000000", "IMG_20240601_000002"], [0.0, 1.0, 3.0]),
        (["2024-05-01_10-00-00.100", "2024-05-01_10-00-00.400", "2024-05-01_10-00-01.000"], [0.0, 0.3, 0.9]),
        (["a2024-05-01T10:00:00_500000_F", "a2024-05-01T10:00:01_000000_F"], [0.0, 0.5]),
        (["20240501_100000_001", "20240501_100000_002"], [0.0, 0.5]),  # a number stands behind the time
        (["20240501_100000_0001", "20240501_100000_0002"], [0.0, 0.5]),  # two pictures of one second
        (["2024_0501_100000_000A", "2024_0501_100001_001A", "2024_0501_100003_002A"], [0.0, 1.0, 3.0]),
        (["1714557600000_cam0", "1714557600500_cam0", "1714557601500_cam0"], [0.0, 0.5, 1.5]),
        (["000000012_1714557600000", "000000013_1714557601000"], [0.0, 1.0]),
        (["20240231_100000", "20240231_100001"], [0.0, 0.5]),  # no day
        (["20240501_100000_000", "20240501_100000_030", "20240501_100000_060"], [0.0, 0.5, 1.0]),  # numbers of a clip
        (
            ["20240501_100000_000", "20240501_100000_030", "20240501_100030_000", "20240501_100030_030"],
            [0.0, 0.5, 1.0, 1.5],
        ),
        (["20240501_100000_287", "20240501_100000_404", "20240501_100000_605"], [0.0, 0.117, 0.318]),
        (["20240501_100000_400", "20240501_100000_800", "20240501_100001_200"], [0.0, 0.4, 0.8]),
        (["20240501_100000.200", "20240501_100000.400", "20240501_100000.600"], [0.0, 0.2, 0.4]),
        (["1714557600.150000000", "1714557600.250000000", "1714557600.50000000"], [0.0, 0.1, 0.2]),
        (["1714557600.150000", "1714557600.250000", "1714557600.50000"], [0.0, 0.1, 0.2]),
        (["1714557600.138", "1714557600.271", "1714557600.404", "1714557600.5"], [0.0, 0.133, 0.266, 0.399]),
        (["a_1714557600.5000000", "a_1714557600.205000000", "a_1714557600.405000000"], [0.0, 0.2, 0.4]),
        (["1714557600.0", "1714557600.25", "1714557600.5", "1714557600.75"], [0.0, 0.25, 0.5, 0.75]),
        (["315967376099572128", "315967376199572128", "315967376399572128"], [0.0, 0.1, 0.3]),  # a clock from 1980
        (["01.05.2024 10.00.00", "01.05.2024 10.00.01", "01.05.2024 10.00.03"], [0.0, 1.0, 3.0]),
        (["05-31-2024_23-59-59", "06-01-2024_00-00-01"], [0.0, 0.5]),  # of two orders of day and month
        (["05-30-2024_23-59-59", "05-31-2024_00-00-01"], [0.0, 2.0]),
        (["at 2024-05-01 at 10.00.00", "at 2024-05-01 at 10.00.02"], [0.0, 2.0]),
        (["1714557600_800000000", "1714557600_950000000", "1714557601_050000000"], [0.0, 0.15, 0.25]),
        (["123456789012345", "123456839012345", "123456889012345"], [0.0, 0.5, 1.0]),  # of no known unit
        (["at 2024-05-01 at 11.59.58 AM", "at 2024-05-01 at 12.00.02 PM"], [0.0, 4.0]),
        (["at 2024-05-01 10.00.00 PM", "at 2024-05-01 10.00.02 PM"], [0.0, 2.0]),
        (["at 2024-05-01 12.00.01 AM", "at 2024-05-01 12.00.02 PM"], [0.0, 0.5]),
        (["1714557600.05", "1714557600.2", "1714557600.3"], [0.0, 0.15, 0.25]),
    ],
)
def test_pictures_are_shown_at_the_times_in_their_names(tmp_path: Path, names: list[str], times: list[float]) -> None:
    for name in names:
        cv2.imwrite(str(tmp_path / f"{name}.png"), np.zeros((60, 90, 3), np.uint8))
    recording = open_recording(str(tmp_path), Options())
    shown = [each.at_s for each in recording.messages if isinstance(each.message, CameraFrame)]
    assert shown == pytest.approx(times, abs=1e-6)
    assert recording.pictures == len(times)
    told = open_recording(str(tmp_path), Options(picture_period_s=0.2))
    shown = [each.at_s for each in told.messages if isinstance(each.message, CameraFrame)]
    assert shown == pytest.approx([0.2 * number for number in range(len(names))])


def test_a_video_keeps_its_own_pace(video: Path) -> None:
    recording = open_recording(str(video), Options(max_rate_hz=10.0))
    pictures = [each for each in recording.messages if isinstance(each.message, CameraFrame)]
    assert len(pictures) == 10
    assert [each.at_s for each in pictures[:3]] == pytest.approx([0.0, 0.1, 0.2])
    first = pictures[0].message
    assert isinstance(first, CameraFrame)
    assert (first.height_px, first.width_px) == (480, 960)


@pytest.mark.parametrize("name", ["absent.mp4", "text.mp4", "empty", "text.mcap"])
def test_what_is_no_recording_is_told_in_one_line(tmp_path: Path, name: str) -> None:
    (tmp_path / "text.mp4").write_text("no video")
    (tmp_path / "text.mcap").write_text("no log at all")
    (tmp_path / "empty").mkdir()
    with pytest.raises(UserError, match=name) as raised:
        open_recording(str(tmp_path / name), Options())
    assert "\n" not in str(raised.value)


def test_an_absent_webcam_is_told_with_those_that_are_there() -> None:
    with pytest.raises(UserError, match="webcam 987"):
        open_recording("webcam:987", Options())


def test_webcams_are_known_by_their_names_only() -> None:
    assert [webcam_number(name) for name in ("webcam:0", "/dev/video12", "webcam:x", "video0.mp4")] == [
        0,
        12,
        None,
        None,
    ]


def test_a_webcam_is_read_as_it_comes_and_its_end_is_an_error(video: Path) -> None:
    pictures = live_pictures(cv2.VideoCapture(str(video)), max_rate_hz=1e6)
    first = next(pictures)
    assert first.bgr.shape == (480, 960, 3)
    times = [first.at_s]
    with pytest.raises(UserError, match="no more pictures"):
        times.extend(picture.at_s for picture in pictures)
    assert times == sorted(times)


@given(st.lists(st.floats(0.001, 0.5), min_size=1, max_size=200), st.floats(1.0, 30.0))
def test_pictures_keep_their_times_and_no_second_has_more_than_the_highest_rate(
    gaps_s: list[float], rate_hz: float
) -> None:
    times = list(accumulate(gaps_s))
    shown = list(thinned(times, rate_hz))
    assert set(shown) <= set(times)
    assert shown[0] == times[0]
    assert all(sum(at <= each < at + 1.0 for each in shown) <= rate_hz + 2.0 for at in shown)
    longest = max([times[0], *gaps_s])
    assert all(after - before <= 1.0 / rate_hz + longest + 1e-9 for before, after in pairwise(shown))


@pytest.mark.parametrize(
    "names",
    [
        [f"frame{number}.png" for number in range(1, 13)],
        ["a1b2.png", "a1b10.png", "a2b1.png"],
        ["9.25.png", "9.5.png", "10.125.png"],
        ["7.0.png", "7.50000000.png", "7.100000000.png", "7.150000000.png"],
        ["7.05.png", "7.1.png", "7.25.png"],
        ["001.png", "002.png", "010.png"],
        ["IMG_1.jpeg", "img_2.JPG", "IMG_10.jpg"],
        ["frame.png", "frame1.png", "frame2.png"],
        ["a1.png", "a².png"],
    ],
)
def test_a_folder_is_played_in_the_order_of_its_numbers(names: list[str]) -> None:
    for listed in (names, names[::-1], sorted(names)):
        assert [file.name for file in ordered(Path(name) for name in listed)] == names


def test_what_a_mac_writes_beside_a_picture_is_none(folder: Path) -> None:
    (folder / "._0.png").write_bytes(b"\x00\x05\x16\x07")
    recording = open_recording(str(folder), Options())
    assert sum(each.topic is topics.CAMERA for each in recording.messages) == recording.pictures


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (b"", "it is empty"),
        (b"#ROSBAG V2.0\n", "a rosbag is not read; write a frame.json"),
        (b"<!DOCTYPE html>", "it is a page"),
        (b"\x00\x00\x00\x18ftypmp42", "its end is missing"),
    ],
)
def test_a_file_that_is_no_video_says_what_it_looks_like(tmp_path: Path, content: bytes, words: str) -> None:
    (tmp_path / "drive.mp4").write_bytes(content)
    with pytest.raises(UserError, match=f"drive.mp4 does not open as a video: {words}"):
        open_recording(str(tmp_path / "drive.mp4"), Options())


def test_a_video_that_is_damaged_within_says_how_much_of_it_was_read(tmp_path: Path) -> None:
    path = tmp_path / "clip.avi"
    writer = cv2.VideoWriter(str(path), cv2.VideoWriter.fourcc(*"MJPG"), 10.0, (160, 96))
    for number in range(30):
        writer.write(np.full((96, 160, 3), 8 * number, np.uint8))
    writer.release()
    assert sum(isinstance(each.message, CameraFrame) for each in open_recording(str(path), Options()).messages) == 30
    content = bytearray(path.read_bytes())
    place = content.index(b"00dc", content.index(b"movi") + len(content) // 3)
    content[place : place + len(content) // 6] = bytes(len(content) // 6)
    path.write_bytes(content)
    shown = list[object]()
    with pytest.raises(UserError, match=r"clip.avi is damaged or cut: \d+ of its 30 frames can be read"):
        shown.extend(open_recording(str(path), Options()).messages)
    assert shown
