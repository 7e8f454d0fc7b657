"""Our detector on a rendered picture, and models that cannot be used."""

import hashlib
import json
from pathlib import Path
from typing import cast

import numpy as np
import onnx
import pytest

from drivemcp.paths import data
from services.perception.detect.coco import CocoDetector
from services.perception.detect.detection import FloatArray
from services.perception.detect.detector import DetectorError, DetectorOptions, Picture
from services.perception.detect.loading import load_detector


def test_our_detector_finds_car_and_sign_where_they_are(street: Picture) -> None:
    found = load_detector(data("models/detector.onnx")).detect(street)
    car = next(each for each in found if each.kind == "vehicle")
    assert 250 < car.centre_px[0] < 390
    assert car.score > 0.3
    signs = [each for each in found if each.kind == "sign"]
    assert any(each.centre_px[0] > 400 and each.centre_px[1] < 180 for each in signs)


def test_a_picture_of_another_size_gives_boxes_in_its_own_pixels(street: Picture) -> None:
    large = np.ascontiguousarray(np.repeat(np.repeat(street, 2, axis=0), 2, axis=1))
    detector = load_detector(data("models/detector.onnx"))
    small_car = next(each for each in detector.detect(street) if each.kind == "vehicle")
    large_car = next(each for each in detector.detect(large) if each.kind == "vehicle")
    assert np.array(large_car.centre_px) == pytest.approx(2 * np.array(small_car.centre_px), abs=6)


def test_nothing_is_found_in_an_empty_picture() -> None:
    assert load_detector(data("models/detector.onnx")).detect(np.full((360, 640, 3), 110, np.uint8)) == []


def test_the_card_matches_the_model_and_tells_what_was_measured() -> None:
    path = data("models/detector.onnx")
    card = json.loads(path.with_suffix(".json").read_text(encoding="utf-8"))
    assert card["sha256"] == hashlib.sha256(path.read_bytes()).hexdigest()
    assert path.stat().st_size < 4_000_000
    assert set(card["ap50_test"]) == set(card["classes"])
    assert card["ap50_test"]["vehicle"] > 0.6


def test_an_absent_model_is_told_in_one_line(tmp_path: Path) -> None:
    with pytest.raises(DetectorError, match=r"no detector model at .*none\.onnx"):
        load_detector(tmp_path / "none.onnx")


def test_a_file_that_is_no_model_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "broken.onnx"
    path.write_bytes(b"no model at all")
    with pytest.raises(DetectorError, match="no model that ONNX Runtime can load"):
        load_detector(path)


def test_a_model_of_another_kind_is_refused() -> None:
    with pytest.raises(DetectorError, match="no detector that we know"):
        load_detector(data("models/reader.onnx"))


def test_an_unknown_class_in_the_card_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "detector.onnx"
    path.write_bytes(data("models/detector.onnx").read_bytes())
    path.with_suffix(".json").write_text('{"classes": ["vehicle", "unicorn"]}', encoding="utf-8")
    with pytest.raises(DetectorError, match="unknown classes"):
        load_detector(path)


def test_a_floor_in_the_options_silences_a_class(street: Picture) -> None:
    keen = load_detector(data("models/detector.onnx"))
    assert any(each.kind == "vehicle" for each in keen.detect(street))
    deaf = load_detector(data("models/detector.onnx"), DetectorOptions(floors={"vehicle": 1.1}))
    assert not any(each.kind == "vehicle" for each in deaf.detect(street))


SIDE = 64
PLACES = 84


def toy(path: Path, shape: tuple[int, ...], rows: FloatArray, full_scale: float, *, objectness: bool) -> Path:
    """A model whose boxes are `rows` and whose class 2 scores the picture's mean over its full scale."""
    picture = onnx.helper.make_tensor_value_info("images", onnx.TensorProto.FLOAT, [1, 3, SIDE, SIDE])
    found = onnx.helper.make_tensor_value_info("found", onnx.TensorProto.FLOAT, list(shape))
    weights = np.zeros((len(rows), 85 if objectness else 84), np.float32)
    weights[:, 7 if objectness else 6] = 1.0 / full_scale
    base = np.zeros_like(weights)
    base[:, :4] = rows
    if objectness:
        base[:, 4] = 1.0 if full_scale == 1.0 else np.linspace(0.1, 0.9, len(rows))
    nodes = [
        onnx.helper.make_node("ReduceMean", ["images"], ["mean"], axes=[1, 2, 3], keepdims=0),
        onnx.helper.make_node("Mul", ["weights", "mean"], ["scores"]),
        onnx.helper.make_node("Add", ["base", "scores"], ["sum"]),
        onnx.helper.make_node("Reshape", ["sum", "shape"], ["found"]),
    ]
    turned = not objectness
    given = [
        onnx.numpy_helper.from_array(weights.T.copy() if turned else weights, "weights"),
        onnx.numpy_helper.from_array(base.T.copy() if turned else base, "base"),
        onnx.numpy_helper.from_array(np.array(shape, np.int64), "shape"),
    ]
    graph = onnx.helper.make_graph(nodes, "toy", [picture], [found], given)
    model = onnx.helper.make_model(graph, opset_imports=[onnx.helper.make_opsetid("", 13)], ir_version=8)
    onnx.save(model, path)
    return path


