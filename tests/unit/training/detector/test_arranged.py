"""The arranged detector tells what the plain one tells, to the bit."""

from pathlib import Path

import numpy as np
import onnx
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from drivemcp.paths import data
from services.perception.detect.loading import open_session
from training.dataset.shards import Frames
from training.detector import int8
from training.detector.arranged import arranged


@pytest.fixture(scope="module")
def plain(frames: Frames, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The shipped network in eight bits, as it is before it is arranged."""
    out = tmp_path_factory.mktemp("plain") / "detector.onnx"
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(int8, "arranged", lambda model: model)
        int8.quantise(data("models") / int8.FLOAT, out, frames)
    return out


def test_pictures_of_any_size_and_content_give_the_same_numbers(plain: Path) -> None:
    faster = plain.with_name("faster.onnx")
    onnx.save(arranged(onnx.load(plain)), faster)
    one, other = open_session(plain, 1), open_session(faster, 1)

    @settings(max_examples=40, deadline=None)
    @given(
        rows=st.integers(1, 6), columns=st.integers(1, 9), seed=st.integers(0, 2**32 - 1), bright=st.integers(0, 255)
    )
    def same(rows: int, columns: int, seed: int, bright: int) -> None:
        noise = np.random.default_rng(seed).integers(
            0, bright, (1, 32 * rows, 32 * columns, 3), np.uint8, endpoint=True
        )
        for before, after in zip(one.run(None, {"picture": noise}), other.run(None, {"picture": noise}), strict=True):
            np.testing.assert_array_equal(before, after)

    same()


def test_the_shipped_network_is_arranged() -> None:
    operators = {each.op_type for each in onnx.load(data("models/detector.onnx")).graph.node}
    assert "Resize" not in operators


def test_a_network_that_is_not_the_plain_one_is_refused() -> None:
    with pytest.raises(ValueError, match="nodes"):
        arranged(onnx.load(data("models/detector.onnx")))
