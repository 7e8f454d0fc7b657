"""Opens a detector model: which kind it is, its outputs tell.

Outputs, kind and picture:

- `heat` and `sides_px`: our own centre-point net, uint8 RGB
- one, (1, cells, 85), boxes as offsets in cells: `yolox`, as its publisher exports it, BGR 0..255
- one, (1, cells, 85), boxes in pixels, scores in 0..1 for pictures in 0..255 alone: `yolox-decoded`, decoded in the graph, BGR 0..255
- one, (1, cells, 85), boxes in pixels, objectness 1 everywhere, or scores in 0..1 for pictures in 0..1 alone: `yolov6` style, RGB 0..1
- one, (1, 3 x cells, 85): `yolov5` style, RGB 0..1
- one, (1, 84, cells): `yolov8` style, RGB 0..1

`cells` are the places at strides 8, 16 and 32. 85 is a box, an objectness and COCO's 80 classes; 84 has no objectness. The model is
run on a grey picture in 0..1 and in 0..255. Centres in pixels reach across the picture, offsets do not; scores have to lie in 0..1 for the
picture that the kind wants. Where two kinds are left, the setting `perception.detector_layout` has to name one. Models with their own
suppression, other classes or several outputs are refused.
"""

from __future__ import annotations

import ast
import dataclasses
import hashlib
import json
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from drivemcp import inference
from drivemcp.files.encodings import encoding_of
from drivemcp.files.foreign import foreign
from drivemcp.inference import CPU
from proto.perception import ObjectClass
from services.perception.detect.centre_point import CentreDetector
from services.perception.detect.coco import (
    COCO,
    COCO_CLASSES,
    COCO_NAMES,
    LAYOUTS,
    CocoDetector,
    Layout,
    cells,
)
from services.perception.detect.detection import FloatArray
from services.perception.detect.detector import Detector, DetectorError, DetectorOptions
from services.perception.detect.second_look import ASKS_FROM, SecondLook

FREE_SIDE_PX = 640
"""The side of the picture given to a model that takes any."""
SIDES_PX = (32, 2048)
SEEN = 0.015
"""Of what a model makes of grey in 0..255 it makes less of grey in 0..1 only where it divides by 255 itself."""
_DIVIDED_INSIDE = ("yolov5", "yolov8")
"""Layouts of which a full scale is not asked for by `detector_layout`."""
EDGE = 1e-3
"""By which a score may leave 0..1 by rounding."""


