"""The detector in eight bits: it sees what the network sees that it was made from, on every processor alike."""

import json
import shutil
from pathlib import Path

import numpy as np
import onnx
from onnx import numpy_helper

from drivemcp.paths import data
from services.perception.detect.detection import Detection, overlaps
from services.perception.detect.detector import DetectorOptions
from services.perception.detect.loading import load_detector
from training.dataset.shards import Frames
from training.detector.int8 import FLOAT, origin, quantise
from training.detector.probabilities import score_at

SURE = 0.6
SEEN = 0.5
"""Told by the other network too, or found by it more likely than not, where the card's floor is higher."""


def of_the_float_one(folder: Path) -> Path:
    """The float network under the shipped one's card, so that floors and curves are the same."""
    shutil.copytree(data("models"), folder, dirs_exist_ok=True)
    return Path(shutil.copy(folder / FLOAT, folder / "detector.onnx"))


def lonely(ours: list[Detection], theirs: list[Detection]) -> list[Detection]:
    """Of ours the sure ones that nothing of theirs lies on."""

    def on(each: Detection, other: Detection) -> bool:
        edges = [np.array([[d.x0_px, d.y0_px, d.x1_px, d.y1_px]], np.float32) for d in (each, other)]
        return each.kind == other.kind and float(overlaps(*edges)[0, 0]) > 0.5

    return [each for each in ours if each.score > SURE and not any(on(each, other) for other in theirs)]


def test_what_is_surely_seen_in_one_is_seen_in_the_other(frames: Frames, tmp_path: Path) -> None:
    card = json.loads(data("models/detector.json").read_text(encoding="utf-8"))
    told = card["floors"].items()
    low = DetectorOptions(floors={kind: min(floor, score_at(SEEN, card["calibration"][kind])) for kind, floor in told})
    shipped, exact = load_detector(data("models/detector.onnx"), low), load_detector(of_the_float_one(tmp_path), low)
    seen = 0
    for picture in frames.pictures:
        for closer in (False, True):
            ours, theirs = (detector.detect(picture, closer=closer) for detector in (shipped, exact))
            assert lonely(ours, theirs) == []
            assert lonely(theirs, ours) == []
            seen += len(ours)
    assert seen > 10, "there must be something to see"


def test_the_card_names_the_network_that_it_was_made_from() -> None:
    card = json.loads(data("models/detector.json").read_text(encoding="utf-8"))
    assert card["eight_bits"] == origin(data("models") / FLOAT)


def test_weights_leave_a_bit_free_lest_some_processors_overflow() -> None:
    graph = onnx.load(str(data("models/detector.onnx"))).graph
    weights = [numpy_helper.to_array(each) for each in graph.initializer if each.data_type == onnx.TensorProto.INT8]
    kernels = [each for each in weights if each.ndim == 4]
    assert len(kernels) > 30
    assert max(int(np.abs(each.astype(int)).max()) for each in kernels) <= 64


def test_a_network_made_anew_takes_pictures_of_any_size_and_keeps_its_last_layers(
    frames: Frames, tmp_path: Path
) -> None:
    out = tmp_path / "detector.onnx"
    quantise(data("models") / FLOAT, out, frames)
    out.with_suffix(".json").write_text(json.dumps({}), encoding="utf-8")
    assert out.stat().st_size < (data("models") / FLOAT).stat().st_size / 3
    assert load_detector(out).detect(np.full((200, 300, 3), 110, np.uint8), closer=True) == []
    quantised = {
        name for node in onnx.load(str(out)).graph.node if node.op_type == "QuantizeLinear" for name in node.input
    }
    assert "/heat/Conv_output_0" not in quantised
