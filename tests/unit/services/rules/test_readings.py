"""Sign codes taken apart."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from services.rules.readings import MAX_LENGTH, Reading, hours_of, parse_reading, within_hours


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
    ("text", "hours"), [("22-6 h", (22.0, 6.0)), ("plate:time:16 - 18", (16.0, 18.0)), ("when?", None), ("99-98", None)]
)
def test_hours_on_a_plate(text: str, hours: tuple[float, float] | None) -> None:
    assert hours_of(text) == hours


@pytest.mark.parametrize(("at", "inside"), [(23.0, True), (3.0, True), (6.0, False), (12.0, False), (22.0, True)])
def test_hours_may_run_over_midnight(at: float, inside: bool) -> None:
    assert within_hours((22.0, 6.0), at) is inside


def test_no_time_counts_as_within() -> None:
    assert within_hours((9.0, 10.0), float("nan"))
