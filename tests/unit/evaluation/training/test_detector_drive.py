"""A second of a drive through renderer, LiDAR and perception, and the figures made of it."""

import itertools

import pytest

from drivemcp.paths import data
from evaluation.training.detector_drive import Figures, count, drive, summary
from services.simulator.render import RendererUnavailable


def test_a_drive_gives_pictures_of_both_cameras_and_figures_that_hold_together() -> None:
    figures, cameras = Figures(), []
    try:
        for look in itertools.islice(drive("urb-rain", 1, 2.0, data("models/detector.onnx")), 12):
            cameras.append(look.camera)
            count(figures, look)
    except RendererUnavailable as error:
        pytest.skip(str(error))
    assert cameras.count("front") == 8
    assert cameras.count("tele") == 4
    told = summary(figures)
    assert figures.wanted > 0
    assert 0.3 < told["road_users_tracked"] <= 1.0
    assert told["gap_error_median_m"] < 1.0
    assert told["ms_per_picture"] > 0
