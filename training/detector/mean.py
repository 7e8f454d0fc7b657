"""The mean of two trained detectors, weight by weight.

`python -m training detector.mean BEFORE AFTER --cache DIR` writes `models/detector-float.onnx` and its eight-bit form.
AFTER is a network (`detector-float.onnx`, its card `detector.json` beside it) that was trained on from BEFORE, briefly and on
pictures of another kind. It finds what is new in them and has lost a little of the rest. The mean has both (Wortsman et al. 2022).
`python -m training detector.train --only-measure ...` then chooses its floors and measures it.
"""

from __future__ import annotations

import argparse
import hashlib
import json
import sys
from pathlib import Path
from typing import Any

import numpy as np
import onnx
from numpy.typing import NDArray
from onnx import numpy_helper

from drivemcp.errors import UserError
from drivemcp.paths import data
from training.dataset.shards import load_frames
from training.detector.exported import convolutions
from training.detector.int8 import FLOAT, origin, quantise

MEAN_OF = "mean_of"
OF_A_RUN = ("train_frames", "steps", "minutes", "seed", "recipe", "command")


def mean(before: onnx.ModelProto, after: onnx.ModelProto, share: float = 0.5) -> onnx.ModelProto:
    """A network of the later one's graph with the mean of both one's convolutions, `share` of it the later one's. Raises UserError
    where their weights do not match."""
    out = onnx.ModelProto()
    out.CopyFrom(after)
    earlier, later = _weights(before, "BEFORE"), _weights(after, "AFTER")
    if [each.shape for each in earlier] != [each.shape for each in later]:
        raise UserError("the two networks are of different shapes; AFTER must have begun as BEFORE (--start)")
    places = ((node, place) for node in out.graph.node if node.op_type == "Conv" for place in (1, 2))
    for one, other, (node, place) in zip(earlier, later, places, strict=True):
        mixed = ((1 - share) * one + share * other).astype(other.dtype)
        node.input[place] = f"mean/{node.name}/{place}"
        out.graph.initializer.append(numpy_helper.from_array(mixed, node.input[place]))
    asked = {name for node in out.graph.node for name in node.input}
    for unused in [each for each in out.graph.initializer if each.name not in asked]:
        out.graph.initializer.remove(unused)
    return out


def _weights(model: onnx.ModelProto, name: str) -> list[NDArray[np.floating]]:
    return [each for pair in convolutions(model, name) for each in pair]


def card_of(before: Path, after: Path, exported: Path, share: float = 0.5) -> dict[str, Any]:
    """The later run's card, with what it says of a run for each of the two; of what is a mean itself, its own two."""
    cards = [json.loads((path.parent / "detector.json").read_text(encoding="utf-8")) for path in (before, after)]
    made = [
        {key: card[key] for key in ((MEAN_OF,) if MEAN_OF in card else OF_A_RUN)}
        | {"sha256": hashlib.sha256(path.read_bytes()).hexdigest()}
        for card, path in zip(cards, (before, after), strict=True)
    ]
    kept = {key: value for key, value in cards[1].items() if key not in (*OF_A_RUN, MEAN_OF)}
    return kept | {MEAN_OF: made, "share_of_the_later": share, "eight_bits": origin(exported)}


def main() -> None:
    """Average, and make the eight-bit form."""
    parser = argparse.ArgumentParser(prog="python -m training detector.mean")
    parser.add_argument("before", type=Path)
    parser.add_argument("after", type=Path)
    parser.add_argument("--cache", type=Path, required=True, help="folder of shards with the split train")
    parser.add_argument("--frames", type=int, default=600, help="training pictures to draw ranges from at most")
    parser.add_argument("--share", type=float, default=0.5, help="of the later one")
    parser.add_argument("--out", type=Path, default=data("models/detector.onnx"))
    flags = parser.parse_args()
    exported = flags.out.with_name(FLOAT)
    onnx.save(mean(onnx.load(flags.before), onnx.load(flags.after), flags.share), exported)
    frames = load_frames(flags.cache, "train")
    spread = frames.picked(range(0, len(frames), max(1, len(frames) // flags.frames)))
    quantise(exported, flags.out, spread)
    card = card_of(flags.before, flags.after, exported, flags.share) | {
        "sha256": hashlib.sha256(flags.out.read_bytes()).hexdigest()
    }
    flags.out.with_suffix(".json").write_text(json.dumps(card, indent=1) + "\n", encoding="utf-8")
    sys.stdout.write(f"{flags.out}: {flags.out.stat().st_size / 1e3:.0f} kB\n")


if __name__ == "__main__":
    main()
