"""The detector in eight bits: as good, and twice as fast on a processor.

`python -m training detector.int8 --cache DIR` makes `models/detector.onnx` anew from `models/detector-float.onnx`;
`python -m training detector.train --only-measure ...` then chooses its floors and measures it.

Weights have seven bits, one scale a channel: with eight, processors that add pairs of products in 16 bits (AVX2 without VNNI)
would overflow and see other things than ours. The last layers stay in floating point: a peak is what no neighbour
exceeds, and in eight bits neighbours are equal. At last `arranged` puts the same sums in an order that is taken faster.
"""

from __future__ import annotations

import argparse
import hashlib
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import onnx
from onnxruntime.quantization import CalibrationDataReader, QuantFormat, QuantType, quantize_static
from onnxruntime.quantization.shape_inference import quant_pre_process

from drivemcp.paths import data
from services.perception.detect.centre_point import strip, whole
from training.dataset.shards import Frames, load_frames
from training.detector.arranged import arranged

FLOAT = "detector-float.onnx"
FRAMES = 300
"""Pictures from which the ranges of the activations are taken."""
IN_EIGHT_BITS = ["Conv", "Add", "Relu", "Resize"]
IN_FLOAT = ["/heat/Conv", "/sides/Conv"]


class _Looks(CalibrationDataReader):  # type: ignore[misc]  # its package has no types
    """Pictures as the detector is given them: whole, and every second one's enlarged strip."""

    def __init__(self, frames: Frames) -> None:
        self._looks = _looks(frames)

    def get_next(self) -> dict[str, Any] | None:
        """The next input; None: no more."""
        picture = next(self._looks, None)
        return None if picture is None else {"picture": picture}


def _looks(frames: Frames) -> Iterator[Any]:
    chosen = np.random.default_rng(0).permutation(len(frames))[:FRAMES].tolist()
    for number, index in enumerate(chosen):
        picture = np.asarray(frames.pictures[index])
        yield whole(picture)[0]
        if number % 2:
            yield strip(picture)[0]


def quantise(exported: Path, out: Path, frames: Frames) -> None:
    """Write the exported network in eight bits, with ranges that these frames show."""
    with tempfile.TemporaryDirectory() as folder:
        shaped = Path(folder, "shaped.onnx")
        quant_pre_process(str(exported), str(shaped), skip_symbolic_shape=True)
        quantize_static(
            str(shaped),
            str(out),
            _Looks(frames),
            quant_format=QuantFormat.QDQ,
            activation_type=QuantType.QUInt8,
            weight_type=QuantType.QInt8,
            per_channel=True,
            reduce_range=True,
            op_types_to_quantize=IN_EIGHT_BITS,
            nodes_to_exclude=IN_FLOAT,
        )
    onnx.save(arranged(onnx.load(out)), out)


def origin(exported: Path) -> dict[str, str | int]:
    """What the card says of the eight bits: of which network they are, and from how many pictures its ranges."""
    return {"from": exported.name, "sha256": hashlib.sha256(exported.read_bytes()).hexdigest(), "pictures": FRAMES}


def main() -> None:
    """Make it anew."""
    parser = argparse.ArgumentParser(prog="python -m training detector.int8")
    parser.add_argument("--cache", type=Path, required=True, help="folder of shards with the split train")
    parser.add_argument("--out", type=Path, default=data("models/detector.onnx"))
    parser.add_argument("--frames", type=int, default=2400, help="training pictures to draw from at most")
    flags = parser.parse_args()
    quantise(data("models") / FLOAT, flags.out, load_frames(flags.cache, "train", flags.frames))
    sys.stdout.write(f"{flags.out}: {flags.out.stat().st_size / 1e3:.0f} kB\n")


if __name__ == "__main__":
    main()
