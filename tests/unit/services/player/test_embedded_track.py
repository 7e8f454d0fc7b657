"""Positions inside a video: GPMF and CAMM in files that are built here, the other forms as the package tells them."""

import importlib.util
import struct
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from drivemcp.errors import UserError
from services.player.embedded_track import SUFFIXES, embedded_rows, rows_of
from services.player.position_track import read_track, track_beside
from services.player.tracks.fix import Fix

needs_package = pytest.mark.skipif(importlib.util.find_spec("telemetry_parser") is None, reason="no telemetry-parser")


def atom(kind: bytes, *parts: bytes) -> bytes:
    """A box of an MP4 file."""
    return struct.pack(">I4s", 8 + sum(map(len, parts)), kind) + b"".join(parts)


def full(kind: bytes, *parts: bytes) -> bytes:
    """A box with version and flags 0."""
    return atom(kind, b"\0\0\0\0", *parts)


def klv(key: bytes, kind: bytes, size: int, count: int, data: bytes) -> bytes:
    """An item of GPMF, padded."""
    return key + kind + struct.pack(">BH", size, count) + data + b"\0" * (-len(data) % 4)


def nest(key: bytes, *parts: bytes) -> bytes:
    """A container of GPMF."""
    return klv(key, b"\0", 1, sum(map(len, parts)), b"".join(parts))


def gps5(rows: Sequence[tuple[float, float, float]], fix: int = 3) -> bytes:
    """A GoPro's payload up to HERO11: latitude, longitude and speed, ten million to a degree and a thousand to a m/s."""
    data = b"".join(
        struct.pack(">5i", round(lat * 1e7), round(lon * 1e7), 0, round(v * 1e3), 0) for lat, lon, v in rows
    )
    scale = struct.pack(">5i", 10_000_000, 10_000_000, 1000, 1000, 100)
    told = (klv(b"GPSF", b"L", 4, 1, struct.pack(">I", fix)), klv(b"SCAL", b"l", 4, 5, scale))
    return nest(b"DEVC", nest(b"STRM", *told, klv(b"GPS5", b"l", 20, len(rows), data)))


def gps9(rows: Sequence[tuple[float, float, float]], fix: int = 3) -> bytes:
    """The same of a HERO13, with a fix in each row."""
    data = b"".join(
        struct.pack(">7i2H", round(lat * 1e7), round(lon * 1e7), 0, round(v * 1e3), 0, 9000, 36_000_000, 150, fix)
        for lat, lon, v in rows
    )
    scale = struct.pack(">9i", 10_000_000, 10_000_000, 1000, 1000, 100, 1, 1000, 100, 1)
    told = (klv(b"TYPE", b"c", 1, 9, b"lllllllSS"), klv(b"SCAL", b"l", 4, 9, scale))
    return nest(b"DEVC", nest(b"STRM", *told, klv(b"GPS9", b"?", 32, len(rows), data)))


def camm(latitude: float, longitude: float) -> bytes:
    """A position of the Camera Motion Metadata format, without a speed."""
    return struct.pack("<HH3d", 0, 5, latitude, longitude, 500.0)


def with_track(video: bytes, payloads: Sequence[bytes], entry: bytes, handler: bytes, each_ms: int = 1000) -> bytes:
    """The video with a metadata track behind its own."""
    begin = video.index(b"moov") - 4
    (size,) = struct.unpack_from(">I", video, begin)
    assert begin + size == len(video), "the box moov is the last"
    count, matrix = len(payloads), struct.pack(">9I", 0x10000, 0, 0, 0, 0x10000, 0, 0, 0, 0x40000000)

    def track(first: int) -> bytes:
        places = [first + sum(map(len, payloads[:number])) for number in range(count)]
        head = struct.pack(">6I", 0, 0, 9, 0, count * each_ms, 0)
        table = atom(
            b"stbl",
            full(b"stsd", struct.pack(">I", 1), atom(entry, b"\0" * 7 + b"\1" + b"\0" * 4)),
            full(b"stts", struct.pack(">3I", 1, count, each_ms)),
            full(b"stsc", struct.pack(">4I", 1, 1, 1, 1)),
            full(b"stsz", struct.pack(">2I", 0, count), *(struct.pack(">I", len(each)) for each in payloads)),
            full(b"stco", struct.pack(">I", count), *(struct.pack(">I", place) for place in places)),
        )
        source = atom(b"dinf", full(b"dref", struct.pack(">I", 1), atom(b"url ", b"\0\0\0\1")))
        media = atom(
            b"mdia",
            full(b"mdhd", struct.pack(">4I", 0, 0, 1000, count * each_ms), b"\x55\xc4\0\0"),
            full(b"hdlr", b"mhlrmeta", b"\0" * 12, bytes([len(handler)]) + handler),
            atom(b"minf", atom(b"gmhd", full(b"gmin", b"\0" * 12)), source, table),
        )
        return atom(b"trak", atom(b"tkhd", b"\0\0\0\7", head, b"\0" * 12, matrix, b"\0" * 8), media)

    moov = atom(b"moov", video[begin + 8 :], track(0))
    moov = atom(b"moov", video[begin + 8 :], track(begin + len(moov) + 8))
    return video[:begin] + moov + atom(b"mdat", *payloads)


@pytest.fixture(scope="module")
def plain(tmp_path_factory: pytest.TempPathFactory) -> bytes:
    """A video of four seconds without telemetry."""
    path = tmp_path_factory.mktemp("plain") / "plain.mp4"
    writer = cv2.VideoWriter(str(path), cv2.VideoWriter.fourcc(*"mp4v"), 10.0, (64, 48))
    for number in range(40):
        writer.write(np.full((48, 64, 3), 4 * number, np.uint8))
    writer.release()
    return path.read_bytes()


