"""Every way in which CAN programs, receivers and spreadsheets write a time of day is read. Other text gives None."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from drivemcp.files.time_of_day import second_of_day


@pytest.mark.parametrize(
    ("text", "second"),
    [
        ("10:00:00", 36_000.0), ("10:00", 36_000.0), ("9:05:01.25", 32_701.25), ("9:05:01,25", 32_701.25), ("9:05:01:250", 32_701.25),
        ("12:00:00 am", 0.0), ("12:30 p.m.", 45_000.0), ("01.05.2026 10:00:00", 36_000.0), ("Thu May 1 10:00:00 2026", 36_000.0),
        ("2026-05-01T10:00:00+02:00", 36_000.0), ("10:00:00 CEST", 36_000.0), ("23:59:60", 86_400.0), (" 00:00:00.5 ", 0.5),
        ("Fri May  1 10:00:00.125 am 2026", 36_000.125),
    ],
)  # fmt: skip
def test_a_time_of_day_is_seconds_since_midnight(text: str, second: float) -> None:
    assert second_of_day(text) == pytest.approx(second)


@pytest.mark.parametrize("text", ["", "24:00:00", "10:60", "10:00:61", "10", "noon", "10:00:00 and more", "110:00:00"])
def test_what_no_clock_shows_is_none(text: str) -> None:
    assert second_of_day(text) is None


@given(st.text(max_size=40))
def test_no_text_gives_more_than_a_day(text: str) -> None:
    second = second_of_day(text)
    assert second is None or 0.0 <= second < 86_401.0
