"""Scores of our detector as probabilities, by its card."""

import json
import math
import shutil
from pathlib import Path

import pytest

from drivemcp.paths import data
from services.perception.detector import Picture
from services.perception.loading import load_detector


def with_curve(folder: Path, slope: float, offset: float) -> Path:
    path = folder / "detector.onnx"
    shutil.copy(data("models/detector.onnx"), path)
    card = json.loads(data("models/detector.json").read_text(encoding="utf-8"))
    card["calibration"] = {kind: [slope, offset] for kind in card["classes"]}
    path.with_suffix(".json").write_text(json.dumps(card), encoding="utf-8")
    return path


def test_the_cards_curve_bends_scores_and_moves_no_box(street: Picture, tmp_path: Path) -> None:
    plain = load_detector(with_curve(tmp_path, 1.0, 0.0)).detect(street)
    bent = load_detector(with_curve(tmp_path, 2.0, 0.5)).detect(street)
    assert [(each.kind, each.x0_px, each.y1_px) for each in plain] == [
        (each.kind, each.x0_px, each.y1_px) for each in bent
    ]
    for before, after in zip(plain, bent, strict=True):
        odds = math.log(before.score / (1 - before.score))
        assert after.score == pytest.approx(1 / (1 + math.exp(-(2.0 * odds + 0.5))), abs=1e-3)
