"""Scores become probabilities."""

import numpy as np
import pytest

from training.bins import binned
from training.detector.probabilities import calibrated, fit, score_at
from training.detector.scores import Tally


def drawn(slope: float, offset: float, count: int = 6000) -> Tally:
    """Boxes that are right as often as the curve says."""
    rng = np.random.default_rng(5)
    scores = rng.uniform(0.02, 0.98, count)
    right = rng.uniform(size=count) < calibrated(scores, (slope, offset))
    return Tally(scores, right, count)


def expected_error(tally: Tally, curve: tuple[float, float] = (1.0, 0.0)) -> float:
    """Over ten bins of equal width."""
    return binned(calibrated(tally.scores, curve), tally.right).error


@pytest.mark.parametrize(("slope", "offset"), [(1.0, 0.0), (1.8, -0.7), (0.6, 0.9)])
def test_the_curve_that_made_the_boxes_is_found(slope: float, offset: float) -> None:
    boxes = drawn(slope, offset)
    found = fit(boxes)
    assert found == pytest.approx((slope, offset), abs=0.15)
    assert expected_error(boxes, found) < 0.02


def test_scores_that_are_off_are_told_so_and_mended() -> None:
    boxes = drawn(2.0, -1.5)
    assert expected_error(boxes) > 0.1
    assert expected_error(boxes, fit(boxes)) < 0.03


def test_a_higher_score_stays_the_higher_one() -> None:
    curve = fit(drawn(1.5, -1.0))
    assert (np.diff(calibrated(np.linspace(0.01, 0.99, 50), curve)) > 0).all()


def test_boxes_that_teach_nothing_change_nothing() -> None:
    assert fit(Tally(np.zeros(0), np.zeros(0, bool), 3)) == (1.0, 0.0)
    assert fit(Tally(np.array([0.5, 0.6]), np.array([True, True]), 3)) == (1.0, 0.0)


@pytest.mark.parametrize("probability", [0.05, 0.2, 0.5, 0.9])
@pytest.mark.parametrize("curve", [(1.0, 0.0), (3.8, 1.4), (0.6, -0.9)])
def test_the_score_that_stands_for_a_probability_becomes_it(probability: float, curve: tuple[float, float]) -> None:
    assert calibrated(np.array([score_at(probability, curve)]), curve)[0] == pytest.approx(probability, abs=1e-3)