def gopro(plain: bytes, payloads: Sequence[bytes]) -> bytes:
    """The video as a GoPro writes it."""
    return with_track(plain, payloads, b"gpmd", b"GoPro MET  ")


NORTHWARDS = [[(48.1 + 1e-4 * (second + part / 2), 11.5, 11.1) for part in range(2)] for second in range(4)]


@needs_package
@pytest.mark.parametrize("payload", [gps5, gps9])
def test_a_gopro_tells_positions_and_speeds_from_the_videos_start(payload: Any, plain: bytes, tmp_path: Path) -> None:
    video = tmp_path / "GX010001.MP4"
    video.write_bytes(gopro(plain, [payload(NORTHWARDS[0], fix=0), *(payload(rows) for rows in NORTHWARDS[1:])]))
    fixes = read_track(video)
    assert [fix.at_s for fix in fixes] == pytest.approx([1.0, 1.5, 2.0, 2.5, 3.0, 3.5]), "the first second had no fix"
    assert fixes[0][1:5] == pytest.approx((48.1001, 11.5, 11.1, 0.0), abs=1e-6)
    assert track_beside(video) == video


@needs_package
def test_a_track_beside_the_video_comes_before_the_one_inside(plain: bytes, tmp_path: Path) -> None:
    video = tmp_path / "a.mp4"
    video.write_bytes(gopro(plain, [gps5(rows) for rows in NORTHWARDS]))
    assert track_beside(video) == video
    (tmp_path / "a.csv").write_text("time,lat,lon\n0,48.1,11.5\n1,48.1001,11.5\n")
    assert track_beside(video) == tmp_path / "a.csv"


@needs_package
def test_a_camera_that_tells_no_speed_gives_one_by_its_positions(plain: bytes, tmp_path: Path) -> None:
    video = tmp_path / "a.mp4"
    places = [camm(48.1 + 1e-4 * second, 11.5) for second in range(4)]
    video.write_bytes(with_track(plain, places, b"camm", b"CameraMetadata"))
    fixes = read_track(video)
    assert [fix.at_s for fix in fixes] == pytest.approx([0.0, 1.0, 2.0, 3.0])
    assert [fix.speed_mps for fix in fixes] == pytest.approx([11.12] * 4, abs=0.01)


@needs_package
def test_a_video_without_telemetry_has_no_track(plain: bytes, tmp_path: Path) -> None:
    video = tmp_path / "a.mp4"
    video.write_bytes(plain)
    assert embedded_rows(video) == []
    assert track_beside(video) is None
    with pytest.raises(UserError, match="holds 0 fixes"):
        read_track(video)


def test_without_the_package_a_video_has_no_track(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("importlib.util.find_spec", lambda name: None)
    (tmp_path / "a.mp4").write_bytes(b"anything")
    assert track_beside(tmp_path / "a.mp4") is None


@needs_package
@settings(max_examples=15, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(data=st.data())
def test_no_file_does_more_than_hold_no_track(data: st.DataObject, plain: bytes, tmp_path: Path) -> None:
    """Bytes behind the video's own are changed, or the file is cut: lengths and counts that are gigabytes, too."""
    whole = gopro(plain, [gps5(rows) for rows in NORTHWARDS])
    begin = whole.index(b"GoPro MET") - 700
    hostile = bytearray(whole[: data.draw(st.integers(begin, len(whole)))])
    for _ in range(data.draw(st.integers(0, 8))):
        hostile[data.draw(st.integers(begin, len(hostile)).filter(lambda at: at < len(hostile)))] = data.draw(
            st.integers(0, 255)
        )
    video = tmp_path / "hostile.mp4"
    video.write_bytes(bytes(hostile))
    try:
        fixes: Sequence[Fix] = read_track(video)
    except UserError:
        return
    assert all(abs(fix.latitude_deg) <= 90 and abs(fix.longitude_deg) <= 180 and fix.at_s >= 0 for fix in fixes)
    assert all(fix.speed_mps is None or 0 <= fix.speed_mps <= 100 for fix in fixes)


def test_insta360_and_sony_are_read_as_the_package_tells_them() -> None:
    told = {"lat": 48.1, "lon": 11.5, "speed": 36.0, "track": 90.0, "altitude": 500.0}
    rows = [{**told, "unix_timestamp": 1.7e9 + at, "is_acquired": at > 1} for at in (0, 2, 3)]
    assert list(rows_of([{"GPS": {"Data": rows}}], 10.0)) == [
        (2.0, 48.1, 11.5, 10.0, 90.0),
        (3.0, 48.1, 11.5, 10.0, 90.0),
    ]
    frame = {
        "GPSStatus": ord("A"), "GPSLatitude": [48.0, 6.0, 0.0], "GPSLatitudeRef": ord("S"), "GPSLongitude": [11.0, 30.0, 0.0],
        "GPSLongitudeRef": ord("E"), "GPSSpeed": 36.0, "GPSSpeedRef": ord("K"),
    }  # fmt: skip
    lost = {**frame, "GPSStatus": ord("V")}
    assert list(rows_of([{"GPS": lost}, {"GPS": frame}], 3.0)) == [(1.5, -48.1, 11.5, 10.0, None)]


def test_the_names_of_videos_are_no_names_of_tracks() -> None:
    assert not {".gpx", ".nmea", ".csv"} & set(SUFFIXES)
