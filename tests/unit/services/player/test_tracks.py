"""Position tracks as receivers, cameras and spreadsheets write them."""

import re
from collections.abc import Callable
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from drivemcp.errors import UserError
from services.player.position_track import not_read, read_track, track_beside
from services.player.tracks.coordinates import degrees
from tests.unit.services.player.test_position_track import GPX, sentence

PLACE = (48 + 30.5 / 60, -(11 + 30.25 / 60))
WRITTEN = (
    ("48°30.5'N", "11°30.25'W"), ("48° 30.5′ N", "11° 30.25′ W"), ("N48 30.5", "W011 30.25"), ("48 30 30 N", "11 30 15 W"),
    ("48°30'30\"N", "11°30'15.0\"W"), ("48°30'30″ N", "-11°30'15″"), ("48:30:30", "-11:30:15"), ("48d30m30", "11d30m15W"),
    ("48.508333333", "-11.504166667"), ("48,508333333", "-11,504166667"), ("48,508333333° N", "11,504166667° W"),
    ("4830.500,N", "01130.250,W"), ("4830.500", "-1130.250"), ("48deg 30min 30sec N", "11deg 30min 15sec W"),
    ("48º30’30”N", "−11º30’15”"),
)  # fmt: skip


@pytest.mark.parametrize(("latitude", "longitude"), WRITTEN)
@pytest.mark.parametrize("delimiter", [";", "\t"])
def test_a_place_is_read_however_degrees_are_written(
    latitude: str, longitude: str, delimiter: str, tmp_path: Path
) -> None:
    path = tmp_path / "drive.csv"
    latitude, longitude = (
        each.replace(",N", f"{delimiter}N").replace(",W", f"{delimiter}W") for each in (latitude, longitude)
    )
    rows = [delimiter.join((f"{time}", latitude, longitude)) for time in (0, 1)]
    path.write_text("\n".join([delimiter.join(("time", "lat", "lon")), *rows]), encoding="utf-8")
    assert read_track(path)[0][1:3] == pytest.approx(PLACE, abs=1e-6)
    assert not_read(path) == ""


def test_a_receivers_sentences_as_a_table_keep_their_hemispheres_and_times(tmp_path: Path) -> None:
    for head in ("utc,lat,ns,lon,ew", "utc,lat,lon"):
        path = tmp_path / "drive.csv"
        path.write_text(f"{head}\n100059.00,3354.600,S,07036.000,W\n100100.00,3354.600,S,07036.000,W\n")
        assert [each[:3] for each in read_track(path)] == [(0.0, -33.91, -70.6), (1.0, -33.91, -70.6)]


@pytest.mark.parametrize(
    "text", ["11.5 N", "N 11.5", "48 61 00", "48.5 30", "48305'", "N48N", "48 30 30 s", "11 O", "", "north", "1 2 3 4"]
)
def test_what_may_be_another_place_is_no_longitude(text: str) -> None:
    assert degrees(text, "longitude") is None


@given(st.integers(0, 89), st.integers(0, 59), st.integers(0, 59_999), st.sampled_from("NS"))
def test_minutes_and_seconds_are_what_they_say(whole: int, minutes: int, thousandths: int, side: str) -> None:
    said = (whole + minutes / 60 + thousandths / 3.6e6) * (1 if side == "N" else -1)
    assert degrees(f"{whole}°{minutes}'{thousandths / 1000:.3f}\"{side}", "latitude") == pytest.approx(said, abs=1e-9)
    assert degrees(f"{side} {whole} {minutes} {thousandths / 1000:.3f}", "latitude") == pytest.approx(said, abs=1e-9)


def test_degrees_are_never_taken_for_minutes_where_one_row_is_in_degrees(tmp_path: Path) -> None:
    path = tmp_path / "drive.csv"
    path.write_text("time,lat,lon\n0,0.5,11.5\n1,0.5,11.5\n2,4830.5,1130.2\n")
    assert [each[1:3] for each in read_track(path)] == [(0.5, 11.5)] * 2
    assert "no place on earth" in not_read(path)


