"""Average precision by hand-made detections, and what is ignored."""

from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from drivemcp.paths import data
from services.perception.detect.detection import Detection
from services.perception.detect.loading import load_detector
from services.simulator.render import RendererUnavailable
from training.dataset.shards import CLASSES, Frames, load_frames, render_stage, write_shard
from training.detector.scores import Tally, average_precision, best_floor, run, tally

CAR = CLASSES.index("vehicle")


def frames(*rows: tuple[float, float, float, float, float, float]) -> Frames:
    objects: NDArray[np.float32] = np.array(rows, np.float32).reshape(-1, 6)
    return Frames([np.zeros((36, 64, 3), np.uint8)], [objects], [{}])


def found(x0: float, y0: float, x1: float, y1: float, score: float) -> Detection:
    return Detection(x0_px=x0, y0_px=y0, x1_px=x1, y1_px=y1, kind="vehicle", score=score)


def test_a_perfect_detector_has_precision_one() -> None:
    result = tally([[found(0, 0, 40, 30, 0.9)]], frames((CAR, 0, 0, 40, 30, 1.0)), "vehicle")
    assert average_precision(result) == pytest.approx(1.0)


def test_a_false_alarm_above_the_hit_halves_it_and_below_costs_nothing() -> None:
    truth = frames((CAR, 0, 0, 40, 30, 1.0))
    hit = found(0, 0, 40, 30, 0.5)
    assert average_precision(tally([[hit, found(200, 0, 240, 30, 0.9)]], truth, "vehicle")) == pytest.approx(0.5)
    assert average_precision(tally([[hit, found(200, 0, 240, 30, 0.1)]], truth, "vehicle")) == pytest.approx(1.0)


def test_one_object_counts_once() -> None:
    result = tally([[found(0, 0, 40, 30, 0.9), found(1, 0, 41, 30, 0.8)]], frames((CAR, 0, 0, 40, 30, 1.0)), "vehicle")
    assert result.right.tolist() == [True, False]


def test_a_missed_object_limits_the_recall() -> None:
    truth = frames((CAR, 0, 0, 40, 30, 1.0), (CAR, 100, 0, 140, 30, 1.0))
    assert average_precision(tally([[found(0, 0, 40, 30, 0.9)]], truth, "vehicle")) == pytest.approx(0.5)


@pytest.mark.parametrize("row", [(CAR, 0, 0, 30, 11, 1.0), (CAR, 0, 0, 40, 30, 0.4)])
def test_small_and_hidden_objects_neither_count_as_missed_nor_as_mistakes(row: tuple[float, ...]) -> None:
    _, x0, y0, x1, y1, visible = row
    result = tally([[found(x0, y0, x1, y1, 0.9)]], frames((CAR, x0, y0, x1, y1, visible)), "vehicle")
    assert result.objects == 0
    assert len(result.scores) == 0


def test_another_class_is_no_hit() -> None:
    result = tally([[found(0, 0, 40, 30, 0.9)]], frames((CLASSES.index("sign"), 0, 0, 40, 30, 1.0)), "vehicle")
    assert result.right.tolist() == [False]


def test_the_floor_lies_where_hits_and_false_alarms_part() -> None:
    scores = np.array([0.9, 0.8, 0.45, 0.3, 0.25, 0.2])
    result = Tally(scores, np.array([True, True, True, False, False, False]), 3)
    assert best_floor(result) == pytest.approx(0.45)


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
    boxes = run(load_detector(data("models/detector.onnx")), near)
    for kind, share in (("vehicle", 0.7), ("sign", 0.6)):
        result = tally(boxes, near, kind)  # type: ignore[arg-type]
        assert result.objects >= 5, kind
        assert result.right.sum() >= share * result.objects, kind


def _only_large(rows: NDArray[np.float32]) -> NDArray[np.float32]:
    """Objects below 24 px count as hidden, so that they are ignored; signs from 16 px."""
    tall = rows[:, 4] - rows[:, 2]
    least = np.where(rows[:, 0] == CLASSES.index("sign"), 16.0, 24.0)
    changed = rows.copy()
    changed[tall < least, 5] = 0.0
    return changed
