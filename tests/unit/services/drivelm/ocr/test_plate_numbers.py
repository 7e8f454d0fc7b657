"""Numbers on plates are taken in a closed grammar, in the form in which the rules understand them."""

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from services.drivelm.ocr.plate_numbers import DISTANCE, HOURS, LENGTH, PLATES_WITH_NUMBERS, number_of
from services.rules.signs.sign_codes import hours_of, parse_reading
from tests.unit.robustness.hostile import hostile, look_alikes


@pytest.mark.parametrize(
    ("text", "hours"),
    [
        ("22-6 h", (22, 6)), ("22 - 6 h", (22, 6)), ("6-18 Uhr", (6, 18)), ("22 h - 6 h", (22, 6)), ("22h-6h", (22, 6)),
        ("22–6 h", (22, 6)), ("7-19 u", (7, 19)), ("7:00-19:00", (7, 19)), ("06-20 h", (6, 20)), ("8 am - 6 pm", (8, 18)),
        ("12 AM-12 PM", (0, 12)),
    ],
)  # fmt: skip
def test_hours_are_read_as_the_rules_understand_them(text: str, hours: tuple[float, float]) -> None:
    number = number_of(HOURS, text)
    read = parse_reading(f"{HOURS}:{number}")
    assert read.code == HOURS
    assert hours_of(read.word) == (hours,)


@pytest.mark.parametrize(
    ("text", "number"),
    [
        ("200 m", "200 m"), ("200m", "200 m"), ("in 400 m", "400 m"), ("1,5 km", "1.5 km"), ("2 km", "2 km"),
        ("400 yds", "400 yds"), ("400 yards", "400 yds"), ("1/2 mile", "1/2 miles"), ("2 MILES", "2 miles"), ("500 FT", "500 ft"),
    ],
)  # fmt: skip
def test_ways_are_read_with_their_unit(text: str, number: str) -> None:
    assert number_of(DISTANCE, text) == number_of(LENGTH, text) == number
    assert number_of(HOURS, text) == ""


@pytest.mark.parametrize(
    "text",
    [
        "22-6", "226 h", "22-6 h 80", "Mo-Fr 22-6 h", "7-9 h 16-18 h", "25-6 h", "6-6 h", "24-0 h", "22:30-6 h", "22-6:30 h",
        "-6 h", "13 am - 2 pm", "At any time", "", "２２-6 h", "22-6 ｈ", "22-6 h\u200b",
        "13 km", "12 mile", "205 m", "9000 m", "0 m", "007 m", "200", "m", "200 m 300 m", "0,5 km", "2/3 mile", "1/2 km",
        "200 kn", "3O0 m", "٢٠٠ m", "200 m when wet", "limit 130",
    ],
)  # fmt: skip
def test_anything_else_stays_unread(text: str) -> None:
    assert {number_of(plate, text) for plate in PLATES_WITH_NUMBERS} == {""}


def test_other_plates_have_no_number() -> None:
    assert number_of("plate:when_wet:de", "22-6 h") == number_of("plate:end", "200 m") == ""


@settings(max_examples=300, deadline=None)
@given(hostile() | look_alikes(("22-6 h", "6-18 Uhr", "200 m", "1.5 km", "400 yds", "1/2 mile")))
def test_hostile_letters_are_read_as_nothing_but_a_small_number(text: str) -> None:
    for plate in PLATES_WITH_NUMBERS:
        number = number_of(plate, text)
        assert number == "" or (text.isascii() and len(number) <= 10)


@given(st.integers(0, 99), st.integers(0, 99))
def test_hours_are_hours_of_the_day(begin: int, end: int) -> None:
    number = number_of(HOURS, f"{begin}-{end} h")
    assert (number == "") == (max(begin, end) > 24 or begin % 24 == end % 24)
