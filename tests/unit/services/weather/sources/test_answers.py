"""Answers in the formats of the services, and what they are taken to say."""

import json
from datetime import UTC, datetime
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from services.weather.observations.observation import SURE, Interval, clean
from services.weather.sources import met_norway, metar, open_meteo, provider
from services.weather.sources.provider import NS, Place, UnusableAnswer, rounded
from tests.unit.services.weather.sources.answers import NOW_NS, met_norway_body, open_meteo_body


def test_met_norway_tells_the_hour_that_runs() -> None:
    told = met_norway.read(met_norway_body(symbol="lightsleet", rain_mm=1.2, fog=80.0), NOW_NS)
    assert told.air_c == Interval(-0.5, 3.5)
    assert told.rain_mm_h == told.snow_mm_h == pytest.approx((0.0, 3.6))
    assert told.visibility_m == Interval(50.0, 1000.0)
    assert told.gust_mps is not None
    assert told.gust_mps.high > 13.0
    assert told.confidence <= SURE, "a forecast only warns"
    assert told.stamp_ns == NOW_NS - 3600 * NS, "as old as its model run"


def test_met_norway_names_snow_and_rain_by_the_symbol() -> None:
    snow = met_norway.read(met_norway_body(symbol="heavysnow", rain_mm=2.0), NOW_NS)
    rain = met_norway.read(met_norway_body(symbol="rain", rain_mm=2.0), NOW_NS)
    assert (snow.rain_mm_h, rain.snow_mm_h) == (Interval(0.0, 0.0), Interval(0.0, 0.0))
    assert snow.snow_mm_h == rain.rain_mm_h == Interval(0.0, 6.0)


def test_open_meteo_tells_the_hour_that_runs() -> None:
    told = open_meteo.read(open_meteo_body(rain=[0.0, 0.8, 9.0], snowfall=[0.0, 0.7, 0.0]), NOW_NS)
    assert told.rain_mm_h == pytest.approx((0.0, 3.6)), "rain and showers of the hour that ends next, times three"
    assert told.snow_mm_h == pytest.approx((0.0, 3.0)), "7 cm are 10 mm of water"
    assert told.visibility_m == Interval(4000.0, 8000.0)
    assert told.humidity == pytest.approx((0.82, 1.0))
    assert clean(told) == told, "within the limits of a sane source"


@pytest.mark.parametrize("word", ["NaN", "Infinity", "-Infinity", "1e999", "null"])
def test_one_number_that_is_none_leaves_the_others_known(word: str) -> None:
    told = open_meteo.read(open_meteo_body().replace(b"8000.0", word.encode()), NOW_NS)
    assert told.visibility_m is None
    assert told.air_c == pytest.approx((0.4, 4.4))
    told = met_norway.read(met_norway_body(air_c=12.25).replace(b"12.25", word.encode()), NOW_NS)
    assert told.air_c is None
    assert told.humidity is not None


@pytest.mark.parametrize(
    ("report", "field", "expected"),
    [
        ("EDDB 211150Z 24012G25KT 0800 -FZRA FG OVC002 M01/M02 Q1008", "visibility_m", Interval(400.0, 800.0)),
        ("EDDB 211150Z 24012KT 9999 +SHRA BKN020 08/06 Q1008", "rain_mm_h", Interval(10.0, 50.0)),
        ("EDDB 211150Z 24012KT 3000 -RASN BKN020 01/00 Q1008", "snow_mm_h", Interval(0.1, 1.0)),
        ("EDDB 211150Z 24012KT 9999 RADZ BKN020 08/06 Q1008", "rain_mm_h", Interval(2.5, 10.0)),
        ("EDDB 211150Z 24012KT 9999 +DZRA BKN020 08/06 Q1008", "rain_mm_h", Interval(10.0, 50.0)),
        ("EDDB 211150Z 24012KT 9999 +RA -DZ BKN020 08/06 Q1008", "rain_mm_h", Interval(10.0, 50.0)),
        ("EDDB 211150Z 24012KT 9999 RAPLSN BKN020 01/00 Q1008", "snow_mm_h", Interval(1.0, 2.5)),
        ("EDDB 211150Z 24012KT 9999 NSC 08/06 Q1008", "rain_mm_h", Interval(0.0, 0.0)),
        ("EDDB 211150Z 24012KT 9999 NSC M08/M09 Q1008", "air_c", Interval(-10.0, -6.0)),
    ],
)
def test_an_airfield_s_report_is_read(report: str, field: str, expected: Interval) -> None:
    assert getattr(metar.read(report.encode(), NOW_NS), field) == expected