def boxes(count: int, reach: float) -> FloatArray:
    """Centres that reach so far, and sides of 8."""
    centres = np.linspace(0.0, reach, count, dtype=np.float32)
    return np.stack([centres, centres, np.full(count, 8.0), np.full(count, 8.0)], axis=1).astype(np.float32)


WITH, WITHOUT = (1, PLACES, 85), (1, 84, PLACES)


def layout_of(path: Path, name: str = "") -> str:
    return cast(CocoDetector, load_detector(path, DetectorOptions(layout=name))).layout.name


@pytest.mark.parametrize(
    ("shape", "reach", "full_scale", "expected"),
    [
        (WITH, 60.0, 1.0, "YOLOv6"),
        (WITH, 0.9, 255.0, "YOLOX"),
        ((1, 3 * PLACES, 85), 60.0, 1.0, "YOLOv5"),
        (WITHOUT, 60.0, 1.0, "YOLOv8"),
    ],
)
def test_a_model_is_told_by_what_its_outputs_mean(
    tmp_path: Path, shape: tuple[int, ...], reach: float, full_scale: float, expected: str
) -> None:
    rows = boxes(shape[1] if 85 in shape else PLACES, reach)
    path = toy(tmp_path / "toy.onnx", shape, rows, full_scale, objectness=85 in shape)
    assert layout_of(path) == expected


@pytest.mark.parametrize("shape", [(1, 3 * PLACES, 85), WITHOUT])
@pytest.mark.parametrize("inside", [False, True])
def test_a_model_that_divides_by_255_itself_is_given_bytes(
    tmp_path: Path, shape: tuple[int, ...], inside: bool
) -> None:
    with_objectness = 85 in shape
    path = toy(
        tmp_path / "toy.onnx",
        shape,
        boxes(max(shape[1:]) if with_objectness else PLACES, 60.0),
        1.0,
        objectness=with_objectness,
    )
    if inside:
        divide_inside(path)
    detector = cast(CocoDetector, load_detector(path))
    assert detector.layout.full_scale == (255.0 if inside else 1.0)
    assert detector.detect(np.full((SIDE, SIDE, 3), 230, np.uint8))[0].score == pytest.approx(230 / 255, abs=0.01)


def divide_inside(path: Path) -> None:
    """Put a division of the picture by 255 before a model."""
    model = onnx.load(path)
    model.graph.initializer.append(onnx.numpy_helper.from_array(np.array(255.0, np.float32), "bytes"))
    model.graph.node[0].input[0] = "divided"
    model.graph.node.insert(0, onnx.helper.make_node("Div", ["images", "bytes"], ["divided"]))
    onnx.save(model, path)


def test_boxes_as_corners_are_refused(tmp_path: Path) -> None:
    rows = boxes(PLACES, 60.0)
    rows[:, 2:] += rows[:, :2]
    path = toy(tmp_path / "toy.onnx", WITHOUT, rows, 1.0, objectness=False)
    with pytest.raises(DetectorError, match="gives boxes as corners"):
        load_detector(path)


@pytest.mark.parametrize(
    ("names", "refused"),
    [
        ("{0: 'apple', 1: 'banana', 2: 'cherry'}", True),
        (str({**dict.fromkeys(range(80), "thing"), 0: "person", 1: "bicycle", 2: "car", 3: "motorcycle", 5: "bus", 7: "truck",
              9: "traffic light", 11: "stop sign"}), False),
        ("no names", False),
    ],
)  # fmt: skip
def test_a_model_that_names_other_classes_is_refused(tmp_path: Path, names: str, refused: bool) -> None:
    path = toy(tmp_path / "toy.onnx", WITHOUT, boxes(PLACES, 60.0), 1.0, objectness=False)
    model = onnx.load(path)
    onnx.helper.set_model_props(model, {"names": names})
    onnx.save(model, path)
    if not refused:
        assert layout_of(path) == "YOLOv8"
        return
    with pytest.raises(DetectorError, match=r"other classes than COCO's 80 \(its first: apple, banana, cherry\)"):
        load_detector(path)