@pytest.mark.parametrize(
    "times",
    [
        ("23:59:59", "00:00:00"), ("23:59:59.0 UTC", "0:00:00 UTC"), ("31/12/2025 23:59:59", "01/01/2026 00:00:00"),
        ("12/31/2025 11:59:59 PM", "1/1/2026 12:00:00 AM"), ("31.12.2025 23:59:59,0", "01.01.2026 00:00:00,0"),
        ("2025-12-31T23:59:59Z", "2026-01-01T00:00:00+00:00"), ("1767225599", "1767225600"), ("1767225599000", "1767225600000"),
    ],
)  # fmt: skip
def test_a_second_over_midnight_is_a_second(times: tuple[str, str], tmp_path: Path) -> None:
    path = tmp_path / "drive.csv"
    path.write_text("".join(("time;lat;lon\n", *(f"{each};48.1;11.5\n" for each in times))))
    assert [each.at_s for each in read_track(path)] == [0.0, 1.0]


@pytest.mark.parametrize(
    "head",
    [
        "Temps;Latitude;Longitude;Vitesse (km/h);Cap", "Tijd;Breedtegraad;Lengtegraad;Snelheid (km/h);Koers",
        "Hora;Latitud;Longitud;Velocidad (km/h);Rumbo", "Ora;Latitudine;Longitudine;Velocità (km/h);Rotta",
        "Czas;Szerokość;Długość;Prędkość (km/h);Kurs", "Uhrzeit;Breite;Länge;Geschwindigkeit (km/h);Richtung",
    ],
)  # fmt: skip
def test_headers_in_the_languages_of_drivers_are_read(head: str, tmp_path: Path) -> None:
    path = tmp_path / "drive.csv"
    path.write_text(f"{head}\n10:00:00;48,1;11,5;36,0;90,5\n10:00:01;48,1;11,5;36,0;90,5\n", encoding="utf-8")
    assert list(read_track(path)[1][:5]) == pytest.approx([1.0, 48.1, 11.5, 10.0, 90.5])


@pytest.mark.parametrize("talker", ["GP", "GN", "GL", "GA"])
@pytest.mark.parametrize("kind", ["GGA", "GNS", "GLL"])
def test_without_rmc_a_position_with_a_time_of_day_is_a_fix(talker: str, kind: str, tmp_path: Path) -> None:
    bodies = {
        "GGA": "{at},4806.0{n}0,N,01130.000,E,{good},08,0.9,520.0,M,46.9,M,,",
        "GNS": "{at},4806.0{n}0,N,01130.000,E,{mode},08,0.9,520.0,46.9,,",
        "GLL": "4806.0{n}0,N,01130.000,E,{at},{state},A",
    }
    times = ("235959.00", "000000.00", "000001.00")
    lines = [
        sentence(f"{talker}{kind},{bodies[kind].format(at=at, n=n, good=1, mode='AN', state='A')}")
        for n, at in enumerate(times)
    ]
    lost = sentence(f"{talker}{kind},{bodies[kind].format(at='000002.00', n=9, good=0, mode='NN', state='V')}")
    path = tmp_path / "drive.nmea"
    path.write_text("".join([*lines, lost, "$GPGGA,000003.00,4806.0x0,N,01130.000,E,1*00\n"]))
    found = read_track(path)
    assert [each.at_s for each in found] == [0.0, 1.0, 2.0]
    assert found[1].latitude_deg == pytest.approx(48 + 6.01 / 60)
    assert found[1].speed_mps == pytest.approx(18.5, abs=0.1)
    assert "1 not read, first line 4: the receiver had no fix" in not_read(path)
    assert "1 not read, first line 5: no NMEA sentence" in not_read(path)


def test_one_sentence_with_a_broken_number_costs_itself_alone(tmp_path: Path) -> None:
    path = tmp_path / "drive.nmea"
    good = [sentence(f"GNRMC,10000{n}.00,A,4806.000,N,01130.000,E,19.44,90.0,010526,,") for n in (0, 1)]
    path.write_text(good[0] + "$GPRMC,100000.50,A,48x6.000,N,01130.000,E,19.44,90.0,010526,,\n" + good[1])
    assert [each.at_s for each in read_track(path)] == [0.0, 1.0]
    assert not_read(path) == "1 not read, first line 2: the receiver had no fix"