FALLS = st.lists(st.sampled_from(["RA", "DZ", "SN", "PL", "SG"]), min_size=1, max_size=3, unique=True)


def fall(codes: list[str], intensity: str) -> tuple[float, float]:
    """The most of rain and of snow."""
    told = metar.read(f"EDDB 211150Z 24012KT 9999 {intensity}{''.join(codes)} BKN020 01/00 Q1008".encode(), NOW_NS)
    assert told.rain_mm_h is not None
    assert told.snow_mm_h is not None
    return told.rain_mm_h.high, told.snow_mm_h.high


@given(FALLS, st.sampled_from(["-", "", "+"]), st.data())
def test_one_more_thing_that_falls_never_makes_less_fall(codes: list[str], intensity: str, data: st.DataObject) -> None:
    rain, snow = fall(codes, intensity)
    fewer = [each for each in codes if data.draw(st.booleans())] or codes[:1]
    assert fall(fewer, intensity)[0] <= rain
    assert fall(fewer, intensity)[1] <= snow


def test_a_report_of_last_month_s_last_day_is_of_yesterday() -> None:
    midnight_ns = int(datetime(2026, 12, 1, 0, 10, tzinfo=UTC).timestamp()) * NS
    told = metar.read(b"EDDB 302350Z 24012KT 9999 NSC 08/06 Q1008", midnight_ns)
    assert midnight_ns - told.stamp_ns == 20 * 60 * NS


def _changed(body: bytes, *path: str | int, value: Any) -> bytes:
    answer = json.loads(body)
    inner = answer
    for key in path[:-1]:
        inner = inner[key]
    inner[path[-1]] = value
    return json.dumps(answer).encode()


@pytest.mark.parametrize(
    ("body", "says"),
    [
        (b"<html>", "it is a page, not JSON"),
        (b"", "it is empty"),
        (b'{"properties": ', "it is no JSON"),
        (b'{"properties": {"meta": {"units": {"air_temperature": "\xff"}}}}', "utf-8"),
        (b"{}", "missing required field `properties`"),
        (_changed(met_norway_body(), "properties", "meta", "units", value={"air_temperature": "kelvin"}), "'kelvin', not in 'celsius'"),
        (_changed(met_norway_body(), "properties", "timeseries", value=[]), "none of its 0 hours is the present one"),
        (_changed(met_norway_body(), "properties", "timeseries", value="x"), r"`array`, got `str` - at `\$.properties.timeseries`"),
    ],
)  # fmt: skip
def test_an_answer_that_cannot_be_used_says_why(body: bytes, says: str) -> None:
    with pytest.raises(UnusableAnswer, match=says):
        met_norway.read(body, NOW_NS)


def test_open_meteo_s_refusal_is_told() -> None:
    with pytest.raises(UnusableAnswer, match="Latitude must be in range"):
        open_meteo.read(b'{"error": true, "reason": "Latitude must be in range of -90 to 90"}', NOW_NS)


def test_open_meteo_s_list_of_one_place_is_read_and_one_of_several_refused() -> None:
    body = open_meteo_body()
    assert open_meteo.read(b"[" + body + b"]", NOW_NS) == open_meteo.read(body, NOW_NS)
    with pytest.raises(UnusableAnswer, match="it answers for 2 places: ask for one latitude and longitude"):
        open_meteo.read(b"[" + body + b"," + body + b"]", NOW_NS)
    with pytest.raises(UnusableAnswer, match="it answers for 0 places"):
        open_meteo.read(b"[]", NOW_NS)


def test_old_answers_say_nothing_of_now() -> None:
    later_ns = NOW_NS + 48 * 3600 * NS
    for read, body in ((met_norway.read, met_norway_body()), (open_meteo.read, open_meteo_body())):
        with pytest.raises(UnusableAnswer, match="is the present one"):
            read(body, later_ns)
    with pytest.raises(UnusableAnswer, match="h from now"):
        metar.read(b"EDDB 211150Z 24012KT 9999 NSC 08/06 Q1008", later_ns)


