"""Overlaps and non-maximum suppression."""

import numpy as np
import pytest

from services.perception.detect.detection import detections, overlaps, suppress

BOXES = np.array([[0, 0, 10, 10], [1, 0, 11, 10], [30, 30, 40, 40]], dtype=np.float32)


def test_a_box_overlaps_itself_fully_and_a_far_one_not_at_all() -> None:
    table = overlaps(BOXES, BOXES)
    assert table[0, 0] == pytest.approx(1.0)
    assert table[0, 1] == pytest.approx(90 / 110)
    assert table[0, 2] == 0.0


def test_of_two_overlapping_boxes_of_one_class_the_better_stays() -> None:
    kept = suppress(BOXES, np.array([0.5, 0.9, 0.4], np.float32), np.array([0, 0, 0]), 0.5)
    assert kept == [1, 2]


def test_overlapping_boxes_of_two_classes_both_stay() -> None:
    kept = suppress(BOXES, np.array([0.5, 0.9, 0.4], np.float32), np.array([0, 1, 0]), 0.5)
    assert sorted(kept) == [0, 1, 2]


def test_boxes_are_cut_at_the_pictures_edge_and_dropped_outside_it() -> None:
    found = detections(
        np.array([[-5, -5, 5, 5], [200, 10, 220, 20]], np.float32),
        np.array([0.9, 0.8], np.float32),
        ["sign", "sign"],
        (100, 50),
    )
    assert len(found) == 1
    assert (found[0].x0_px, found[0].y0_px, found[0].x1_px, found[0].y1_px) == (0, 0, 5, 5)