def test_of_two_tracks_at_one_time_the_first_counts_and_the_other_is_told(tmp_path: Path) -> None:
    track = GPX[GPX.index("<trk>") : GPX.index("</gpx>")]
    path = tmp_path / "drive.gpx"
    path.write_text(GPX.replace("</gpx>", track.replace("48.1", "52.5") + "</gpx>"))
    assert [each.latitude_deg for each in read_track(path)] == [48.1, 48.1001, 48.1002]
    assert not_read(path) == "1 not read, first track 2: it runs at the same time as another; keep one"
    later = track.replace("10:00:0", "10:00:1")
    path.write_text(GPX.replace("</gpx>", later + "</gpx>"))
    assert [each.at_s for each in read_track(path)] == [0.0, 1.0, 2.0, 10.0, 11.0, 12.0]
    assert not_read(path) == ""


def test_waypoints_and_other_kinds_of_files_say_what_to_do(tmp_path: Path) -> None:
    path = tmp_path / "drive.gpx"
    path.write_text(GPX[: GPX.index("<trk>")] + '<wpt lat="48.1" lon="11.5"/></gpx>')
    with pytest.raises(UserError, match="first waypoint 1: it is of no track; record or export the track itself"):
        read_track(path)
    path = tmp_path / "drive.kml"
    path.write_text("<kml/>")
    with pytest.raises(UserError, match="GPSBabel turns other kinds"):
        read_track(path)


@pytest.mark.parametrize(
    ("head", "times"),
    [
        ("epoch,lat,lon", ("1767225600", "1767225601")), ("epoch_ms,lat,lon", ("1767225600000", "1767225601000")),
        ("UTC time,lat,lon", ("10:00:59", "10:01:00")), ("local_time,lat,lon", ("2026-05-01 10:00:59", "2026-05-01 10:01:00")),
        ("date,time,lat,lon", ("010526,100059", "010526,100100")), ("Written by a lap timer\n\ntime (s),lat,lon", ("0", "1")),
    ],
)  # fmt: skip
def test_a_header_is_found_behind_remarks_and_its_time_by_more_names(
    head: str, times: tuple[str, str], tmp_path: Path
) -> None:
    path = tmp_path / "drive.csv"
    path.write_text("\n".join((head, *(f"{each},48.1,11.5" for each in times))))
    assert [each.at_s for each in read_track(path)] == [0.0, 1.0]
    assert not_read(path) == ""


@pytest.mark.parametrize(("unit", "speed"), [("km/h", 10.0), ("mph", 16.09), ("(kn)", 18.52)])
def test_a_speed_whose_column_is_named_by_its_unit_is_read(unit: str, speed: float, tmp_path: Path) -> None:
    path = tmp_path / "drive.csv"
    path.write_text(f"time,lat,lon,{unit}\n0,48.1,11.5,36\n1,48.1,11.5,36\n")
    assert [each.speed_mps for each in read_track(path)] == pytest.approx([speed, speed], abs=0.01)


def test_times_that_may_count_milliseconds_are_asked_for(tmp_path: Path) -> None:
    path = tmp_path / "drive.csv"
    rows = "0,48.1,11.5\n1000,48.1,11.5\n2000,48.1,11.5\n"
    path.write_text("time,lat,lon\n" + rows)
    with pytest.raises(UserError, match="column 'time' has numbers in steps of 1000: name their unit, as in time_ms"):
        read_track(path)
    path.write_text("time_ms,lat,lon\n" + rows)
    assert [each.at_s for each in read_track(path)] == [0.0, 1.0, 2.0]


def test_sentences_without_a_date_count_by_the_time_of_day(tmp_path: Path) -> None:
    path = tmp_path / "drive.nmea"
    times = ("235959.00", "000000.00", "000001.50")
    path.write_text("".join(sentence(f"GPRMC,{at},A,4806.000,N,01130.000,E,19.44,90.0,,,") for at in times))
    assert [each.at_s for each in read_track(path)] == [0.0, 1.0, 2.5]
    assert [each.speed_mps for each in read_track(path)] == pytest.approx([10.0] * 3, abs=0.01)


def test_a_column_without_a_name_moves_no_other(tmp_path: Path) -> None:
    path = tmp_path / "drive.csv"
    path.write_text(",time,lat,lon,,speed_mps\n0,0,48.1,11.5,x,10\n1,1,48.1,11.5,x,10\n2,2,48.1\n")
    assert [each[:4] for each in read_track(path)] == [(0.0, 48.1, 11.5, 10.0), (1.0, 48.1, 11.5, 10.0)]
    assert "1 not read, first line 4" in not_read(path)