@given(st.binary(max_size=400), st.sampled_from([met_norway.read, open_meteo.read, metar.read]))
def test_no_bytes_do_more_than_be_unusable(body: bytes, read: Any) -> None:
    with pytest.raises(UnusableAnswer):
        read(body, NOW_NS)


@given(st.text(alphabet="EDBR0123456789ZKTQMSNA/-+ VCFGOUP", max_size=80))
def test_no_report_does_more_than_be_unusable(tail: str) -> None:
    try:
        told = metar.read(b"EDDB 211150Z " + tail.encode(), NOW_NS)
    except UnusableAnswer:
        return
    assert told.confidence <= SURE


def test_no_more_than_a_kilometre_is_told_of_where_the_car_is() -> None:
    place = rounded(Place(52.520817, 13.409419))
    for each in (met_norway.met_norway(), open_meteo.open_meteo()):
        assert "52.52&" in each.address(place)
        assert "13.41" in each.address(place)


@pytest.mark.parametrize(
    ("name", "field"),
    [
        ("air_temperature", "air_c"),
        ("wind_speed", "wind_mps"),
        ("wind_speed_of_gust", "gust_mps"),
        ("precipitation_amount", "rain_mm_h"),
    ],
)
@pytest.mark.parametrize("unit", ["kelvin", "undefined"])
def test_a_quantity_in_another_unit_is_unknown_and_the_others_count(name: str, field: str, unit: str) -> None:
    body = met_norway_body(symbol="rain", rain_mm=1.2)
    sound = met_norway.read(body, NOW_NS)
    told = met_norway.read(_changed(body, "properties", "meta", "units", name, value=unit), NOW_NS)
    assert getattr(sound, field) is not None
    assert getattr(told, field) is None
    others = (
        {"air_c", "wind_mps", "gust_mps", "rain_mm_h", "snow_mm_h"}
        - {field}
        - ({"snow_mm_h"} if "rain" in field else set())
    )
    assert all(getattr(told, each) == getattr(sound, each) for each in others)


@pytest.mark.parametrize("broken", ["n/a", None, ["n/a"] * 3, [None] * 3, [True] * 3, []])
def test_a_quantity_that_cannot_be_read_is_unknown_and_the_others_count(broken: Any) -> None:
    body = open_meteo_body(rain=[0.0, 5.0, 0.0], snowfall=[0.0, 0.0, 0.0])
    body = _changed(
        _changed(body, "hourly_units", "visibility", value="undefined"), "hourly", "visibility", value=broken
    )
    told = open_meteo.read(body, NOW_NS)
    assert told.visibility_m is None
    assert told.rain_mm_h is not None
    assert told.rain_mm_h.high >= 15.0


def report(time: str, words: str) -> str:
    return f"METAR EDDB 21{time}Z 24012KT {words}"


SNOW = report("1120", "0800 +SN VV002 M01/M02 Q1008")
BLIND = report("1150", "//// // ////// ///// Q////").replace("EDDB 211150Z", "EDDB 211150Z AUTO")


@pytest.mark.parametrize(
    "lines",
    [
        ["METAR EDDB 211150Z NIL=", SNOW],
        [SNOW, "METAR EDDB 211150Z NIL="],
        [BLIND, SNOW],
        [SNOW, report("1150", "")],
        [report("1050", "9999 NSC 08/06 Q1008"), SNOW],
        ["TAF EDDB 211130Z 2112/2218 24012KT CAVOK=", SNOW + "="],
        [SNOW, "EDDB 211130Z 2112/2218 24012KT CAVOK"],
        [SNOW, "EDDB 211130Z AMD 2112/2218 24012KT CAVOK"],
        [SNOW, "EDDB 211130Z 211218 24012KT 9999 NSC"],
        [SNOW, "EDDB 211130Z 24012KT 9999 NSC TX03/2114Z"],
        ["TAF EDDF 211100Z 2111/2211 CAVOK=", "EDDB 211130Z 2112/2218 24012KT CAVOK=", SNOW],
        ["2026/11/21 11:20", SNOW.replace("+SN", "\n     +SN"), "not a report"],
        [report("1120", "9999 NSC 08/06 Q1008"), SNOW.replace("METAR", "METAR COR")],
        [report("1120", "9999 NSC 08/06 Q1008").replace("2111", "2211"), SNOW],
        [report("1120", "9999 NSC 08/06 Q1008"), SNOW.replace("METAR", "SPECI")],
        [report("1120", "9999 NSC 08/06 Q1008").replace("METAR", "SPECI"), SNOW.replace("1120Z", "1120Z CCA")],
    ],
)
def test_the_newest_report_that_says_something_counts(lines: list[str]) -> None:
    told = metar.read("\n".join(lines).encode(), NOW_NS)
    assert told.snow_mm_h == Interval(2.5, 10.0)
    assert told.visibility_m == Interval(400.0, 800.0)


