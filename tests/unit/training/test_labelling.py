"""Boxes from a picture of ids."""

import numpy as np
import pytest

from training.labelling import inside_share, visible_boxes


def test_boxes_enclose_exactly_the_pixels_of_each_id() -> None:
    ids = np.zeros((10, 20), dtype=np.uint32)
    ids[2:5, 3:9] = 7
    ids[4, 15] = 2
    assert visible_boxes(ids) == {7: ((3.0, 2.0, 9.0, 5.0), 18), 2: ((15.0, 4.0, 16.0, 5.0), 1)}


def test_an_empty_picture_has_no_boxes() -> None:
    assert visible_boxes(np.zeros((4, 4), dtype=np.uint32)) == {}


@pytest.mark.parametrize(
    ("box", "share"),
    [((0.0, 0.0, 10.0, 10.0), 1.0), ((-10.0, 0.0, 10.0, 10.0), 0.5), ((-10.0, -10.0, 0.0, 0.0), 0.0)],
)
def test_the_share_of_a_box_inside_the_picture(box: tuple[float, float, float, float], share: float) -> None:
    assert inside_share(box, 100, 100) == pytest.approx(share)