@pytest.mark.parametrize(
    "times",
    [
        ("Fri May 01 10:00:59 2026", "Fri May 01 10:01:00 2026"), ("2026-05-01 10:00:59 GMT+0200", "2026-05-01 10:01:00 GMT+0200"),
        ("01-May-2026 10:00:59 CEST", "01-May-2026 10:01:00 CEST"),
    ],
)  # fmt: skip
def test_a_time_before_its_year_or_zone_is_read(times: tuple[str, str], tmp_path: Path) -> None:
    path = tmp_path / "drive.csv"
    path.write_text("".join(("%time,field.latitude,field.longitude\n", *(f"{each},48.1,11.5\n" for each in times))))
    assert [each.at_s for each in read_track(path)] == [0.0, 1.0]


@pytest.mark.parametrize("at", [0, 1, 2])
@pytest.mark.parametrize("date", ["1970-01-01", "2031-05-01"])
def test_a_fix_with_the_time_of_another_day_is_left_out_and_told(at: int, date: str, tmp_path: Path) -> None:
    path = tmp_path / "drive.csv"
    rows = [f"2026-05-01 10:00:0{n},48.1,11.5{n}\n" for n in range(4)]
    rows[at] = rows[at].replace("2026-05-01", date)
    path.write_text("".join(("time,lat,lon\n", *rows)))
    assert len(read_track(path)) == 3
    assert read_track(path)[-1].at_s <= 3.0
    assert f"first latitude 48.1, longitude 11.5{at}: its time lies days from that of the others" in not_read(
        path
    ).replace("11.5:", "11.50:")


def test_what_is_no_gpx_or_of_one_maker_says_what_to_do(tmp_path: Path) -> None:
    path = tmp_path / "drive.gpx"
    path.write_text('<?xml version="1.0"?>\n<!-- a note -->\n<kml xmlns="http://www.opengis.net/kml/2.2"/>')
    with pytest.raises(UserError, match="it begins with <kml> and is no GPX; GPSBabel turns"):
        read_track(path)
    path.write_text(re.sub(r"(</?)(?=\w)", r"\1g:", GPX).replace("xmlns=", "xmlns:g="))
    assert [each.latitude_deg for each in read_track(path)] == [48.1, 48.1001, 48.1002]
    path = tmp_path / "drive.nmea"
    path.write_text(sentence("PUBX,00,100000.00,4806.000,N,01130.000,E,500,G3,1,1,36,90,0,,1,1,1,8,0,0"))
    with pytest.raises(UserError, match="first line 1: of the receiver's maker alone; have it write RMC"):
        read_track(path)


@pytest.mark.parametrize(
    "names",
    ["%time,field.header.stamp.secs,field.header.stamp.nsecs", "x,header.stamp.sec,header.stamp.nanosec", "x,timestamp_sec,timestamp_nsec"],
)  # fmt: skip
def test_seconds_and_nanoseconds_of_a_recorded_message_are_one_time(names: str, tmp_path: Path) -> None:
    path = tmp_path / "drive.csv"
    own = "" if names.startswith("x") else "1777629600{}"
    rows = [(f"1777629600,{part}", f"{own.format(part.zfill(9))},") for part in ("5000000", "255000000")]
    path.write_text("".join((f"{names},latitude,longitude\n", *(f"{first}{time},48.1,11.5\n" for time, first in rows))))
    assert [each.at_s for each in read_track(path)] == [0.0, pytest.approx(0.25, abs=1e-6)]


HEAD = "time,lat,lon,speed_kmh\n"


def table(path: Path, *rows: str, head: str = HEAD) -> Path:
    path.write_text(head + "".join(f"{row}\n" for row in rows), encoding="utf-8")
    return path


@pytest.mark.parametrize(
    "times",
    [
        ("20240501235959", "20240502000000"),
        ("20240501235959.500", "20240502000000.500"),
        ("2024-10-27 02:59:59", "2024-10-27 02:00:00"),
    ],
)
def test_a_date_in_one_number_and_the_end_of_summer_time_are_a_second(times: tuple[str, str], tmp_path: Path) -> None:
    path = table(tmp_path / "drive.csv", *(f"{time},48.0,{11.0 + n},36" for n, time in enumerate(times)))
    assert [(fix.at_s, fix.longitude_deg) for fix in read_track(path)] == [(0.0, 11.0), (1.0, 12.0)]