def test_reports_that_say_nothing_was_observed_are_no_good_weather() -> None:
    with pytest.raises(
        UnusableAnswer, match=r"no report that can be read: METAR EDDB 211120Z NIL: nothing was observed"
    ):
        metar.read(b"METAR EDDB 211150Z NIL=\nMETAR EDDB 211120Z NIL=", NOW_NS)
    told = metar.read(BLIND.encode(), NOW_NS)
    assert (told.rain_mm_h, told.snow_mm_h, told.visibility_m) == (None, None, None)


def test_a_forecast_without_its_name_is_no_report() -> None:
    with pytest.raises(UnusableAnswer, match=r"EDDB 211130Z 2112/2218 24012KT CAVOK: a forecast \(TAF\), not a report"):
        metar.read(b"EDDB 211130Z 2112/2218 24012KT CAVOK=", NOW_NS)


@pytest.mark.parametrize(
    ("words", "field", "expected"),
    [
        ("9999 -FZRA BKN011 ///// Q0988", "road", "ice"),
        ("9999 FZDZ BKN011 08/06 Q0988", "road", "ice"),
        ("9999 FZUP BKN011 ///// Q0988", "road", "ice"),
        ("9999 NSC ///// Q0988 REFZRA", "road", "ice"),
        ("0300 FZFG VV001 ///// Q0988", "road", "frost"),
        ("9999 RA BKN011 ///// Q0988", "road", None),
        ("9999 UP BKN011 ///// Q0988", "snow_mm_h", Interval(1.0, 2.5)),
        ("9999 UP BKN011 ///// Q0988", "rain_mm_h", Interval(2.5, 10.0)),
        ("9999 VCSH BKN011 ///// Q0988", "rain_mm_h", Interval(0.0, 2.5)),
        ("9999 // BKN011 08/06 Q0988", "rain_mm_h", None),
        ("4000 0800N FG BKN011 08/06 Q0988", "visibility_m", Interval(400.0, 800.0)),
        ("//// RA BKN011 08/06 Q0988", "visibility_m", None),
        ("10SM CLR 08/06 A2992 RMK AO1 PWINO", "rain_mm_h", None),
        ("-SN", "snow_mm_h", Interval(0.1, 1.0)),
        ("", "rain_mm_h", None),
    ],
)
def test_of_a_reports_groups_the_one_that_warns_most_counts(words: str, field: str, expected: Any) -> None:
    assert getattr(metar.read(report("1150", words).encode(), NOW_NS), field) == expected


def test_a_sight_is_no_wind_where_the_wind_is_missing() -> None:
    told = metar.read(SNOW.replace(" 24012KT", "").encode(), NOW_NS)
    assert (told.wind_mps, told.snow_mm_h) == (None, Interval(2.5, 10.0))


@pytest.mark.parametrize("before", ["", " AUTO", " COR AUTO", " 24012", " 00KT", " 240V300", " /////KT", " 24012 KT"])
@pytest.mark.parametrize("sight", ["0800", "O800", "0800N", "0800NDV"])
def test_a_sight_behind_a_wind_that_is_missing_or_broken_is_read(before: str, sight: str) -> None:
    told = metar.read(SNOW.replace(" 24012KT 0800", f"{before} {sight}").encode(), NOW_NS)
    assert (told.wind_mps, told.visibility_m) == (None, Interval(400.0, 800.0))


NONE = Interval(0.0, 0.0)
HEAVY = Interval(10.0, 50.0)
HEAVY_SNOW = Interval(2.5, 10.0)


