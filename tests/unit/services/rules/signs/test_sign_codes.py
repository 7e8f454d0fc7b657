"""Sign codes taken apart."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from services.rules.signs.sign_codes import MAX_LENGTH, Reading, hours_of, parse_reading, within_hours


@pytest.mark.parametrize(
    ("text", "reading"),
    [
        ("limit:50", Reading("limit", 50.0)),
        ("end:80", Reading("limit_end", 80.0)),
        ("limit_end:80", Reading("limit_end", 80.0)),
        ("plate:when_wet:de", Reading("plate:when_wet", None, "de")),
        ("led:blank", Reading("led", None, "blank")),
        ("border:GBR", Reading("border", None, "GBR")),
        ("STOP", Reading("stop")),
        ("limit:50000", Reading("limit", None, "50000")),
        ("", Reading("")),
        ("limit:١٣٠", Reading("")),
        ("lіmit:130", Reading("")),
    ],
)
def test_codes(text: str, reading: Reading) -> None:
    assert parse_reading(text) == reading


@given(st.text(max_size=200))
def test_any_text_is_taken_apart_without_an_error(text: str) -> None:
    reading = parse_reading(text)
    assert len(reading.code) <= MAX_LENGTH + 6
    assert reading.value is None or 0 <= reading.value < 1000


@pytest.mark.parametrize(
    ("text", "hours"),
    [
        ("22-6 h", ((22.0, 6.0),)),
        ("plate:time:16 - 18", ((16.0, 18.0),)),
        ("plate:time:4-6 PM", ((16.0, 18.0),)),
        ("11-1 PM", ((11.0, 13.0),)),
        ("12 AM-6 AM", ((0.0, 6.0),)),
        ("plate:time:7:30-8:30", ((7.5, 8.5),)),
        ("7-9, 14-16 h", ((7.0, 9.0), (14.0, 16.0))),
        ("6 to 8 AM and 3 to 5 PM", ((6.0, 8.0), (15.0, 17.0))),
        ("plate:time", ()),
        ("when?", ()),
        ("99-98", ()),
        ("7:75-9", ()),
        ("Mo-Fr 7-9", ()),
        ("7-9 school days", ()),
        ("22-6 h 45", ()),
        ("13-14 PM", ()),
    ],
)
def test_hours_on_a_plate(text: str, hours: tuple[tuple[float, float], ...]) -> None:
    assert hours_of(text) == hours


@given(st.text(alphabet="0123456789:-, aApPmMhu", max_size=30))
def test_what_is_not_wholly_understood_has_no_hours(text: str) -> None:
    assert all(0 <= hour <= 24 for span in hours_of(text) for hour in span)


@pytest.mark.parametrize(("at", "inside"), [(23.0, True), (3.0, True), (6.0, False), (12.0, False), (22.0, True)])
def test_hours_may_run_over_midnight(at: float, inside: bool) -> None:
    assert within_hours((22.0, 6.0), at) is inside


def test_a_span_without_length_holds_all_day() -> None:
    assert within_hours((6.0, 6.0), 12.0)


def test_no_time_counts_as_within() -> None:
    assert within_hours((9.0, 10.0), float("nan"))