@pytest.mark.parametrize(
    ("times", "told"),
    [
        ((0, 40, 80), "name their unit"),
        (("45413.41666667", "45413.41667824", "45413.41668982"), "counts days, as spreadsheets do"),
        (("00:00", "00:01", "00:02"), "write hours, minutes and seconds"),
    ],
)
def test_times_that_may_count_something_else_are_asked_for(
    times: tuple[object, ...], told: str, tmp_path: Path
) -> None:
    path = table(tmp_path / "drive.csv", *(f"{time},48.0,11.0,36" for time in times))
    with pytest.raises(UserError, match=f"column 'time'.*{told}"):
        read_track(path)


@pytest.mark.parametrize(("name", "value"), [("heading_rad", "1.5707963"), ("compass_heading(degrees)", "90")])
def test_a_course_is_in_the_unit_of_its_name(name: str, value: str, tmp_path: Path) -> None:
    head = f"time_since_start,latitudeE7,longitudeE7,{name}\n"
    path = table(
        tmp_path / "drive.csv", *(f"{n}|480000000|-110000000|{value}" for n in (0, 1)), head=head.replace(",", "|")
    )
    first = read_track(path)[0]
    assert first[1:3] == (48.0, -11.0)
    assert first.course_deg == pytest.approx(90.0)


def test_a_speed_that_is_no_number_is_told(tmp_path: Path) -> None:
    path = table(tmp_path / "drive.csv", "0,48.0,11.0,36 km/h", "1,48.0,11.0001,36")
    assert read_track(path)[1].speed_mps == pytest.approx(10.0)
    assert not_read(path) == (
        "1 not read, first line 2: speed_kmh '36 km/h': its speed is no number; the speed is taken from the places"
    )


def test_a_column_may_hold_a_place_with_its_hemisphere(tmp_path: Path) -> None:
    head = "INDEX,TAG,DATE,TIME,LATITUDE N/S,LONGITUDE E/W,HEIGHT,SPEED KMH,HEADING\n"
    rows = (f"{n},T,240501,10000{n},33.9000S,070.6000W,5,36,90" for n in (1, 2))
    assert read_track(table(tmp_path / "drive.csv", *rows, head=head))[0][1:5] == (-33.9, -70.6, 10.0, 90.0)


GPX_11 = (
    '<gpx version="1.1" xmlns="http://www.topografix.com/GPX/1/1"><trk><trkseg>'
    '<trkpt lat="48" lon="11"><time>2024-05-01T10:00:00Z</time>{}</trkpt>'
    '<trkpt lat="48.0001" lon="11"><time>2024-05-01T10:00:01Z</time></trkpt></trkseg></trk></gpx>'
)


@pytest.mark.parametrize(
    ("said", "speed_mps", "course_deg"),
    [
        ("<speed>12.5</speed><course>90</course>", 12.5, 90.0),
        ('<speed unit="km/h">45</speed>', 12.5, 0.0),
        ("<speed>12,5</speed>", 12.5, 0.0),
        ('<extensions><e:speed xmlns:e="x">12.5</e:speed><e:course xmlns:e="x">90</e:course></extensions>', 12.5, 90.0),
    ],
)
def test_speed_and_course_of_a_point_are_read_where_programs_write_them(
    said: str, speed_mps: float, course_deg: float, tmp_path: Path
) -> None:
    path = tmp_path / "drive.gpx"
    path.write_text(GPX_11.format(said))
    first = read_track(path)[0]
    assert first[3:5] == pytest.approx((speed_mps, course_deg))
    assert not_read(path) == ""


def test_a_speed_of_an_unknown_unit_is_taken_from_the_places(tmp_path: Path) -> None:
    path = tmp_path / "drive.gpx"
    path.write_text(GPX_11.format('<speed unit="furlongs">45</speed>'))
    assert read_track(path)[0].speed_mps == pytest.approx(11.1, abs=0.1)
    assert "its speeds are in none of" in not_read(path)


@pytest.mark.parametrize("sides", [("", "E"), ("N", ""), ("N", "Q")])
def test_a_place_without_its_hemisphere_is_none(sides: tuple[str, str], tmp_path: Path) -> None:
    path = tmp_path / "drive.nmea"
    fixes = (f"GNRMC,10000{n}.00,A,4800.0000,{{}},01130.0000,{{}},10.0,90.0,010524,,,A" for n in range(4))
    path.write_text("".join(sentence(each.format(*(sides if n == 1 else "NE"))) for n, each in enumerate(fixes)))
    assert [fix.at_s for fix in read_track(path)] == [0.0, 2.0, 3.0]
    assert not_read(path) == "1 not read, first line 2: the receiver had no fix"