@pytest.mark.parametrize(
    ("words", "rain", "snow"),
    [
        ("4000 OVC005 SN M01/M02 Q1008", NONE, Interval(1.0, 2.5)),
        ("4000 OVC005 M01/M02 -SN Q1008", NONE, Interval(0.1, 1.0)),
        ("OVC005 4000 SN M01/M02 Q1008", NONE, Interval(1.0, 2.5)),
        ("4000 R25C/CLRD// SN OVC005 M01/M02 Q1008", NONE, Interval(1.0, 2.5)),
        ("9999 BLU+ SN SCT010 M01/M02 Q1008", NONE, Interval(1.0, 2.5)),
        ("4000 -RASH BKN015 22/20 Q1008", Interval(0.1, 2.5), NONE),
        ("2000 +RATSGR BKN015CB 22/20 Q1008", HEAVY, NONE),
        ("3000 TS+RA BKN015CB 22/20 Q1008", HEAVY, NONE),
        ("3000 RA-SN BKN015 01/00 Q1008", Interval(2.5, 10.0), Interval(1.0, 2.5)),
        ("3000 BRSN BKN015 M02/M03 Q1008", NONE, Interval(1.0, 2.5)),
        ("3000 SN, BKN015 M02/M03 Q1008", NONE, Interval(1.0, 2.5)),
        ("3000 ///SN BKN015 M02/M03 Q1008", None, Interval(1.0, 2.5)),
        ("3000 +VCSH BKN015 12/10 Q1008", Interval(0.0, 2.5), NONE),
        ("3000 SH BKN015 12/10 Q1008", Interval(2.5, 10.0), Interval(1.0, 2.5)),
        ("4000SN BKN015 M02/M03 Q1008", None, None),
        ("4000 SNBKN015 M02/M03 Q1008", None, None),
        ("4000 +SNX BKN015 M02/M03 Q1008", None, None),
        ("4000 -S N BKN015 M02/M03 Q1008", None, None),
        ("9999 GRN SCT010 02/01 Q1008 R/SNOCLO", NONE, NONE),
        ("9999 SCT010 02/01 Q1008 RESN TEMPO 0400 +SN", NONE, NONE),
        ("9999 SCT010 02/01 Q1008 RMK SNINCR 2/10 FZRANO TSNO", NONE, NONE),
        ("9999 TS SCT010CB 22/18 Q1008", NONE, NONE),
    ],
)
def test_what_falls_is_read_wherever_it_stands_and_is_unknown_where_it_cannot_be(
    words: str, rain: Interval | None, snow: Interval | None
) -> None:
    told = metar.read(report("1150", words).encode(), NOW_NS)
    assert (told.rain_mm_h, told.snow_mm_h) == (rain, snow)


@given(
    st.sampled_from(["RA", "+RA", "-SN", "SNRA", "FZDZ", "UP", "GS", "+RATSGR", "SN,"]), st.integers(0, 4), st.data()
)
def test_no_place_of_a_group_makes_none_fall(group: str, place: int, data: st.DataObject) -> None:
    words = data.draw(st.permutations(["4000", "R25C/CLRD//", "BKN015", "01/00", "GRN"]))
    told = metar.read(report("1150", " ".join((*words[:place], group, *words[place:], "Q1008"))).encode(), NOW_NS)
    assert any(each is None or each.high > 0.0 for each in (told.rain_mm_h, told.snow_mm_h))


@pytest.mark.parametrize("words", ["4000 BKN011 FZRA ///// Q0988", "4000 -RAFZ BKN011 ///// Q0988", "4000FZDZ Q0988"])
def test_what_freezes_makes_ice_wherever_it_stands(words: str) -> None:
    assert metar.read(report("1150", words).encode(), NOW_NS).road == "ice"


@pytest.mark.parametrize(
    ("words", "air"),
    [
        ("1/2 SM +SN FEW020 M02/M03 Q1008", Interval(-4.0, 0.0)),
        ("4000 R25C/CLRD// SN OVC005 M02/M03 Q1008", Interval(-4.0, 0.0)),
        ("4000 RESN OVC005 M02/M03 Q1008", Interval(-4.0, 0.0)),
        ("4000 WHT OVC005 M02/M03 Q1008", Interval(-4.0, 0.0)),
        ("4000 OVC005 M 02/M03 Q1008", Interval(-4.0, 0.0)),
        ("3/4 +SN FEW020 M02/M03 Q1008", None),
        ("4000 OVC005 02/05 Q1008", None),
    ],
)
def test_no_sight_is_a_temperature(words: str, air: Interval | None) -> None:
    told = metar.read(report("1150", words).encode(), NOW_NS)
    assert told.air_c == air
    assert (told.dew_point_c is None) == (air is None)