def test_a_model_of_two_possible_kinds_is_asked_for(tmp_path: Path) -> None:
    path = toy(tmp_path / "toy.onnx", WITH, boxes(PLACES, 60.0), 255.0, objectness=True)
    wanted = (
        r"may be yolox-decoded \(BGR 0..255\) or yolov6 \(RGB 0..1\): name one with --set perception.detector_layout"
    )
    with pytest.raises(DetectorError, match=wanted):
        load_detector(path)
    assert layout_of(path, "yolox-decoded") == "YOLOX, decoded"
    assert layout_of(path, "yolov6") == "YOLOv6"
    with pytest.raises(DetectorError, match=r"no detector of the layout yolov8"):
        layout_of(path, "yolov8")
    with pytest.raises(DetectorError, match=r"detector_layout = yolo: there are yolox, yolox-decoded, yolov5"):
        layout_of(path, "yolo")


@pytest.mark.parametrize(("reach", "full_scale"), [(0.9, 1.0), (60.0, 0.1)])
def test_a_model_whose_numbers_are_not_those_of_its_shape_is_refused(
    tmp_path: Path, reach: float, full_scale: float
) -> None:
    path = toy(tmp_path / "toy.onnx", WITHOUT, boxes(PLACES, reach), full_scale, objectness=False)
    with pytest.raises(DetectorError, match="its boxes or scores are not theirs"):
        load_detector(path)
    assert layout_of(path, "yolov8") == "YOLOv8"


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (b"", "it is empty; was a download broken off"),
        (b"version https://git-lfs.github.com/spec/v1\n", "a pointer of Git LFS"),
        (b"<!doctype html>", "answered by a web page"),
        (b"no model at all", "damaged, cut short or of another format"),
    ],
)
def test_a_file_that_is_no_model_says_what_it_looks_like(tmp_path: Path, content: bytes, words: str) -> None:
    path = tmp_path / "broken.onnx"
    path.write_bytes(content)
    with pytest.raises(
        DetectorError, match=rf"broken\.onnx is no model that ONNX Runtime can load: .*{words}"
    ) as raised:
        load_detector(path)
    assert "\n" not in str(raised.value)


def test_a_model_with_operators_that_are_not_known_is_refused(tmp_path: Path) -> None:
    info = onnx.helper.make_tensor_value_info("x", onnx.TensorProto.FLOAT, [1])
    graph = onnx.helper.make_graph([onnx.helper.make_node("Unheard", ["x"], ["y"])], "g", [info], [])
    onnx.save(onnx.helper.make_model(graph), tmp_path / "odd.onnx")
    with pytest.raises(DetectorError, match="no model that ONNX Runtime can load"):
        load_detector(tmp_path / "odd.onnx")


@pytest.mark.parametrize(
    ("shape", "kind"),
    [([1, 3, 64, 96], "FLOAT"), ([1, 64, 64, 3], "FLOAT"), ([2, 3, 64, 64], "FLOAT"), ([1, 3, 64, 64], "FLOAT16")],
)
def test_a_model_of_another_input_is_told_its_input(tmp_path: Path, shape: list[int], kind: str) -> None:
    path = toy(tmp_path / "toy.onnx", WITHOUT, boxes(PLACES, 60.0), 1.0, objectness=False)
    made = onnx.load(path)
    made.graph.input[0].CopyFrom(onnx.helper.make_tensor_value_info("images", getattr(onnx.TensorProto, kind), shape))
    del made.graph.node[:]
    made.graph.node.append(
        onnx.helper.make_node(
            "Constant", [], ["found"], value=onnx.numpy_helper.from_array(np.zeros(WITHOUT, np.float32))
        )
    )
    onnx.save(made, path)
    with pytest.raises(
        DetectorError, match=rf"its input is images tensor\({kind.lower()}\) .*not one picture .*; export it so"
    ):
        load_detector(path)


@pytest.mark.parametrize(
    ("part", "words"), [("weights", "put that there"), ("opset", "older opset"), ("ir", "older opset")]
)
def test_a_sound_model_that_does_not_load_is_not_called_damaged(tmp_path: Path, part: str, words: str) -> None:
    path = toy(tmp_path / "toy.onnx", WITHOUT, boxes(PLACES, 60.0), 1.0, objectness=False)
    made = onnx.load(path)
    if part == "opset":
        made.opset_import[0].version = 99
    if part == "ir":
        made.ir_version = 99
    onnx.save_model(made, path, save_as_external_data=part == "weights", location="toy.data", size_threshold=0)
    (tmp_path / "toy.data").unlink(missing_ok=True)
    with pytest.raises(DetectorError, match=words):
        load_detector(path)
