"""Two second looks in one file say the mean of what each says."""

from pathlib import Path

import numpy as np
import onnx
import torch

from services.perception.detect.loading import open_session
from training.second_look.mean import mean
from training.second_look.net import SIDE_PX, LookNet
from training.second_look.train import export


def test_two_looks_in_one_file_say_the_mean_of_both(tmp_path: Path) -> None:
    rng = np.random.default_rng(1)
    asked = {
        "pictures": rng.integers(0, 255, (3, SIDE_PX, SIDE_PX, 3), np.uint8),
        "sizes": rng.uniform(0.1, 0.5, (3, 2)).astype(np.float32),
    }
    said = []
    for seed in (1, 2):
        torch.manual_seed(seed)
        export(LookNet().eval(), tmp_path / f"{seed}.onnx")
        said.append(open_session(tmp_path / f"{seed}.onnx", 1).run(["odds", "sides"], asked))
    onnx.save(mean(onnx.load(tmp_path / "1.onnx"), onnx.load(tmp_path / "2.onnx")), tmp_path / "both.onnx")
    both = open_session(tmp_path / "both.onnx", 1).run(["odds", "sides"], asked)
    for told, one, other in zip(both, *said, strict=True):
        np.testing.assert_allclose(told, (one + other) / 2, atol=1e-4)
    assert abs(said[0][0] - said[1][0]).max() > 1e-3
