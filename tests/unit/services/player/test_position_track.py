"""Position tracks beside a recording: speed and position at the recording's pace."""

import math
import re
from datetime import UTC, datetime
from pathlib import Path
from tempfile import TemporaryDirectory

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
from services.player.position_track import metres, not_read, read_track, track_beside, track_messages
from services.player.service import SERVICE, PlayerConfig
from services.player.tracks.fix import Fix

GPX = """<?xml version="1.0"?>
<gpx version="1.1" creator="test" xmlns="http://www.topografix.com/GPX/1/1"><trk><trkseg>
<trkpt lat="48.1000" lon="11.5"><time>2026-05-01T10:00:00Z</time></trkpt>
<trkpt lat="48.1001" lon="11.5"><time>2026-05-01T10:00:01Z</time></trkpt>
<trkpt lat="48.1002" lon="11.5"><time>2026-05-01T10:00:02Z</time><extensions><speed>12.5</speed></extensions></trkpt>
</trkseg></trk></gpx>
"""


ROUTE = re.sub("</?trkseg>", "", GPX).replace("trkpt", "rtept").replace("trk>", "rte>")


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
    dated = suffix != "csv"
    assert all((fix.utc_s is not None) is dated for fix in fixes)


def test_gpx_times_without_a_zone_may_be_local_and_tell_no_utc(tmp_path: Path) -> None:
    (path := tmp_path / "drive.gpx").write_text(GPX.replace("Z</time>", "</time>"))
    assert [fix.utc_s for fix in read_track(path)] == [None] * 3


@pytest.mark.parametrize(
    ("name", "text", "said"),
    [
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
    st.tuples(st.floats(0.0, 30.0), st.floats(-89.0, 89.0), st.floats(-180.0, 180.0), st.none() | st.floats(-1e3, 1e3))
    .filter(lambda row: any(row[1:3])),
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
        fix = places.wait()
        assert fix.latitude_deg == pytest.approx(48.1)
        assert fix.utc_s == pytest.approx(datetime(2026, 5, 1, 10, tzinfo=UTC).timestamp(), abs=5.0)


@pytest.mark.parametrize(
    ("head", "first", "second"),
    [
        ("time_ms,lat,lon", "0,48.1000,11.5", "1000,48.1001,11.5"),
        ("Elapsed time (ms),lat,lon", "0,48.1000,11.5", "1000,48.1001,11.5"),
        ("timestamp_us,lat,lon", "0,48.1000,11.5", "1000000,48.1001,11.5"),
        ("time(millisecond),datetime(utc),latitude,longitude", "500,x,48.1000,11.5", "1500,x,48.1001,11.5"),
        ("date,time,lat,lon", "2026-05-01,10:00:00,48.1000,11.5", "2026-05-01,10:00:01,48.1001,11.5"),
        ("Zeit;Breite;Länge", "0,0;48,1000;11,5", "1,0;48,1001;11,5"),
        ("# a remark\nsep=;\ntime;lat;lon", "0;48.1000;11.5", "1;48.1001;11.5"),
        (
            "time,lat,lon,speed_limit,speed_accuracy,GPS speed [km/h]",
            "0,48.1000,11.5,50,1,40",
            "1,48.1001,11.5,50,1,40",
        ),
    ],
)
@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "utf-16", "cp1252"])
def test_a_table_is_read_by_the_units_and_the_writing_of_its_header(
    head: str, first: str, second: str, encoding: str, tmp_path: Path
) -> None:
    path = tmp_path / "drive.csv"
    path.write_bytes(f"{head}\n{first}\n{second}\n".encode(encoding))
    found = read_track(path)
    assert [(fix.at_s, fix.latitude_deg, fix.longitude_deg) for fix in found] == [
        (0.0, 48.1, 11.5),
        (1.0, 48.1001, 11.5),
    ]
    assert found[0].speed_mps == pytest.approx(11.1, abs=0.1)
    assert not_read(path) == ""


@pytest.mark.parametrize(
    "sides", [("N/S", "E/W"), ("NS", "EW"), ("lat_dir", "lon_dir"), ("latitude_ref", "longitude_ref")]
)
def test_a_hemisphere_in_a_column_of_its_own_counts(sides: tuple[str, str], tmp_path: Path) -> None:
    path = tmp_path / "drive.csv"
    path.write_text(f"time,{sides[0]},lat,{sides[1]},lon\n0,S,33.9,W,70.6\n1,S,33.9,W,70.6\n")
    assert [fix[1:3] for fix in read_track(path)] == [(-33.9, -70.6)] * 2


