"""A closer look at the ring settles a zone's number and nothing else."""

from services.drivelm.reading.crops import Region
from services.drivelm.reading.plates import KNOWN, ring, sharpened


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
