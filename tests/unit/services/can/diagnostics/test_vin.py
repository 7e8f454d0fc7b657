"""The check digit of identification numbers."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from services.can.diagnostics.vin import SHAPE, check_digit_valid

LETTERS = "ABCDEFGHJKLMNPRSTUVWXYZ0123456789"


@pytest.mark.parametrize("vin", ["11111111111111111", "1M8GDM9AXKP042788", "5GZCZ43D13S812715"])
def test_numbers_with_a_right_digit(vin: str) -> None:
    assert check_digit_valid(vin) is True


@pytest.mark.parametrize(
    "vin", ["", "1" * 16, "1" * 18, "1M8GDM9AXKP04278I", "1m8gdm9axkp042788", "1M8GDM9AXKP04278\n"]
)
def test_what_is_no_number_has_no_digit(vin: str) -> None:
    assert check_digit_valid(vin) is None


@given(st.text(LETTERS, min_size=17, max_size=17))
def test_exactly_one_of_the_eleven_digits_is_right(vin: str) -> None:
    assert SHAPE.fullmatch(vin)
    assert sum(check_digit_valid(f"{vin[:8]}{digit}{vin[9:]}") is True for digit in "0123456789X") == 1


@given(st.text(LETTERS, min_size=17, max_size=17), st.sampled_from([place for place in range(17) if place != 8]))
def test_one_wrong_digit_is_noticed(vin: str, place: int) -> None:
    right = next(each for digit in "0123456789X" if check_digit_valid(each := f"{vin[:8]}{digit}{vin[9:]}"))
    if not right[place].isdigit():
        return
    wrong = f"{right[:place]}{(int(right[place]) + 1) % 10}{right[place + 1 :]}"
    assert check_digit_valid(wrong) is False
