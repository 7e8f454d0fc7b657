"""Trains the second look at a class: `models/people.onnx`, `models/signs.onnx` or `models/lights.onnx`, with a card beside it.

`python -m training second_look.train sign --cache DIR --choose DIR2 --minutes 20` needs training pictures that the detector was not
trained on (`python -m training dataset.shards`), and others, to weigh its word beside the detector's own.
`python -m training detector.train --only-measure --choose DIR2 ...` then chooses floors and curves anew and measures both together.
"""

from __future__ import annotations

import argparse
import copy
import hashlib
import json
import shlex
import sys
import time
import warnings
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor, nn
from torch.nn import functional

from drivemcp.paths import data
from proto.perception import ObjectClass
from services.perception.detect.centre_point import CentreDetector
from services.perception.detect.detection import overlaps
from services.perception.detect.detector import Detector, DetectorOptions
from services.perception.detect.loading import open_session
from services.perception.detect.second_look import ASKS_FROM, NOTHING_WEIGHED, SecondLook
from training.bins import Floats
from training.dataset.shards import CLASSES, Frames, counted, load_frames, shards
from training.detector.probabilities import THERE, logit
from training.detector.scores import run
from training.detector.train import AVERAGE_DECAY, follow, rate_at, say, split, without_paths
from training.photographs.sets import SETS, carded
from training.precision import has_bfloat16
from training.regression import logistic
from training.second_look.crops import LEARNS_FROM, ROOM, Batch, Crops, batches, collected, mark
from training.second_look.net import SIDE_PX, WIDTHS, ExportLook, LookNet, Widths

PEAK_RATE, WARM_STEPS, WEIGHT_DECAY = 2e-3, 200, 2e-2
BATCH = 128
EDGES_WEIGHT = 4.0
"""Of the edges' distances in shares of the square, beside one minus their generalised IoU."""
RIDGE = 1e-2
GAIN = 0.3
"""One sigma of the logarithm of how much brighter a crop is made: signs stand in shadow, and in pictures of dusk."""
FILES: dict[ObjectClass, str] = {"pedestrian": "people.onnx", "sign": "signs.onnx", "light": "lights.onnx"}


def looked_at(pictures: NDArray[np.uint8], looks: Tensor, mirrored: Tensor) -> Tensor:
    """Crops (N, H, H, 3) as squares (N, 3, 64, 64) in 0..255: moved, scaled, mirrored where `mirrored` (N) is 1, relit."""
    crops = torch.from_numpy(pictures).permute(0, 3, 1, 2).float()
    count = len(crops)
    move = torch.zeros(count, 2, 3)
    move[:, 0, 0] = looks[:, 2] / ROOM * (1 - 2 * mirrored)
    move[:, 1, 1] = looks[:, 2] / ROOM
    move[:, :, 2] = looks[:, :2] * 2 / ROOM
    places = functional.affine_grid(move, [count, 3, SIDE_PX, SIDE_PX], align_corners=False)
    seen = functional.grid_sample(crops, places, align_corners=False, padding_mode="border")
    gain = torch.exp(torch.randn(count, 1, 1, 1) * GAIN) * torch.exp(torch.randn(count, 3, 1, 1) * 0.04)
    return (seen * gain + torch.randn(count, 1, 1, 1) * 5).clamp(0, 255)


def loss_of(odds: Tensor, told: Tensor, batch: Batch, sides: Tensor) -> tuple[Tensor, Tensor]:
    """Cross entropy of what counts as of the class or as none, and the loss of the edges where they are known."""
    kinds, known = torch.from_numpy(batch.kinds), torch.from_numpy(batch.known)
    judged = kinds >= 0
    verdict = functional.binary_cross_entropy_with_logits(odds[judged], kinds[judged])
    if not bool(known.any()):
        return verdict, told.sum() * 0.0
    off = (told[known] - sides[known]).abs().mean()
    return verdict, (1 - _overlap(told[known], sides[known])).mean() + EDGES_WEIGHT * off


def _overlap(ours: Tensor, theirs: Tensor) -> Tensor:
    """Generalised IoU of boxes by their edges (N, 4)."""
    low, high = torch.maximum(ours[:, :2], theirs[:, :2]), torch.minimum(ours[:, 2:], theirs[:, 2:])
    both = (high - low).clamp(min=0).prod(1)
    union = _area(ours) + _area(theirs) - both
    hull = (torch.maximum(ours[:, 2:], theirs[:, 2:]) - torch.minimum(ours[:, :2], theirs[:, :2])).prod(1)
    return both / union - (hull - union) / hull