def driven(*extra: tuple[float, float], count: int = 10) -> list[tuple[float, float]]:
    """(time, latitude) of a car with 11 m/s northward, and of further fixes."""
    return sorted([(float(n), 48.0 + 1e-4 * n) for n in range(count)] + list(extra))


def rows(path: Path, places: list[tuple[float, float]], head: str = "time_s,lat,lon\n") -> Path:
    return table(path, *(f"{at_s},{latitude:.8f},11.0" for at_s, latitude in places), head=head)


@pytest.mark.parametrize(
    ("extra", "told"),
    [
        ((-13_000.0, 47.0), "no other fix is near it in time"),
        ((90_000.0, 47.0), "its time lies days from that of the others"),
        ((4.5, 0.0001), "a receiver's jump; no car is so fast"),
    ],
)
def test_a_fix_of_another_time_or_place_is_left_out_and_told(
    extra: tuple[float, float], told: str, tmp_path: Path
) -> None:
    path = rows(tmp_path / "drive.csv", driven(extra))
    assert [fix.at_s for fix in read_track(path)] == [float(n) for n in range(10)]
    assert all(fix.speed_mps == pytest.approx(11.1, abs=0.1) for fix in read_track(path))
    assert not_read(path).startswith("1 not read")
    assert told in not_read(path)


def test_of_two_epochs_of_a_receiver_the_longer_counts(tmp_path: Path) -> None:
    path = tmp_path / "drive.nmea"
    dates = ("151004", "151004", "010624", "010624", "010624", "010624")
    body = "GNRMC,10000{n}.00,A,4800.0000,N,01130.0000,E,10.0,90.0,{date},,,A"
    path.write_text("".join(sentence(body.format(n=n, date=date)) for n, date in enumerate(dates)))
    assert [fix.at_s for fix in read_track(path)] == [0.0, 1.0, 2.0, 3.0]
    assert not_read(path).startswith("2 not read")


