"""A plate belongs to the sign right above it."""

from services.drivelm.reading.crops import Region
from services.drivelm.reading.plates import KNOWN, below, ring, sharpened, split

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


def test_the_number_comes_from_the_closer_look() -> None:
    whole = (("zone:20", 0.7), ("zone:30", 0.25), ("other", 0.05))
    out = dict(sharpened(whole, (("limit:30", 0.9), ("limit:80", 0.1))))
    assert out["zone:30"] > 0.94
    assert "zone:20" not in out
    assert out["other"] == 0.05


def test_what_is_no_zone_stays_what_it_is() -> None:
    whole = (("limit:50", 0.9), ("other", 0.1))
    assert sharpened(whole, (("limit:30", 1.0),)) == whole


def test_an_unclear_or_absent_closer_look_leaves_the_number_open() -> None:
    whole = (("zone:30", 0.9), ("zone:20", 0.1))
    for closer in ((), (("other", 0.9), ("limit:20", 0.1)), (("limit:80", 0.99),)):
        out = dict(sharpened(whole, closer))
        assert out.keys() == KNOWN
        assert all(share == 1 / len(KNOWN) for share in out.values())


def test_the_ring_lies_in_the_upper_middle_of_the_sign() -> None:
    assert ring(Region(0, 0, 100, 100)) == Region(18, 8, 82, 71)