def _area(box: Tensor) -> Tensor:
    return (box[:, 2:] - box[:, :2]).clamp(min=1e-4).prod(1)


def _mirrored(sides: Tensor, mirrored: Tensor) -> Tensor:
    other = torch.stack([-sides[:, 2], sides[:, 1], -sides[:, 0], sides[:, 3]], 1)
    return torch.where(mirrored[:, None] > 0, other, sides)


def train(crops: Crops, widths: Widths, minutes: float, seed: int) -> tuple[LookNet, int]:
    """The averaged network after so many minutes, and its steps."""
    torch.manual_seed(seed)
    net = LookNet(widths)
    net.to(memory_format=torch.channels_last)  # type: ignore[call-overload]
    average = copy.deepcopy(net)
    optimiser = torch.optim.AdamW(net.parameters(), lr=PEAK_RATE, weight_decay=WEIGHT_DECAY)
    source, started, step = batches(crops, BATCH, seed), time.monotonic(), 0
    lost: list[tuple[float, float]] = []
    net.train()
    while (progress := (time.monotonic() - started) / (60 * minutes)) < 1.0:
        for group in optimiser.param_groups:
            group["lr"] = rate_at(progress, step, PEAK_RATE, WARM_STEPS)
        lost.append(_learn(net, optimiser, next(source)))
        follow(average, net, min(AVERAGE_DECAY, (step + 1) / (step + 10)))
        step += 1
        if step % 200 == 0:
            verdict, edges = np.mean(lost[-200:], axis=0)
            say(f"step {step} {time.monotonic() - started:.0f} s: verdict {verdict:.4f} edges {edges:.4f}")
    return average.eval(), step


def _learn(net: LookNet, optimiser: torch.optim.Optimizer, batch: Batch) -> tuple[float, float]:
    mirrored = (torch.rand(len(batch.kinds)) < 0.5).float()
    with torch.autocast("cpu", torch.bfloat16, enabled=has_bfloat16()):
        seen = looked_at(batch.pictures, torch.from_numpy(batch.looks), mirrored)
        odds, told = net(seen.contiguous(memory_format=torch.channels_last), torch.from_numpy(batch.sizes))
    sides = _mirrored(torch.from_numpy(batch.sides), mirrored)
    verdict, edges = loss_of(odds.float(), told.float(), batch, sides)
    optimiser.zero_grad(set_to_none=True)
    (verdict + edges).backward()  # type: ignore[no-untyped-call]
    nn.utils.clip_grad_norm_(net.parameters(), 5.0)
    optimiser.step()
    return float(verdict.detach()), float(edges.detach())


def export(net: LookNet, path: Path) -> None:
    """One ONNX file for any number of squares."""
    dynamic = {name: {0: "count"} for name in ("pictures", "sizes", "odds", "sides")}
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        torch.onnx.export(
            ExportLook(net).eval(),
            (torch.zeros(2, SIDE_PX, SIDE_PX, 3, dtype=torch.uint8), torch.full((2, 2), 0.3)),
            str(path),
            dynamo=False,
            input_names=["pictures", "sizes"],
            output_names=["odds", "sides"],
            dynamic_axes=dynamic,
            opset_version=17,
        )


def detector_alone(path: Path, kind: ObjectClass, asks_from: float | None = None) -> Detector:
    """The detector without second looks: raw scores of a class from `asks_from` on, else from where its second look asks."""
    options = DetectorOptions(score_floor=1.1, floors={kind: ASKS_FROM[kind] if asks_from is None else asks_from})
    return CentreDetector(open_session(path, 1), {}, options, name=path.stem)


def weights(odds: Floats, own: Floats, right: NDArray[np.bool_]) -> tuple[float, float, float]:
    """What its log-odds, the detector's own and a constant weigh (logistic regression): for candidates N and whether they are right."""
    design = np.stack([odds, own, np.ones(len(odds))], axis=1)
    found = logistic(design, right.astype(np.float64), np.full(3, RIDGE))
    new, old, offset = (round(float(each), 4) for each in found)
    return new, old, offset


def candidates(
    frames: Frames, detector: Detector, look: SecondLook, kind: ObjectClass
) -> tuple[Floats, Floats, NDArray[np.bool_]]:
    """Of boxes asked about, but for those on things that count neither way: log-odds told, the detector's own, whether they are right."""
    odds, own, right = [], [], []
    for found, picture, rows in zip(run(detector, frames), frames.pictures, frames.objects, strict=True):
        if not found:
            continue
        boxes = np.array([each.box_px for each in found], np.float32)
        told, edges = look.told(picture, boxes)
        mine = rows[rows[:, 0] == CLASSES.index(kind)]
        overlap = overlaps(edges, mine[:, 1:5])
        there = overlap[:, counted(mine)].max(axis=1, initial=0.0) >= THERE
        judged = there | (overlap.max(axis=1, initial=0.0) < THERE)
        odds.append(told[judged])
        own.append(logit(np.array([each.score for each in found]))[judged])
        right.append(there[judged])
    return np.concatenate(odds), np.concatenate(own), np.concatenate(right)


