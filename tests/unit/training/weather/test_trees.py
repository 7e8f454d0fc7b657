"""Trees written as a graph say what they said when they were grown."""

from pathlib import Path

import numpy as np
import pytest

from services.perception.detect.loading import open_session

ensemble = pytest.importorskip("sklearn.ensemble", reason="the extra train brings scikit-learn")


def test_the_graph_says_what_the_trees_said(tmp_path: Path) -> None:
    pytest.importorskip("onnx")
    from training.weather.train import told
    from training.weather.trees import write_trees

    rng = np.random.default_rng(3)
    numbers = rng.normal(size=(400, 6)).astype(np.float32)
    sums = numbers[:, 0] + numbers[:, 1] * numbers[:, 2]
    heads = {
        "yes": ensemble.HistGradientBoostingClassifier(max_iter=12, random_state=0).fit(numbers, sums > 0.3),
        "low": ensemble.HistGradientBoostingRegressor(loss="quantile", quantile=0.1, max_iter=12).fit(numbers, sums),
    }
    write_trees(tmp_path / "trees.onnx", heads, 6)
    fresh = rng.normal(size=(300, 6)).astype(np.float32)
    graph = open_session(tmp_path / "trees.onnx", 1).run(None, {"features": fresh})[0]
    for column, expected in enumerate(told(heads, fresh).values()):
        assert graph[:, column] == pytest.approx(expected, abs=1e-4)
