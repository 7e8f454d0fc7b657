"""A second of a drive through renderer, LiDAR and perception, and the figures made of it."""

import itertools
from pathlib import Path

import numpy as np
import pytest

from drivemcp.paths import data
from evaluation.training.dataset import CLASSES, Frames, load_frames, render_stage, write_shard
from evaluation.training.detector_drive import Figures, count, drive, summary
from evaluation.training.detector_scores import run, tally
from services.perception.loading import load_detector
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


def test_on_unseen_stages_with_unseen_shapes_most_near_vehicles_and_signs_are_found(tmp_path: Path) -> None:
    renderer, shots = None, []
    try:
        for seed in (9001, 9002, 9003, 9004, 9005, 9006):
            renderer, new = render_stage(renderer, seed, "test", 1)
            shots += new
    except RendererUnavailable as error:
        pytest.skip(str(error))
    write_shard(tmp_path / "test-009001.npz", shots)
    frames = load_frames(tmp_path, "test")
    near = Frames(frames.pictures, [_only_large(rows) for rows in frames.objects], frames.notes)
    found = run(load_detector(data("models/detector.onnx")), near)
    for kind, share in (("vehicle", 0.7), ("sign", 0.6)):
        result = tally(found, near, kind)  # type: ignore[arg-type]
        assert result.objects >= 5, kind
        assert result.right.sum() >= share * result.objects, kind


def _only_large(rows: np.typing.NDArray[np.float32]) -> np.typing.NDArray[np.float32]:
    """Objects below 24 px count as hidden, so that they are ignored; signs from 16 px."""
    tall = rows[:, 4] - rows[:, 2]
    least = np.where(rows[:, 0] == CLASSES.index("sign"), 16.0, 24.0)
    changed = rows.copy()
    changed[tall < least, 5] = 0.0
    return changed