def load_detector(path: Path, options: DetectorOptions | None = None) -> Detector:
    """The detector in an ONNX file; its outputs tell which kind it is. Raises DetectorError naming the file.

    A `.json` file beside it may hold `classes` and `floors` (our own detector writes both), and name the `second_look` of a class.
    """
    options = options or DetectorOptions()
    session = open_session(path, options.threads, options.providers)
    outputs = {output.name: output.shape for output in session.get_outputs()}
    card = _card(path)
    if {"heat", "sides_px"} <= outputs.keys():
        if options.threads > 1 and not isinstance(session.get_inputs()[0].shape[1], int):
            # A net for any size looks twice, side by side, each time on half of the threads.
            session = open_session(path, options.threads // 2, options.providers)
        second = {kind: _second_look(beside, options.providers) for kind, beside in _named_beside(path, card).items()}
        return CentreDetector(session, card, options, name=path.stem, second=second)
    side_px = _square_side(session)
    if side_px is None:
        told = "; ".join(f"{each.name} {each.type} {each.shape}" for each in session.get_inputs())
        raise DetectorError(
            f"{path} is no detector that we know: its input is {told}, not one picture tensor(float) [1, 3, side, side] with a side "
            f"of {SIDES_PX[0]} to {SIDES_PX[1]} that 32 divides; export it so"
        )
    if len(outputs) != 1:
        raise DetectorError(
            f"{path} is no detector that we know: its outputs are {outputs}, not one; export it without its own suppression"
        )
    _check_names(session, path)
    layout = _layout(session, side_px, path, options.layout)
    return CocoDetector(session, options, name=path.stem, layout=layout, side_px=side_px)


def digest(path: Path) -> str:
    """The first 12 hex digits of the SHA-256 of a detector's network, and of those that its card names."""
    content = [each.read_bytes() for each in (path, *_named_beside(path, _card(path)).values())]
    return hashlib.sha256(b"".join(content)).hexdigest()[:12]


def _named_beside(path: Path, card: dict[str, Any]) -> dict[ObjectClass, Path]:
    """The networks of the second look by class, in the classes' order."""
    named = card.get("second_look", {})
    if not isinstance(named, dict) or not named.keys() <= ASKS_FROM.keys():
        raise DetectorError(
            f"{path.with_suffix('.json')}: `second_look` must name a network for each of some classes ({', '.join(ASKS_FROM)}), as in "
            '{"pedestrian": "people.onnx"}'
        )
    return {kind: path.parent / Path(str(named[kind])).name for kind in ASKS_FROM if kind in named}


def _second_look(beside: Path, providers: tuple[str, ...]) -> SecondLook:
    """A network beside the detector, to be weighed as that network's own card says."""
    session = open_session(beside, 1, providers)
    weights = _card(beside).get("weights")
    if not isinstance(weights, list) or len(weights) != 3 or not all(isinstance(each, int | float) for each in weights):
        raise DetectorError(f"{beside.with_suffix('.json')} must hold `weights`: three numbers")
    return SecondLook(session, (weights[0], weights[1], weights[2]))


def _square_side(session: Any) -> int | None:
    """The side of the square float picture that a model takes; None where it takes something else."""
    inputs = session.get_inputs()
    if len(inputs) != 1 or inputs[0].type != "tensor(float)" or len(inputs[0].shape) != 4:
        return None
    batch, planes, height, width = (size if isinstance(size, int) else None for size in inputs[0].shape)
    side = height or width or FREE_SIDE_PX
    fits = batch in (1, None) and planes in (3, None) and height in (side, None) and width in (side, None)
    return side if fits and SIDES_PX[0] <= side <= SIDES_PX[1] and side % 32 == 0 else None


def _on_grey(session: Any, side_px: int, path: Path, full_scale: float) -> FloatArray:
    grey = np.full((1, 3, side_px, side_px), 0.45 * full_scale, np.float32)
    try:
        output: FloatArray = np.asarray(session.run(None, {session.get_inputs()[0].name: grey})[0])
    except inference.broken():
        raise DetectorError(f"{path} does not run on a picture of {side_px} pixels") from None
    return output


def _layout(session: Any, side_px: int, path: Path, wanted: str) -> Layout:
    """The layout that was named, else the one that the outputs for a grey picture tell. Raises DetectorError."""
    if wanted and wanted not in LAYOUTS:
        raise DetectorError(f"detector_layout = {wanted}: there are {', '.join(LAYOUTS)}")
    outputs = {scale: _on_grey(session, side_px, path, scale) for scale in (1.0, 255.0)}
    shape = outputs[1.0].shape
    if wanted and shape in _SHAPES[wanted](cells(side_px)):
        return LAYOUTS[wanted]
    shaped = [name for name, shapes in _SHAPES.items() if shape in shapes(cells(side_px))]
    if wanted or not shaped:
        kind = f"detector of the layout {wanted}" if wanted else "COCO-style detector"
        shapes = ", ".join(str(each) for each in _shapes_at(side_px, wanted))
        raise DetectorError(
            f"{path} is no {kind} that we know: its output has the shape {shape}, not one of {shapes}; "
            "export a model of COCO's 80 classes without its own suppression"
        )
    found = [name for name in shaped if _means(outputs[LAYOUTS[name].full_scale], name, side_px)]
    if len(found) > 1:
        choices = " or ".join(f"{name} ({_picture(LAYOUTS[name])})" for name in found)
        raise DetectorError(f"{path} may be {choices}: name one with --set perception.detector_layout=NAME")
    if not found:
        raise DetectorError(
            f"{path} has the output of {' or '.join(shaped)}, and its boxes or scores are not theirs (boxes in pixels, scores in "
            "0..1): was it exported without its last layers? If it is one, name it with --set perception.detector_layout=NAME"
        )
    _check_boxes(LAYOUTS[found[0]], outputs, path)
    if found[0] not in _DIVIDED_INSIDE or not _means(outputs[255.0], found[0], side_px):
        return LAYOUTS[found[0]]
    return _scaled(LAYOUTS[found[0]], outputs, _on_grey(session, side_px, path, 0.0))


def _check_boxes(layout: Layout, outputs: dict[float, FloatArray], path: Path) -> None:
    """That boxes in pixels are centres and sizes. Raises DetectorError for corners."""
    rows = layout.rows(outputs[layout.full_scale])
    if layout.name != LAYOUTS["yolox"].name and (rows[:, 2:4] > rows[:, :2]).all():
        raise DetectorError(
            f"{path} gives boxes as corners (x0, y0, x1, y1), not as centre and size: export it without its own suppression"
        )


def _scaled(layout: Layout, outputs: dict[float, FloatArray], black: FloatArray) -> Layout:
    """The layout with pictures in 0..255, where grey in 0..1 is as good as black: the model divides by 255 itself."""
    told, as_bytes = (float(np.abs(outputs[scale] - black).max()) for scale in (1.0, 255.0))
    return dataclasses.replace(layout, full_scale=255.0) if told < SEEN * as_bytes else layout


def _check_names(session: Any, path: Path) -> None:
    """That classes that the file names are COCO's. Raises DetectorError."""
    try:
        named = ast.literal_eval(session.get_modelmeta().custom_metadata_map.get("names", "{}"))
    except (ValueError, SyntaxError, MemoryError, RecursionError):
        return
    listed = dict(enumerate(named)) if isinstance(named, list | tuple) else named if isinstance(named, dict) else {}
    if listed and any(str(listed.get(index, "")).strip().lower() not in COCO_NAMES[index] for index in COCO):
        raise DetectorError(
            f"{path} finds other classes than COCO's 80 (its first: {', '.join(map(str, [*listed.values()][:5]))}): "
            "give a model of COCO, or one whose card is ours"
        )


_SHAPES: dict[str, Callable[[int], tuple[tuple[int, ...], ...]]] = {
    "yolox": lambda places: ((1, places, 5 + COCO_CLASSES),),
    "yolox-decoded": lambda places: ((1, places, 5 + COCO_CLASSES),),
    "yolov6": lambda places: ((1, places, 5 + COCO_CLASSES),),
    "yolov5": lambda places: ((1, 3 * places, 5 + COCO_CLASSES),),
    "yolov8": lambda places: ((1, 4 + COCO_CLASSES, places),),
}


def _shapes_at(side_px: int, wanted: str) -> tuple[tuple[int, ...], ...]:
    """The shapes of the layout that is named, else of all, for a picture of this side."""
    layouts = [_SHAPES[wanted]] if wanted else _SHAPES.values()
    return tuple(dict.fromkeys(shape for shapes in layouts for shape in shapes(cells(side_px))))


def _means(output: FloatArray, name: str, side_px: int) -> bool:
    """Whether the numbers are what this layout says: scores in 0..1, and boxes in pixels, or in cells."""
    rows = LAYOUTS[name].rows(output)
    scores = rows[:, 4:]
    if not np.isfinite(rows).all() or scores.min() < -EDGE or scores.max() > 1.0 + EDGE:
        return False
    in_pixels = np.ptp(rows[:, :2]) > side_px / 2
    without_objectness = name in ("yolov6", "yolox-decoded") and bool((np.abs(scores[:, 0] - 1.0) < EDGE).all())
    return in_pixels == (name != "yolox") and not (name == "yolox-decoded" and without_objectness)


def _picture(layout: Layout) -> str:
    return f"{'RGB' if layout.rgb else 'BGR'} 0..{layout.full_scale:g}"


def open_session(path: Path, threads: int, providers: tuple[str, ...] = CPU) -> Any:
    """An ONNX Runtime session. Raises DetectorError naming the file, ConfigError where a provider does not start."""
    if not path.is_file():
        raise DetectorError(f"no detector model at {path}; name one with --set detector=FILE.onnx")
    try:
        return inference.open_session(path, threads, providers, spinning=False)
    except inference.broken() as error:
        raise DetectorError(
            f"{path} is no model that ONNX Runtime can load: {_why(path, type(error).__name__, str(error))}"
        ) from None


def _why(path: Path, kind: str, said: str) -> str:
    """What a file is that is no model, and what to do."""
    with path.open("rb") as file:
        told = foreign(file.read(64), "model")
    if told:
        return told
    if "External data" in said or "external data" in said:
        return "its weights lie in another file, which is not beside it; put that there, or export both into one file"
    if kind in ("NotImplemented", "InvalidGraph") or re.search(r"opset|IR_VERSION|IR version", said):
        return "it has operators or a version that this ONNX Runtime does not know; export it with an older opset"
    return "it is damaged, cut short or of another format"


def _card(path: Path) -> dict[str, Any]:
    beside = path.with_suffix(".json")
    if not beside.is_file():
        return {}
    try:
        content = beside.read_bytes()
        card = json.loads(content.decode(encoding_of(content)))
    except ValueError as error:
        raise DetectorError(f"{beside} is no valid JSON: {error}") from None
    if not isinstance(card, dict):
        raise DetectorError(f"{beside} must hold an object")
    return card
