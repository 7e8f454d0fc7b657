"""The measure of plates counts what is believed right, wrong and not at all."""

import numpy as np

from services.drivelm.reading.crops import Picture
from training.reader.plates import plates, table


def test_what_nobody_reads_is_unread() -> None:
    found = table(6, (), lambda image: ("", 0.0), 0.0, 1)
    assert found["plates"] == 6
    assert {row["unread"] for row in found["approaches"].values()} == {6}
    assert set().union(*found["single"].values()) == {"unread"}


def test_one_text_for_all_plates_is_believed_wrong() -> None:
    def same(image: Picture) -> tuple[str, float]:
        return "3-4 h", 1.0

    rows = table(30, (), same, 0.0, 1)["approaches"]
    assert rows["5"]["wrong"] == len(rows["5"]["wrongly"]) > 0
    assert rows["20"].get("wrong", 0) <= rows["5"]["wrong"]


def test_plates_to_be_left_unread_are_among_them() -> None:
    drawn = list(plates(60, (), np.random.default_rng(1)))
    assert 5 < sum(not plate.truth for plate in drawn) < 40
    assert all(not plate.truth for plate in drawn if "\n" in plate.text)
