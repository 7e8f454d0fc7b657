"""COCO-style detectors of every layout, named, built here as small ONNX graphs."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from services.perception.detect.coco import cells
from services.perception.detect.detector import DetectorError, DetectorOptions
from services.perception.detect.loading import load_detector

onnx = pytest.importorskip("onnx", reason="onnx builds the models of these tests (extra `train`)")
SIDE_PX = 96
CAR = 2
RED = np.zeros((48, 96, 3), np.uint8) + np.array([255, 0, 0], np.uint8)
CENTRE_PX, SIZE_PX = (20.0, 28.0), (16.0, 8.0)
"""What the models say; the picture fills the upper half of their input."""


def model(path: Path, rows: NDArray[Any], *, plane: int, divisor: float, side: int | str = SIDE_PX) -> Path:
    """A model that says `rows`, its first class or objectness column times the mean of a colour plane over `divisor`."""
    helper, kind = onnx.helper, onnx.TensorProto.FLOAT
    weights = np.zeros((1, 3, 1, 1), np.float32)
    weights[0, plane] = 2.0 / divisor
    values = {"rows": rows.astype(np.float32), "weights": weights}
    constants = [onnx.numpy_helper.from_array(value, name) for name, value in values.items()]
    scored = np.zeros_like(rows, dtype=np.float32)
    nodes = [
        helper.make_node("Mul", ["picture", "weights"], ["weighed"]),
        helper.make_node("ReduceSum", ["weighed"], ["total"], keepdims=0),
        helper.make_node("Shape", ["picture"], ["shape"]),
        helper.make_node("Cast", ["shape"], ["sizes"], to=kind),
        helper.make_node("ReduceProd", ["sizes"], ["count"], keepdims=0),
        helper.make_node("Div", ["total", "count"], ["third"]),
        helper.make_node("Mul", ["third", "three"], ["mean"]),
        helper.make_node("Mul", ["mean", "scored"], ["shown"]),
        helper.make_node("Add", ["rows", "shown"], ["output"]),
    ]
    turned = rows.shape[1] == 84
    scored[(0, 4 + CAR, 0) if turned else (0, 0, 4)] = 1.0
    constants += [
        onnx.numpy_helper.from_array(scored, "scored"),
        onnx.numpy_helper.from_array(np.array(3.0, np.float32), "three"),
    ]
    graph = helper.make_graph(
        nodes,
        "test",
        [helper.make_tensor_value_info("picture", kind, [1, 3, side, side])],
        [helper.make_tensor_value_info("output", kind, list(rows.shape))],
        constants,
    )
    onnx.save(helper.make_model(graph, opset_imports=[helper.make_opsetid("", 17)], ir_version=8), str(path))
    return path


def named(layout: str) -> DetectorOptions:
    """The option that names it."""
    names = {"x": "yolox", "decoded": "yolox-decoded", "v5": "yolov5", "v8": "yolov8"}
    return DetectorOptions(layout=names[layout])


def one_car(layout: str, side: int = SIDE_PX) -> NDArray[Any]:
    """An output with one car at CENTRE_PX; in the layouts with objectness its class is certain."""
    count = cells(side)
    if layout == "v8":
        rows = np.zeros((1, 84, count))
        rows[0, :4, 0] = (*CENTRE_PX, *SIZE_PX)
        return rows
    rows = np.zeros((1, 3 * count if layout == "v5" else count, 85))
    rows[0, 0, 5 + CAR] = 1.0
    if layout == "x":
        rows[0, 0, :4] = (CENTRE_PX[0] / 8, CENTRE_PX[1] / 8, np.log(SIZE_PX[0] / 8), np.log(SIZE_PX[1] / 8))
        return rows
    rows[0, :, :2] = np.linspace(2.0, side - 2.0, rows.shape[1])[:, None]
    rows[0, 0, :4] = (*CENTRE_PX, *SIZE_PX)
    return rows


LAYOUTS = [("x", 2, 255.0), ("decoded", 2, 255.0), ("v5", 0, 1.0), ("v8", 0, 1.0)]
"""Layout, the plane in which it expects red (BGR or RGB), and full scale."""


@pytest.mark.parametrize(("layout", "plane", "full_scale"), LAYOUTS)
def test_each_layout_gives_the_box_in_the_pictures_own_pixels(
    tmp_path: Path, layout: str, plane: int, full_scale: float
) -> None:
    detector = load_detector(
        model(tmp_path / "m.onnx", one_car(layout), plane=plane, divisor=full_scale), named(layout)
    )
    (found,) = detector.detect(RED)
    assert found.kind == "vehicle"
    assert found.centre_px == pytest.approx(CENTRE_PX, abs=0.01)
    assert (found.width_px, found.height_px) == pytest.approx(SIZE_PX, abs=0.01)
    assert found.score == pytest.approx(1.0 + 114 / 255, abs=0.01), (
        "red over the upper half, letterbox grey over the lower"
    )


@pytest.mark.parametrize(("layout", "plane", "full_scale"), LAYOUTS)
def test_colours_are_given_in_the_layouts_order(tmp_path: Path, layout: str, plane: int, full_scale: float) -> None:
    swapped = load_detector(
        model(tmp_path / "m.onnx", one_car(layout), plane=2 - plane, divisor=full_scale), named(layout)
    )
    assert all(found.score < 0.5 for found in swapped.detect(RED)), "no red is seen there, only the letterbox"


def test_a_model_that_takes_any_size_is_given_640_pixels(tmp_path: Path) -> None:
    rows = one_car("v8", side=640)
    detector = load_detector(model(tmp_path / "m.onnx", rows, plane=0, divisor=1.0, side="side"), named("v8"))
    (found,) = detector.detect(RED)
    assert found.centre_px == pytest.approx((3.0, 4.2), abs=0.01), "96 pixels became 640"


@pytest.mark.parametrize(("height_px", "width_px"), [(1, 2000), (2000, 1)])
def test_a_picture_thinner_than_a_pixel_of_the_models_input_is_looked_at(
    tmp_path: Path, height_px: int, width_px: int
) -> None:
    detector = load_detector(model(tmp_path / "m.onnx", one_car("x"), plane=0, divisor=1.0), named("x"))
    detector.detect(np.zeros((height_px, width_px, 3), np.uint8))


@pytest.mark.parametrize("shape", [(1, 84, 100), (1, 7, 6), (1, 116, 84), (84, 84), (1, 84, 188)])
def test_other_outputs_are_refused_by_name_and_shape(tmp_path: Path, shape: tuple[int, ...]) -> None:
    rows = np.zeros(shape, np.float32)
    path = tmp_path / "m.onnx"
    helper, kind = onnx.helper, onnx.TensorProto.FLOAT
    graph = helper.make_graph(
        [helper.make_node("Constant", [], ["output"], value=onnx.numpy_helper.from_array(rows))],
        "test",
        [helper.make_tensor_value_info("picture", kind, [1, 3, SIDE_PX, SIDE_PX])],
        [helper.make_tensor_value_info("output", kind, list(shape))],
    )
    onnx.save(helper.make_model(graph, opset_imports=[helper.make_opsetid("", 17)], ir_version=8), str(path))
    with pytest.raises(DetectorError, match=r"m\.onnx is no COCO-style detector that we know") as refused:
        load_detector(path)
    assert "export a model of COCO's 80 classes without its own suppression" in str(refused.value)


def test_a_model_of_another_input_is_refused(tmp_path: Path) -> None:
    path = model(tmp_path / "m.onnx", one_car("x"), plane=0, divisor=1.0, side=50)
    with pytest.raises(DetectorError, match="no detector that we know"):
        load_detector(path)
