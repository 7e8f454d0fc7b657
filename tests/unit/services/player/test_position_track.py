"""Position tracks beside a recording: speed and position at the recording's pace."""

from pathlib import Path

import cv2
import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from drivemcp.errors import UserError
from drivemcp.testing import bus
from proto import topics
from proto.sensors import GnssFix
from proto.vehicle import Ego
from services.player.position_track import Fix, metres, read_track, track_beside, track_messages
from services.player.service import SERVICE, PlayerConfig

GPX = """<?xml version="1.0"?>
<gpx version="1.1" creator="test" xmlns="http://www.topografix.com/GPX/1/1"><trk><trkseg>
<trkpt lat="48.1000" lon="11.5"><time>2026-05-01T10:00:00Z</time></trkpt>
<trkpt lat="48.1001" lon="11.5"><time>2026-05-01T10:00:01Z</time></trkpt>
<trkpt lat="48.1002" lon="11.5"><time>2026-05-01T10:00:02Z</time><extensions><speed>12.5</speed></extensions></trkpt>
</trkseg></trk></gpx>
"""


def sentence(body: str) -> str:
    """An NMEA sentence with its checksum."""
    check = 0
    for byte in body.encode():
        check ^= byte
    return f"${body}*{check:02X}\n"


NMEA = (
    sentence("GPRMC,100000.00,A,4806.000,N,01130.000,E,19.44,90.0,010526,,")
    + sentence("GPGGA,100000.00,4806.000,N,01130.000,E,1,08,0.9,520.0,M,46.9,M,,")
    + sentence("GPRMC,100001.00,V,,,,,,,010526,,")
    + "$GPRMC,garbage*00\n"
    + sentence("GPRMC,100001.00,A,4806.000,N,01130.000,E,1x,90.0,000000,,")
    + sentence("GPRMC,235960.00,A,,,,,19.44,90.0,010526,,")
    + sentence("GPRMC,100002.00,A,4806.000,N,01130.032,E,19.44,90.0,010526,,")
)
FILES = {
    "gpx": (GPX, [11.1, 11.1, 12.5], 0.0),
    "nmea": (NMEA, [10.0, 10.0], 90.0),
    "csv": ("time,lat,lon,speed_kmh\n5,48.1,11.5,36\n6,48.1,11.50013,36\n7,48.1,11.50026,\n", [10.0, 10.0, 9.7], 90.0),
}


@pytest.mark.parametrize("suffix", sorted(FILES))
def test_each_format_tells_speed_course_and_time_from_the_first_fix(suffix: str, tmp_path: Path) -> None:
    text, speeds, course = FILES[suffix]
    path = tmp_path / f"drive.{suffix}"
    path.write_text(text)
    fixes = read_track(path)
    assert track_beside(tmp_path / "drive.mp4") == path
    assert [fix.speed_mps for fix in fixes] == pytest.approx(speeds, abs=0.1)
    assert [fix.course_deg for fix in fixes] == pytest.approx([course] * len(fixes), abs=1.0)
    assert (fixes[0].at_s, fixes[-1].at_s) == (0.0, 2.0)


@pytest.mark.parametrize(
    ("name", "text", "said"),
    [
        ("a.csv", "time,lat,lon,speed\n0,48.1,11.5,50\n1,48.1,11.5,50\n", "name its unit"),
        ("a.csv", "when,lat,lon\n0,48.1,11.5\n", "no column time among"),
        ("a.csv", "time,lat,lon\nnoon,48.1,11.5\n", "line 2: time 'noon'"),
        ("a.csv", "", "no column time"),
        ("a.gpx", "<gpx", "a.gpx"),
        ("a.nmea", "nothing", "holds 0 fixes"),
        ("a.kml", "", "one of .gpx, .nmea, .csv"),
    ],
)
def test_a_track_that_is_none_is_refused_with_its_field(name: str, text: str, said: str, tmp_path: Path) -> None:
    path = tmp_path / name
    path.write_text(text)
    with pytest.raises(UserError, match=said):
        read_track(path)


fixes = st.lists(
    st.tuples(st.floats(0.0, 30.0), st.floats(-89.0, 89.0), st.floats(-180.0, 180.0), st.none() | st.floats(-1e3, 1e3)),
    min_size=2, max_size=12,
)  # fmt: skip


@settings(max_examples=60, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(rows=fixes, offset=st.floats(-20.0, 40.0))
def test_no_track_gives_an_impossible_speed_or_a_time_before_the_recording(
    rows: list[tuple[float, float, float, float | None]], offset: float, tmp_path: Path
) -> None:
    path = tmp_path / "drawn.csv"
    lines = [f"{at},{lat},{lon},{'' if speed is None else speed}" for at, lat, lon, speed in rows]
    path.write_text("\n".join(["time,lat,lon,speed_mps", *lines]))
    told = list(track_messages(read_track(path), offset))
    assert all(each.at_s >= 0.0 for each in told)
    speeds = [each.message.speed_mps for each in told if isinstance(each.message, Ego)]
    assert all(speed is None or 0.0 <= speed <= 100.0 for speed in speeds)


def test_no_position_lies_between_the_two_sides_of_a_jump_or_far_from_the_antimeridian() -> None:
    jump = list(track_messages((Fix(0.0, 50.0, 9.0), Fix(1.0, 52.5, -1.5)), 0.0))
    across = list(track_messages((Fix(0.0, 10.0, 179.9999), Fix(1.0, 10.0, -179.9999)), 0.0))
    places = [
        [each.message.longitude_deg for each in told if isinstance(each.message, GnssFix)] for told in (jump, across)
    ]
    assert places[0] == [9.0]
    assert all(longitude is not None and abs(abs(longitude) - 180.0) < 0.001 for longitude in places[1])


def test_a_table_that_is_no_track_is_passed_over(tmp_path: Path) -> None:
    (tmp_path / "labels.csv").write_text("file,label\na.jpg,car\n")
    assert track_beside(tmp_path) is None
    (tmp_path / "way.csv").write_text(
        "time,lat,lon\n1700000000000000,48.1,11.5\n1700000001000000,48.1,11.5001\n1700000002000000,48.1"
    )
    found = track_beside(tmp_path)
    assert found is not None
    assert [fix.at_s for fix in read_track(found)] == pytest.approx([0.0, 1.0])


def test_nothing_is_interpolated_over_a_gap() -> None:
    told = list(track_messages((Fix(0.0, 48.0, 11.0, 10.0), Fix(60.0, 48.01, 11.0, 10.0)), 0.0))
    assert {each.at_s for each in told} == {0.0}


def test_a_degree_of_latitude_is_111_km() -> None:
    assert metres(Fix(0.0, 48.0, 11.0), Fix(1.0, 49.0, 11.0)) == pytest.approx((0.0, 111_195.0), abs=10.0)


def test_speed_and_position_are_played_beside_the_pictures(tmp_path: Path) -> None:
    for number in range(8):
        cv2.imwrite(str(tmp_path / f"{number}.png"), np.full((90, 160, 3), 40, np.uint8))
    (tmp_path / "drive.gpx").write_text(GPX)
    with bus() as b:
        ego, places = b.collect(topics.EGO), b.collect(topics.GNSS)
        config = PlayerConfig(source=str(tmp_path), picture_period_s=0.1, track=str(tmp_path / "drive.gpx"))
        b.start(SERVICE, config)
        assert ego.wait().speed_mps == pytest.approx(11.1, abs=0.1)
        assert places.wait().latitude_deg == pytest.approx(48.1)