def test_a_sight_apart_from_its_unit_is_read() -> None:
    told = metar.read(report("1150", "1 1/2 SM +SN FEW020 M02/M03 Q1008").encode(), NOW_NS)
    assert told.visibility_m == pytest.approx((1207.0, 2414.0), abs=1.0)


def test_of_several_airfields_the_one_that_is_asked_counts() -> None:
    other = report("1150", "9999 NSC 08/06 Q1008").replace("EDDB", "EDDF")
    read = metar.metar("EDDB").read
    assert read(f"{other}\n{SNOW}".encode(), NOW_NS).source == "METAR EDDB"
    with pytest.raises(UnusableAnswer, match="its reports are of EDDF, not of EDDB"):
        read(other.encode(), NOW_NS)


def test_the_airfield_that_is_asked_counts_behind_many_others() -> None:
    others = [report("1150", "9999 NSC 08/06 Q1008").replace("EDDB", f"E{number:03d}") for number in range(300)]
    told = metar.metar("EDDB").read("=\n".join((*others, SNOW)).encode(), NOW_NS)
    assert (told.source, told.snow_mm_h) == ("METAR EDDB", HEAVY_SNOW)
    with pytest.raises(UnusableAnswer, match="its reports are of E000, E001, E002, E003, E004, not of EDDB"):
        metar.metar("EDDB").read("=\n".join(others).encode(), NOW_NS)


HOURS = "properties", "timeseries"


@pytest.mark.parametrize(
    ("path", "value"),
    [
        (("properties", "meta", "units"), None),
        (("properties", "meta", "units", "wind_speed_of_gust"), None),
        ((*HOURS, 1), {"time": None, "data": None}),
        ((*HOURS, 2), "x"),
        ((*HOURS, 0, "data", "next_1_hours", "summary"), None),
        ((*HOURS, 0, "data", "next_1_hours", "summary", "symbol_code"), None),
    ],
)
def test_one_part_that_cannot_be_read_takes_no_other_from_met_norway_s_answer(
    path: tuple[Any, ...], value: Any
) -> None:
    body = met_norway_body(symbol="rain", rain_mm=2.0)
    told = met_norway.read(b"\xef\xbb\xbf" + _changed(body, *path, value=value), NOW_NS)
    assert told.rain_mm_h == Interval(0.0, 6.0)
    assert told.air_c == Interval(-0.5, 3.5)


def test_what_falls_without_a_symbol_may_be_snow() -> None:
    body = met_norway_body(symbol="rain", rain_mm=2.0)
    told = met_norway.read(_changed(body, *HOURS, 0, "data", "next_1_hours", "summary", value=None), NOW_NS)
    assert told.snow_mm_h == told.rain_mm_h == Interval(0.0, 6.0)


def test_a_later_row_of_the_instant_alone_hides_no_row_that_tells_what_falls() -> None:
    answer = json.loads(met_norway_body(symbol="heavysnow", rain_mm=2.0))
    rows = answer["properties"]["timeseries"]
    rows.insert(1, {"time": rows[0]["time"], "data": {"instant": {"details": {"precipitation_rate": 7.0}}}})
    told = met_norway.read(json.dumps(answer).encode(), NOW_NS)
    assert (told.snow_mm_h, told.air_c) == (Interval(0.0, 6.0), Interval(-0.5, 3.5))
    rows[0]["data"].pop("next_1_hours")
    assert met_norway.read(json.dumps(answer).encode(), NOW_NS).snow_mm_h is None


def test_fog_that_only_the_symbol_names_is_fog() -> None:
    body = _changed(
        met_norway_body(symbol="fog"), *HOURS, 0, "data", "instant", "details", "fog_area_fraction", value=None
    )
    assert met_norway.read(body, NOW_NS).visibility_m == Interval(50.0, 1000.0)


