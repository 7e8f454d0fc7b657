"""Opens a detector model: which kind it is, its outputs tell."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from services.perception.centre import CentreDetector
from services.perception.detector import Detector, DetectorError, DetectorOptions
from services.perception.yolox import YoloxDetector


def load_detector(path: Path, options: DetectorOptions | None = None) -> Detector:
    """The detector in an ONNX file; its outputs tell which kind it is. Raises DetectorError naming the file.

    A `.json` file beside it may hold `classes` and `floors` (our own detector writes both).
    """
    options = options or DetectorOptions()
    session = _session(path, options.threads)
    outputs = {output.name: output.shape for output in session.get_outputs()}
    card = _card(path)
    if {"heat", "sides_px"} <= outputs.keys():
        return CentreDetector(session, card, options, name=path.stem)
    shape = next(iter(outputs.values()))
    if len(outputs) == 1 and len(shape) == 3 and shape[2] == 85:
        return YoloxDetector(session, options, name=path.stem)
    raise DetectorError(f"{path} is no detector that we know: its outputs are {outputs}")


def _session(path: Path, threads: int) -> Any:
    import onnxruntime
    from onnxruntime.capi import onnxruntime_pybind11_state as problems

    if not path.is_file():
        raise DetectorError(f"no detector model at {path}; name one with --set detector=FILE.onnx")
    settings = onnxruntime.SessionOptions()
    settings.intra_op_num_threads = threads
    settings.inter_op_num_threads = 1
    settings.add_session_config_entry("session.intra_op.allow_spinning", "0")
    settings.log_severity_level = 3
    try:
        return onnxruntime.InferenceSession(str(path), settings, providers=["CPUExecutionProvider"])
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