def weighed(flags: argparse.Namespace, frames: Frames) -> dict[str, Any]:
    """What the two words weigh, by frames that neither network was trained on, and the detector for which they do."""
    look = SecondLook(open_session(flags.out, 1), NOTHING_WEIGHED)
    return {
        "weights": weights(*candidates(frames, detector_alone(flags.detector, flags.kind), look, flags.kind)),
        "weighed_for": hashlib.sha256(flags.detector.read_bytes()).hexdigest(),
    }


def _card(flags: argparse.Namespace, out: Path, crops: Crops, steps: int) -> dict[str, Any]:
    return {
        "input": f"uint8 N x {SIDE_PX} x {SIDE_PX} x 3, RGB; N x 2: the box's size as a share of the side",
        "output": f"log-odds of a {flags.kind} (N); edges (N x 4) from the middle as shares of the side",
        **weighed(flags, load_frames(flags.choose, "train")),
        "crops": {
            "of the class": int((crops.kinds == 1).sum()),
            "of none": int((crops.kinds == 0).sum()),
            "of the class in photographs": int(((crops.kinds == 1) & crops.real).sum()),
            "of none in photographs": int(((crops.kinds == 0) & crops.real).sum()),
        },
        "asked_by": hashlib.sha256(flags.detector.read_bytes()).hexdigest(),
        "steps": steps,
        "minutes": flags.minutes,
        "seed": flags.seed,
        "command": "python -m training second_look.train " + shlex.join(without_paths(sys.argv[1:])),
        "torch": torch.__version__,
        "licence": "Apache-2.0; trained on pictures rendered by this project and on the photographs named",
        "photographs": carded(SETS if crops.real.any() else ()),
        "sha256": hashlib.sha256(out.read_bytes()).hexdigest(),
        "size_bytes": out.stat().st_size,
    }


def main() -> None:
    """Collect, train, export, weigh, and write the card."""
    parser = argparse.ArgumentParser(prog="python -m training second_look.train", description=__doc__)
    parser.add_argument("kind", choices=tuple(FILES), help="the class looked at")
    what = parser.add_mutually_exclusive_group(required=True)
    what.add_argument("--cache", type=Path, help="training shards that the detector never saw")
    what.add_argument(
        "--only-weigh", action="store_true",
        help="weigh the network at --out anew for another detector, by the twentieth of --choose that its training left out",
    )  # fmt: skip
    parser.add_argument(
        "--choose", type=Path, required=True, help="others, to weigh the two words with; left out of --cache"
    )
    parser.add_argument("--minutes", type=float, default=20.0)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--threads", type=int, default=2)
    parser.add_argument("--detector", type=Path, default=data("models/detector.onnx"))
    parser.add_argument("--out", type=Path, help="models/ and the class's own file without it")
    flags = parser.parse_args()
    flags.out = flags.out or Path(__file__).parents[2] / "models" / FILES[flags.kind]
    torch.set_num_threads(flags.threads)
    cv2.setNumThreads(1)
    if flags.only_weigh:
        card = json.loads(flags.out.with_suffix(".json").read_text(encoding="utf-8"))
        card |= weighed(flags, split(load_frames(flags.choose, "train"))[1])
    else:
        card = _made(flags)
    flags.out.with_suffix(".json").write_text(json.dumps(card, indent=1) + "\n", encoding="utf-8")
    say(f"weights {card['weights']}, {flags.out}")


def _made(flags: argparse.Namespace) -> dict[str, Any]:
    detector, choosing = detector_alone(flags.detector, flags.kind, LEARNS_FROM), load_frames(flags.choose, "train")
    marks = {mark(rows, note) for rows, note in zip(choosing.objects, choosing.notes, strict=True)}
    crops = collected(shards(flags.cache, "train"), detector, flags.kind, flags.seed, but=marks)
    say(f"{len(crops)} crops, {int((crops.kinds == 1).sum())} of the class")
    net, steps = train(crops, WIDTHS[flags.kind], flags.minutes, flags.seed)
    export(net, flags.out)
    return _card(flags, flags.out, crops, steps)


if __name__ == "__main__":
    main()