LEFT = {
    "a.csv": (
        "time,lat,lon\ns,deg,deg\n0,48.1,11.5\n1,48.1,N 11.5\n,,\n2,48.1,11.5\n3,4806.0,1130.0\n",
        (
            "1 not read, first line 4: lat '48.1', lon 'N 11.5'",
            "no place on earth",
        ),
    ),
    "a.gpx": (GPX.replace("<time>2026-05-01T10:00:01Z</time>", ""), ("1 not read, first point 2: it has no time",)),
    "a.nmea": (
        NMEA,
        ("2 not read, first line 3: the receiver had no fix", "1 not read, first line 4: no NMEA sentence"),
    ),
}


@pytest.mark.parametrize("name", LEFT)
def test_what_is_not_read_of_a_track_is_counted_with_its_place(name: str, tmp_path: Path) -> None:
    text, told = LEFT[name]
    path = tmp_path / name
    path.write_text(text)
    assert len(read_track(path)) == 2
    assert all(each in not_read(path) for each in told)


@pytest.mark.parametrize(
    ("name", "text", "said"),
    [
        ("a.nmea", sentence("GPVTG,90.0,T,,M,19.44,N,36.0,K"), "have the receiver write RMC"),
        ("a.gpx", ROUTE, "first route point 1: it is of no track"),
        ("a.gpx", GPX[:250], "cut or damaged"),
    ],
)  # fmt: skip
def test_a_track_beside_a_recording_that_cannot_be_read_is_no_silence(
    name: str, text: str, said: str, tmp_path: Path
) -> None:
    (tmp_path / name).write_text(text)
    with pytest.raises(UserError, match=f"{said}.*or --track none"):
        track_beside(tmp_path / "a.mp4")


def test_of_several_tracks_beside_a_recording_one_has_to_be_named(tmp_path: Path) -> None:
    for name in ("a.gpx", "b.gpx"):
        (tmp_path / name).write_text(GPX)
    with pytest.raises(UserError, match=r"several position tracks: a.gpx, b.gpx; name one with --track"):
        track_beside(tmp_path)


def test_places_of_a_receiver_without_a_fix_are_none_and_take_no_time(tmp_path: Path) -> None:
    path = tmp_path / "a.csv"
    path.write_text("time,lat,lon\n0,0,0\n1,0,0\n2,48.1,11.5\n3,48.1,11.5\n")
    assert [(fix.at_s, fix.latitude_deg) for fix in read_track(path)] == [(2.0, 48.1), (3.0, 48.1)]
    path = tmp_path / "a.nmea"
    path.write_bytes(
        b"\xb5\x62\xff\n" + (sentence("GNRMC,100000.00,A,4806.000,N,01130.000,E,,,060180,,") + NMEA).encode()
    )
    assert [fix.at_s for fix in read_track(path)] == [0.0, 2.0]


def test_the_encoding_that_a_file_names_counts(tmp_path: Path) -> None:
    path = tmp_path / "a.gpx"
    named = GPX.replace('"1.0"?>', '"1.0" encoding="ISO-8859-1"?>').replace("<trk>", "<trk><name>Straße</name>")
    path.write_bytes(named.encode("latin-1"))
    assert len(read_track(path)) == 3


@given(mps=st.floats(6.0, 40.0), times=st.sampled_from([1.0, 1.943844, 2.236936, 3.6, 1 / 3.6]))
def test_speeds_of_another_unit_than_their_format_has_are_taken_from_the_places(mps: float, times: float) -> None:
    """An app that writes km/h, knots or miles an hour where GPX has m/s."""
    points = "".join(
        f'<trkpt lat="{48.0 + math.degrees(mps * at / 6_371_000.0):.7f}" lon="11.5"><time>2026-05-01T10:00:{at:02},0Z</time>'
        f"<extensions><speed>{mps * times:.4f}</speed></extensions></trkpt>"
        for at in range(8)
    )
    with TemporaryDirectory() as folder:
        path = Path(folder) / "a.gpx"
        path.write_text(f'<gpx version="1.1" creator="a"><trk><trkseg>{points}</trkseg></trk></gpx>')
        assert [fix.speed_mps for fix in read_track(path)] == pytest.approx([mps] * 8, rel=0.01)
        assert ("km/h for m/s" in not_read(path)) is (times != 1.0)
