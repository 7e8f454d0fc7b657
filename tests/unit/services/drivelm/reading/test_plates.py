"""A plate belongs to the sign right above it."""

from services.drivelm.reading.crops import Region
from services.drivelm.reading.plates import below, split

SIGN = Region(100, 50, 130, 80)


def test_the_nearest_box_right_below_is_the_plate() -> None:
    near, far, aside = Region(101, 82, 131, 98), Region(101, 90, 131, 106), Region(140, 82, 170, 98)
    assert below(SIGN, [far, near, aside]) == 1
    assert below(SIGN, [aside]) is None
    assert below(SIGN, []) is None


def test_a_sign_above_is_no_plate() -> None:
    assert below(SIGN, [Region(100, 15, 130, 45)]) is None


def test_a_tall_box_is_sign_and_plate_in_one() -> None:
    own, hung = split(Region(100, 50, 130, 97))
    assert own == Region(100, 50, 130, 80)
    assert hung == Region(100, 80, 130, 97)


def test_below_a_square_box_the_plate_is_looked_for_where_it_would_hang() -> None:
    own, hung = split(SIGN)
    assert own == SIGN
    assert hung.y0_px >= SIGN.y1_px
    assert hung.width_px == SIGN.width_px
