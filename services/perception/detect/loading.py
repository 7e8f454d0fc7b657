"""Opens a detector model: which kind it is, its outputs tell.

| outputs | kind | picture |
|---|---|---|
| `heat` and `sides_px` | our own centre-point net | uint8 RGB |
| one, (1, cells, 85), boxes as offsets in cells | YOLOX as its publisher exports it | BGR 0..255 |
| one, (1, cells, 85), boxes in pixels | YOLOX decoded in the graph | BGR 0..255 |
| one, (1, 3 x cells, 85) | YOLOv5 style | RGB 0..1 |
| one, (1, 84, cells) | YOLOv8 style | RGB 0..1 |

`cells` are the places at strides 8, 16 and 32. 85 is a box, an objectness and COCO's 80 classes; 84 has no objectness. Offsets
and pixels are distinguished by running the model once on a grey picture: centres in pixels reach across it, offsets do not.
Models with their own suppression, other classes or several outputs are refused.
"""

from __future__ import annotations

import hashlib
import json
from pathlib import Path
from typing import Any

import numpy as np

from drivemcp import inference
from drivemcp.inference import CPU
from services.perception.detect.centre_point import CentreDetector
from services.perception.detect.coco import (
    COCO_CLASSES,
    YOLO_V5,
    YOLO_V8,
    YOLOX,
    YOLOX_DECODED,
    CocoDetector,
    Layout,
    cells,
)
from services.perception.detect.detection import FloatArray
from services.perception.detect.detector import Detector, DetectorError, DetectorOptions
from services.perception.detect.second_look import SecondLook

FREE_SIDE_PX = 640
"""The side of the picture given to a model that takes any."""
SIDES_PX = (32, 2048)


def load_detector(path: Path, options: DetectorOptions | None = None) -> Detector:
    """The detector in an ONNX file; its outputs tell which kind it is. Raises DetectorError naming the file.

    A `.json` file beside it may hold `classes` and `floors` (our own detector writes both), and name a `second_look`.
    """
    options = options or DetectorOptions()
    session = open_session(path, options.threads, options.providers)
    outputs = {output.name: output.shape for output in session.get_outputs()}
    card = _card(path)
    if {"heat", "sides_px"} <= outputs.keys():
        if options.threads > 1 and not isinstance(session.get_inputs()[0].shape[1], int):
            # A net for any size looks twice, side by side, each time on half of the threads.
            session = open_session(path, options.threads // 2, options.providers)
        second = _second_look(path, card, options.providers)
        return CentreDetector(session, card, options, name=path.stem, second=second)
    side_px = _square_side(session)
    if len(outputs) != 1 or side_px is None:
        raise DetectorError(f"{path} is no detector that we know: its outputs are {outputs}")
    layout = _layout(_on_grey(session, side_px, path), side_px)
    if layout is None:
        raise DetectorError(f"{path} is no COCO-style detector that we know: its outputs are {outputs}")
    return CocoDetector(session, options, name=path.stem, layout=layout, side_px=side_px)


def digest(path: Path) -> str:
    """The first 12 hex digits of the SHA-256 of a detector's network, and of the one that its card names."""
    beside = _named_beside(path, _card(path))
    content = [each.read_bytes() for each in (path, beside) if each is not None]
    return hashlib.sha256(b"".join(content)).hexdigest()[:12]


def _named_beside(path: Path, card: dict[str, Any]) -> Path | None:
    return path.parent / Path(str(card["second_look"])).name if "second_look" in card else None


def _second_look(path: Path, card: dict[str, Any], providers: tuple[str, ...]) -> SecondLook | None:
    """The network beside the detector that its card names, to be weighed as that network's own card says."""
    beside = _named_beside(path, card)
    if beside is None:
        return None
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


def _on_grey(session: Any, side_px: int, path: Path) -> FloatArray:
    from onnxruntime.capi import onnxruntime_pybind11_state as problems

    grey = np.full((1, 3, side_px, side_px), 0.45, np.float32)
    try:
        output: FloatArray = np.asarray(session.run(None, {session.get_inputs()[0].name: grey})[0])
    except (problems.Fail, problems.InvalidArgument, problems.RuntimeException) as error:
        raise DetectorError(f"{path} does not run on a picture of {side_px} pixels: {str(error)[:200]}") from None
    return output


def _layout(output: FloatArray, side_px: int) -> Layout | None:
    """The layout of a model's output for a grey picture; None: an unknown layout."""
    places, plain, with_objectness = cells(side_px), 4 + COCO_CLASSES, 5 + COCO_CLASSES
    if output.shape == (1, places, with_objectness):
        return YOLOX_DECODED if np.ptp(output[0, :, :2]) > side_px / 2 else YOLOX
    if output.shape == (1, 3 * places, with_objectness):
        return YOLO_V5
    return YOLO_V8 if output.shape == (1, plain, places) else None


def open_session(path: Path, threads: int, providers: tuple[str, ...] = CPU) -> Any:
    """An ONNX Runtime session. Raises DetectorError naming the file, ConfigError where a provider does not start."""
    from onnxruntime.capi import onnxruntime_pybind11_state as problems

    if not path.is_file():
        raise DetectorError(f"no detector model at {path}; name one with --set detector=FILE.onnx")
    try:
        return inference.open_session(path, threads, providers, spinning=False)
    except (problems.Fail, problems.InvalidProtobuf, problems.InvalidGraph, problems.RuntimeException) as error:
        raise DetectorError(f"{path} is no model that ONNX Runtime can load: {str(error)[:200]}") from None


def _card(path: Path) -> dict[str, Any]:
    beside = path.with_suffix(".json")
    if not beside.is_file():
        return {}
    try:
        card = json.loads(beside.read_text(encoding="utf-8"))
    except ValueError as error:
        raise DetectorError(f"{beside} is no valid JSON: {error}") from None
    if not isinstance(card, dict):
        raise DetectorError(f"{beside} must hold an object")
    return card