@pytest.mark.parametrize("units", [None, {}, {"visibility": None, "rain": "mm"}])
@pytest.mark.parametrize(
    "form", [float, lambda s: datetime.fromtimestamp(s + 3600, UTC).strftime("%Y-%m-%dT%H:%M"), None]
)
def test_units_and_times_of_open_meteo_may_be_missing_or_of_another_form(units: Any, form: Any) -> None:
    body = open_meteo_body(rain=[0.0, 5.0, 0.0])
    times = [
        None if form is None and at == 0 else (form or int)(each)
        for at, each in enumerate(json.loads(body)["hourly"]["time"])
    ]
    offset = 3600 if any(isinstance(each, str) for each in times) else 0
    changed = _changed(_changed(body, "hourly_units", value=units), "hourly", "time", value=times)
    told = open_meteo.read(_changed(changed, "utc_offset_seconds", value=offset), NOW_NS)
    assert told.rain_mm_h is not None
    assert told.rain_mm_h.high >= 15.0


@pytest.mark.parametrize(
    ("rain", "showers", "falls"),
    [
        (None, 0.0, None),
        ("1.0", 0.0, None),
        (-5.0, 0.0, None),
        (0.0, None, None),
        (0.0, 0.0, Interval(0.0, 0.0)),
        (None, 2.0, Interval(0.0, 6.0)),
        (2.0, "x", Interval(0.0, 6.0)),
        (-2.0, 2.0, Interval(0.0, 6.0)),
    ],
)
def test_no_rain_is_told_only_where_rain_and_showers_are_both_known(rain: Any, showers: Any, falls: Any) -> None:
    body = _changed(open_meteo_body(), "hourly", "rain", value=[rain] * 3)
    assert open_meteo.read(_changed(body, "hourly", "showers", value=[showers] * 3), NOW_NS).rain_mm_h == falls


def test_rain_in_another_unit_beside_no_showers_is_unknown() -> None:
    body = _changed(open_meteo_body(), "hourly", "showers", value=[0.0] * 3)
    assert open_meteo.read(_changed(body, "hourly_units", "rain", value="undefined"), NOW_NS).rain_mm_h is None


def test_an_answer_without_the_quantities_that_were_asked_for_is_unusable() -> None:
    answer = json.loads(open_meteo_body())
    answer["hourly"] = {name if name == "time" else f"{name}_icon": each for name, each in answer["hourly"].items()}
    with pytest.raises(UnusableAnswer, match="hourly holds none of temperature_2m"):
        open_meteo.read(json.dumps(answer).encode(), NOW_NS)


@pytest.mark.parametrize(
    ("words", "falls"),
    [("9999 DRSN BKN020", 0.0), ("2000 BLSN BKN020", 0.0), ("3000 -SN DRSN BKN020", 1.0), ("3000 SN BKN020", 2.5)],
)
def test_snow_that_drifts_fell_before(words: str, falls: float) -> None:
    told = metar.read(report("1150", f"{words} M03/M05 Q1008").encode(), NOW_NS)
    assert told.snow_mm_h is not None
    assert told.snow_mm_h.high == falls


def test_a_wind_that_never_blows_is_none() -> None:
    blown = report("1150", "0300 FG BKN001 02/02 Q1008").replace("24012KT", "240300G400MPS")
    told = metar.read(blown.encode(), NOW_NS)
    assert (told.wind_mps, told.gust_mps) == (None, None)
    told = metar.read(report("1150", "O300 FG BKN001 02/02 Q1008").encode(), NOW_NS)
    assert told.wind_mps == pytest.approx((3.09, 8.21), abs=0.01), "a sight that is written with a letter O is no wind"


def test_what_a_program_writes_for_a_missing_value_is_unknown() -> None:
    assert provider.shower(-5.0) is None
    assert provider.sight(-1.0) is None
    assert provider.gusts(-999.0) is None
    assert provider.around(999.0, 1.0) is None
    assert provider.around(-12.0, 1.0) == Interval(-13.0, -11.0)


@pytest.mark.parametrize("percent", [-999.0, -0.1, 100.1, 120.0, 999.0])
def test_a_humidity_that_no_air_has_is_unknown(percent: float) -> None:
    assert provider.share(percent) is None
    body = _changed(open_meteo_body(), "hourly", "relative_humidity_2m", value=[percent] * 3)
    assert open_meteo.read(body, NOW_NS).humidity is None


@given(st.one_of(st.none(), st.floats(allow_nan=False, allow_infinity=False)))
def test_no_interval_of_a_service_is_upside_down(value: float | None) -> None:
    found = [each(value) for each in (provider.share, provider.shower, provider.sight, provider.gusts)]
    assert all(each is None or each.low <= each.high for each in (*found, provider.around(value, provider.AIR_K)))