@pytest.mark.parametrize("held", [2, 5, 10])
def test_a_place_that_is_written_again_is_no_standstill(held: int, tmp_path: Path) -> None:
    places = [(n / 10, 48.0 + 1e-4 * held / 10 * (n // held)) for n in range(60)]
    found = read_track(rows(tmp_path / "drive.csv", places))
    assert all(fix.speed_mps == pytest.approx(11.1, rel=0.02) for fix in found)


def test_a_car_that_stands_stands(tmp_path: Path) -> None:
    places = [(n / 10, 48.0 + 1e-5 * min(n, 40)) for n in range(200)]
    found = read_track(rows(tmp_path / "drive.csv", places))
    assert all(fix.speed_mps == 0.0 for fix in found if fix.at_s > 7.0)
    assert all(fix.speed_mps == pytest.approx(11.1, rel=0.1) for fix in found if fix.at_s < 3.9)


@pytest.mark.parametrize("name", ["V.CSV", "v.csv", "V.csv"])
def test_a_track_is_found_beside_a_video_whatever_its_capitals(name: str, tmp_path: Path) -> None:
    (tmp_path / "V.MP4").write_bytes(b"")
    rows(tmp_path / name, driven())
    assert track_beside(tmp_path / "V.MP4") == tmp_path / name


NORTH_10_MPS = [48.0 + at * 10.0 / 111_194.93 for at in range(12)]
"""Latitudes of a car that drives north at 10 m/s, second by second."""


@pytest.mark.parametrize(
    ("head", "time"),
    [
        ("timestamp", lambda at: f"{638_501_544_000_000_000 + at * 10_000_000}"),  # .NET ticks
        ("timestamp", lambda at: f"{133_590_312_000_000_000 + at * 10_000_000}"),  # Windows file time
        ("utc_time", lambda at: f"1000{at + 55}.000" if at < 5 else f"1001{at - 5:02d}.000"),
        ("time", lambda at: f"1000{at + 55}" if at < 5 else f"1001{at - 5:02d}"),
    ],
)
def test_seconds_are_found_in_ticks_and_in_times_of_day_without_colons(
    head: str, time: Callable[[int], str], tmp_path: Path
) -> None:
    path = tmp_path / "drive.csv"
    rows = [f"{time(at)},{latitude:.7f},11.5" for at, latitude in enumerate(NORTH_10_MPS)]
    path.write_text("\n".join((f"{head},lat,lon", *rows)))
    assert [fix.speed_mps for fix in read_track(path)] == pytest.approx([10.0] * 12, rel=0.01)


@pytest.mark.parametrize("first", [739_373.416_666_666_7, 2_460_431.916_666_6])
def test_days_of_other_calendars_are_asked_to_be_times(first: float, tmp_path: Path) -> None:
    path = tmp_path / "drive.csv"
    rows = [f"{first + at / 86_400:.9f},{latitude:.7f},11.5" for at, latitude in enumerate(NORTH_10_MPS)]
    path.write_text("\n".join(("time,lat,lon", *rows)))
    with pytest.raises(UserError, match="counts days"):
        read_track(path)


@pytest.mark.parametrize("step", [100.0, 33.333])
def test_milliseconds_with_a_decimal_point_are_asked_for(step: float, tmp_path: Path) -> None:
    path = tmp_path / "drive.csv"
    rows = [f"{at * step:.3f},{latitude:.7f},11.5" for at, latitude in enumerate(NORTH_10_MPS)]
    path.write_text("\n".join(("time,lat,lon", *rows)))
    with pytest.raises(UserError, match=f"steps of {step:g}: name their unit"):
        read_track(path)


@pytest.mark.parametrize(("name", "unit"), [("latitude_rad", "longitude_rad"), ("latitude (rad)", "longitude (rad)")])
def test_places_in_radians_are_read_as_such(name: str, unit: str, tmp_path: Path) -> None:
    path = tmp_path / "drive.csv"
    path.write_text(f"time_s,{name},{unit}\n0,0.837758041,0.2007128640\n1,0.837759609,0.2007128640\n")
    assert read_track(path)[0].latitude_deg == pytest.approx(48.0)


@pytest.mark.parametrize("code", ["-1", "511", "720.5"])
def test_a_receivers_code_for_no_course_is_none(code: str, tmp_path: Path) -> None:
    path = tmp_path / "drive.csv"
    rows = [f"{at},{latitude:.7f},11.5,{code}" for at, latitude in enumerate(NORTH_10_MPS)]
    path.write_text("\n".join(("time_s,lat,lon,course", *rows)))
    assert {fix.course_deg for fix in read_track(path)} == {0.0}


@pytest.mark.parametrize("rate", [5, 10])
def test_fixes_of_one_second_are_spread_over_it(rate: int, tmp_path: Path) -> None:
    path = tmp_path / "drive.csv"
    rows = [f"10:00:{at // rate:02d},{48.0 + at * 10.0 / rate / 111_194.93:.8f},11.5" for at in range(4 * rate)]
    path.write_text("\n".join(("time,lat,lon", *rows)))
    assert [fix.speed_mps for fix in read_track(path)] == pytest.approx([10.0] * (4 * rate), rel=0.02)


@pytest.mark.parametrize("stale", [{0: 45.0, 1: 45.0}, dict.fromkeys(range(30, 60), 48.0)])
def test_a_jump_or_a_place_that_stands_says_nothing_of_the_unit_of_speeds(
    stale: dict[int, float], tmp_path: Path
) -> None:
    path = tmp_path / "drive.csv"
    rows = [f"{at},{stale.get(at, 48.0 + at * 10.0 / 111_194.93):.7f},11.5,36" for at in range(60)]
    path.write_text("\n".join(("time_s,lat,lon,speed_kmh", *rows)))
    assert [fix.speed_mps for fix in read_track(path)] == pytest.approx([10.0] * 60)


def test_a_decimal_comma_before_a_power_of_ten_is_one(tmp_path: Path) -> None:
    path = tmp_path / "drive.csv"
    path.write_text("Zeit (s);Breite (°);Länge (°);Richtung (°)\n0,0E0;4,8E1;1,15E1;9,0E1\n1,0E0;4,8E1;1,15E1;9,0E1\n")
    assert read_track(path)[0][1:3] == (48.0, 11.5)


VBO = """File created on 12/05/2026 at 10:11:12

[header]
satellites
time
latitude
longitude
velocity {unit}
heading
height

[comments]
made by a logger

[column names]
sats time lat long velocity heading height

[data]
009 235959.90 +03119.09973 +00058.49277 {speed} 180.23 +00120.50
000 235959.95 +03119.09973 +00058.49277 {speed} 180.23 +00120.50
009 000000.10 +03119.09873 +00058.49277 {speed} 180.23 +00120.50
"""


@pytest.mark.parametrize(
    ("unit", "speed"), [("kmh", "036.000"), ("", "036.000"), ("mph", "22.369363"), ("knots", "19.438445")]
)
def test_a_loggers_minutes_are_west_positive_and_its_speed_is_in_the_headers_unit(
    unit: str, speed: str, tmp_path: Path
) -> None:
    (path := tmp_path / "lap.vbo").write_text(VBO.format(unit=unit, speed=speed), encoding="utf-8")
    first, last = read_track(path)
    assert first[1:5] == pytest.approx((3119.09973 / 60.0, -58.49277 / 60.0, 10.0, 180.23), abs=1e-5)
    assert last.at_s - first.at_s == pytest.approx(0.2)
    assert "1 not read, first line 20: the receiver had no fix" in not_read(path)


def test_a_loggers_file_without_its_columns_or_in_an_unknown_unit_says_what_is_wrong(tmp_path: Path) -> None:
    (path := tmp_path / "lap.vbo").write_text(
        VBO.replace("lat long", "x y").format(unit="kmh", speed="1"), encoding="utf-8"
    )
    with pytest.raises(UserError, match="no lat, long under"):
        read_track(path)
    path.write_text(VBO.format(unit="furlongs", speed="1"), encoding="utf-8")
    with pytest.raises(UserError, match="'furlongs'"):
        read_track(path)


PLACES = [(number, 48.1 + number * 1e-4) for number in range(20)]
"""A car that drives 11.1 m/s northwards."""


@pytest.mark.parametrize(
    ("head", "row"),
    [
        (
            "timestamp,latitude,longitude,speed\nunix time,deg,deg,m/s\n,100: gps,100: gps,100: gps",
            "17145504{0:02d},{1},11.5,11.1",
        ),
        ("Time,GPS Latitude,GPS Longitude,GPS Speed\nsec,deg,deg,km/h", "{0},{1},11.5,40.0"),
        ("Time,GPS Latitude,GPS Longitude,GPS Speed\nms,deg,deg,km/h", "{0}000,{1},11.5,40.0"),
        (
            "cts,date,GPS (Lat.) [deg],GPS (Long.) [deg],GPS (2D speed) [m/s]",
            "{0}000,2024-05-01T10:00:{0:02d}Z,{1},11.5,11.1",
        ),
        ("Device,Fix Time,Latitude,Longitude,Speed (kn)", "x,2024-05-01 10:00:{0:02d},{1},11.5,21.6"),
    ],
    ids=["RaceChrono", "units below the header", "milliseconds", "telemetry of GoPro", "Traccar"],
)
def test_tables_of_recorders_say_their_units_in_their_own_ways(head: str, row: str, tmp_path: Path) -> None:
    (path := tmp_path / "a.csv").write_text("\n".join((head, *(row.format(*place) for place in PLACES))))
    fixes = read_track(path)
    assert len(fixes) == len(PLACES)
    assert fixes[5].speed_mps == pytest.approx(11.1, abs=0.02)
    assert fixes[-1].at_s == pytest.approx(19.0)
    assert not not_read(path)


def test_a_speed_without_a_unit_is_left_out_and_told_and_the_places_tell_the_speed(tmp_path: Path) -> None:
    rows = (f"{number},{latitude},11.5,40.0" for number, latitude in PLACES)
    (path := tmp_path / "a.csv").write_text("\n".join(("time,lat,lon,speed", *rows)))
    assert read_track(path)[5].speed_mps == pytest.approx(11.1, abs=0.1)
    assert "column 'speed': it names no unit, as speed_kmh does" in not_read(path)


def test_sentences_under_another_ending_are_told_with_what_to_do(tmp_path: Path) -> None:
    (path := tmp_path / "drive.txt").write_text("$GPRMC,100000,A,4806.0,N,01130.0,E,21.6,0.0,010524,,,A*00\n")
    with pytest.raises(UserError, match=r"NMEA 0183: rename it to drive.nmea"):
        read_track(path)
