"""Trains our detector on rendered and photographed frames and writes `models/detector.onnx` with its card `models/detector.json`.

The network as trained lies beside it as `detector-float.onnx`; what drives is its eight-bit form (`detector_int8`).

`python -m training dataset.shards` makes the frames first (splits "train" and "test" in one folder). Then
`python -m training detector.train --cache DIR --frames N --minutes M` trains, exports, and measures on "test".
Without --cache the frames are rendered here into a temporary folder. A twentieth of the training frames chooses
score floors and calibration and is not trained on. Photographs come as shards too, into the same folder
(`training.photographs.shards`). Training ends after --steps or --minutes, whichever comes first; the learning
rate falls with whichever is further, so that a run cut by time is a whole run.
"""

from __future__ import annotations

import argparse
import copy
import hashlib
import json
import math
import shlex
import sys
import tempfile
import time
import warnings
from dataclasses import dataclass
from pathlib import Path

import cv2
import torch
from torch import Tensor, nn

from services.perception.detect.detection import Detection
from services.perception.detect.detector import DetectorOptions
from services.perception.detect.loading import load_detector
from training.dataset.shards import (
    CLASSES,
    MIN_HEIGHT_PX,
    MIN_VISIBLE,
    Frames,
    load_frames,
    render_stage,
    write_shard,
)
from training.detector import probabilities
from training.detector.batches import CROPS, SOUGHT, SOUGHT_SHARE, Batch, batches
from training.detector.int8 import FLOAT, origin, quantise
from training.detector.net import DetectorNet, ExportNet, grown, sides_px
from training.detector.scores import average_precision, best_floor, run, tally
from training.detector.start import begin_with_exported
from training.photographs.sets import SETS, carded
from training.precision import has_bfloat16

HEIGHT_PX, WIDTH_PX = 384, 640
PEAK_RATE, LAST_RATE, WARM_STEPS = 2e-3, 2e-5, 150
WEIGHT_DECAY = 1e-4
SIDES_WEIGHT = 3.0
AVERAGE_DECAY = 0.998
BEGUN = "begun-float.onnx"
"""The network that a run began with, beside its state: for the mean of both (`training.detector.mean`)."""
STAGE_FRAMES = 6
"""Pictures of one stage lie together in the shards."""
LEAST_CHANCE = {"vehicle": 0.3, "pedestrian": 0.05, "sign": 0.25, "light": 0.25}
"""To miss a road user or a light is worse than to see one too many: boxes are told from this probability on, and the tracker weighs them.
A sign that is missed is never read, and what is no sign the reader tells. Of photographed lights 0.69 are found from 0.4 on, 0.75 from
0.25 on, with a third more false boxes; hardly more are found below.
Vehicles from 0.2 on made more false tracks; people from 0.05 on have fewer false boxes than from 0.1 without the second look."""
TARGETS_AP50 = {"vehicle": 0.85, "pedestrian": 0.75, "sign": 0.92, "panel": 0.92, "light": 0.8}


@dataclass(frozen=True, slots=True, kw_only=True)
class Plan:
    """When a run ends, and where it keeps its state meanwhile."""

    seed: int
    steps: int
    minutes: float
    state: Path
    start: Path | None = None
    """Another run's state, whose averaged weights this one begins with as far as they fit, or an exported network."""
    peak_rate: float = PEAK_RATE


def heat_loss(logits: Tensor, heat: Tensor, mask: Tensor) -> Tensor:
    """Penalty-reduced focal loss of CornerNet and CenterNet, over the number of centres."""
    chance = torch.sigmoid(logits).clamp(1e-4, 1 - 1e-4)
    centre = heat >= 0.9999
    hit = -(((1 - chance) ** 2) * chance.log())[centre].sum()
    rest = -(((1 - heat) ** 4) * (chance**2) * (1 - chance).log() * mask)[~centre].sum()
    return (hit + rest) / centre.sum().clamp(min=1)


def sides_loss(raw: Tensor, sides: Tensor, weight: Tensor) -> Tensor:
    """One minus generalised IoU of the boxes told by each weighted cell, over the weights' sum."""
    where = weight > 0
    if not bool(where.any()):
        return raw.sum() * 0.0
    told = sides_px(raw.permute(0, 2, 3, 1)[where])
    true = sides.permute(0, 2, 3, 1)[where]
    near, far = torch.minimum(told, true), torch.maximum(told, true)
    both = (near[:, 0] + near[:, 2]) * (near[:, 1] + near[:, 3])
    hull = (far[:, 0] + far[:, 2]) * (far[:, 1] + far[:, 3])
    union = _area(told) + _area(true) - both
    overlap = both / union - (hull - union) / hull
    share = weight[where]
    return ((1 - overlap) * share).sum() / share.sum()


def _area(sides: Tensor) -> Tensor:
    return (sides[:, 0] + sides[:, 2]) * (sides[:, 1] + sides[:, 3])


def rate_at(progress: float, step: int, peak_rate: float = PEAK_RATE, warm_steps: int = WARM_STEPS) -> float:
    """The learning rate: a short warm-up, then half a cosine down."""
    warm = min(1.0, (step + 1) / warm_steps)
    return warm * (LAST_RATE + (peak_rate - LAST_RATE) * 0.5 * (1 + math.cos(math.pi * min(progress, 1.0))))


def train(frames: Frames, plan: Plan) -> tuple[DetectorNet, int]:
    """The averaged network after the run, and its steps. Continues from `plan.state` where that file exists."""
    torch.manual_seed(plan.seed)
    net = DetectorNet(len(CLASSES))
    net.to(memory_format=torch.channels_last)  # type: ignore[call-overload]
    if plan.start is not None and not plan.state.is_file():
        if plan.start.suffix == ".onnx":
            begin_with_exported(net, plan.start, batches(frames, plan.seed))
        else:
            _begin_with(net, torch.load(plan.start, weights_only=True)["average"])
        export(net, plan.state.with_name(BEGUN))
    average = copy.deepcopy(net)
    optimiser = torch.optim.AdamW(net.parameters(), lr=PEAK_RATE, weight_decay=WEIGHT_DECAY)
    step, before_s = 0, 0.0
    if plan.state.is_file():
        saved = torch.load(plan.state, weights_only=True)
        net.load_state_dict(saved["net"])
        average.load_state_dict(saved["average"])
        optimiser.load_state_dict(saved["optimiser"])
        step, before_s = saved["step"], saved["spent_s"]
    source = batches(frames, plan.seed + step)
    started, saved_at = time.monotonic() - before_s, time.monotonic()
    net.train()
    while (progress := _progress(step, time.monotonic() - started, plan)) < 1.0:
        for group in optimiser.param_groups:
            group["lr"] = rate_at(progress, step, plan.peak_rate)
        heat, sides = _learn(net, optimiser, next(source))
        follow(average, net, min(AVERAGE_DECAY, (step + 1) / (step + 10)))
        step += 1
        if step % 50 == 0:
            say(f"step {step} {time.monotonic() - started:.0f} s: heat {heat:.3f} sides {sides:.3f}")
        if time.monotonic() - saved_at > 60:
            saved_at = time.monotonic()
            _save(plan.state, net, average, optimiser, step, saved_at - started)
    _save(plan.state, net, average, optimiser, step, time.monotonic() - started)
    return average.eval(), step


def _begin_with(net: DetectorNet, weights: dict[str, Tensor]) -> None:
    """Take over what fits; what is new or wider starts afresh beside it."""
    own = net.state_dict()
    widened, taken = grown(own, weights)
    say(f"{taken} of {len(own)} tensors taken over")
    net.load_state_dict(widened)


def _progress(step: int, spent_s: float, plan: Plan) -> float:
    return max(step / plan.steps, spent_s / (plan.minutes * 60))


def _learn(net: DetectorNet, optimiser: torch.optim.Optimizer, batch: Batch) -> tuple[float, float]:
    pictures = torch.from_numpy(batch.pictures).float().contiguous(memory_format=torch.channels_last)
    goal = batch.targets
    with torch.autocast("cpu", torch.bfloat16, enabled=has_bfloat16()):
        logits, raw = net(pictures)
    heat = heat_loss(logits.float(), torch.from_numpy(goal.heat), torch.from_numpy(goal.mask))
    sides = sides_loss(raw.float(), torch.from_numpy(goal.sides), torch.from_numpy(goal.weight))
    optimiser.zero_grad(set_to_none=True)
    (heat + SIDES_WEIGHT * sides).backward()  # type: ignore[no-untyped-call]
    torch.nn.utils.clip_grad_norm_(net.parameters(), 10.0)
    optimiser.step()
    return float(heat.detach()), float(sides.detach())


def follow(average: nn.Module, net: nn.Module, decay: float) -> None:
    """Draw the averaged network's weights towards those of the trained one."""
    with torch.no_grad():
        ours, theirs = average.state_dict(), net.state_dict()
        for name, value in theirs.items():
            if value.dtype.is_floating_point:
                ours[name].lerp_(value, 1 - decay)
            else:
                ours[name].copy_(value)


def _save(
    path: Path, net: DetectorNet, average: DetectorNet, optimiser: torch.optim.Optimizer, step: int, spent_s: float
) -> None:
    state = {
        "net": net.state_dict(),
        "average": average.state_dict(),
        "optimiser": optimiser.state_dict(),
        "step": step,
        "spent_s": spent_s,
    }
    partial = path.with_suffix(".part")
    torch.save(state, partial)
    partial.replace(path)


def export(net: DetectorNet, path: Path) -> None:
    """Write the network as one ONNX file for pictures of any size, multiples of 32: the whole one, and its enlarged middle."""
    picture = torch.zeros(1, HEIGHT_PX, WIDTH_PX, 3, dtype=torch.uint8)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", DeprecationWarning)  # the newer exporter would need a further package
        torch.onnx.export(
            ExportNet(net).eval(),
            (picture,),
            str(path),
            dynamo=False,
            input_names=["picture"],
            output_names=["heat", "sides_px"],
            dynamic_axes={
                "picture": {1: "height", 2: "width"},
                "heat": {2: "rows", 3: "columns"},
                "sides_px": {2: "rows", 3: "columns"},
            },
            opset_version=17,
        )


def scores(path: Path, frames: Frames) -> dict[str, float]:
    """AP50 of each class on labelled frames."""
    found = _found(path, frames)
    return {kind: round(average_precision(tally(found, frames, kind)), 4) for kind in CLASSES}


def floors(found: list[list[Detection]], frames: Frames, curves: dict[str, tuple[float, float]]) -> dict[str, float]:
    """The score floor of each class: of road users by its curve, of others what suits these frames best."""
    chosen = {
        kind: probabilities.score_at(LEAST_CHANCE[kind], curves[kind])
        if kind in LEAST_CHANCE
        else best_floor(tally(found, frames, kind))
        for kind in CLASSES
    }
    return {kind: round(floor, 3) for kind, floor in chosen.items()}


def calibration(found: list[list[Detection]], frames: Frames) -> dict[str, tuple[float, float]]:
    """Slope and offset of each class that make its scores probabilities on these frames."""
    return {kind: probabilities.fit(tally(found, frames, kind, probabilities.THERE)) for kind in CLASSES}


def _found(path: Path, frames: Frames) -> list[list[Detection]]:
    return run(load_detector(path, DetectorOptions(score_floor=0.02, floors=dict.fromkeys(CLASSES, 0.02))), frames)


def split(frames: Frames) -> tuple[Frames, Frames]:
    """The frames to train on, and a twentieth: whole stages, spread over all that there is."""
    chosen = [index // STAGE_FRAMES % 20 == 19 for index in range(len(frames))]
    kept = [i for i, each in enumerate(chosen) if not each]
    return frames.picked(kept), frames.picked([i for i, each in enumerate(chosen) if each])


def _rendered(folder: Path, count: int) -> Path:
    """Render `count` training pictures and a sixth as many for testing into a folder."""
    from training.stages.stage import Split

    shares: tuple[tuple[Split, int], ...] = (("train", count), ("test", max(count // 6, 60)))
    renderer = None
    for split, wanted in shares:
        for seed in range((wanted + 5) // 6):
            renderer, shots = render_stage(renderer, seed, split, 3)
            write_shard(folder / f"{split}-{seed:06d}.npz", shots)
            if seed % 10 == 9:
                say(f"{split}: {(seed + 1) * 6} pictures rendered")
    return folder


def write_card(path: Path, card: dict[str, object]) -> None:
    """The model's card beside it, with the file's checksum."""
    card = card | {"sha256": hashlib.sha256(path.read_bytes()).hexdigest()}
    path.with_suffix(".json").write_text(json.dumps(card, indent=1) + "\n", encoding="utf-8")


def main() -> None:
    """Train, export, measure, and write the card."""
    parser = argparse.ArgumentParser(prog="python -m training detector.train")
    parser.add_argument("--cache", type=Path, help="folder of shards; without it frames are rendered first")
    parser.add_argument("--frames", type=int, default=2400, help="training pictures used at most")
    parser.add_argument("--minutes", type=float, default=40.0)
    parser.add_argument("--steps", type=int, default=20000)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--rate", type=float, default=PEAK_RATE, help="highest learning rate; less to train further")
    parser.add_argument("--threads", type=int, default=2)
    parser.add_argument(
        "--state", type=Path, help="where the run keeps its state; an interrupted run continues from it"
    )
    parser.add_argument("--start", type=Path, help="another run's state, or an exported network (.onnx), to begin with")
    parser.add_argument("--out", type=Path, default=Path(__file__).parents[2] / "models" / "detector.onnx")
    parser.add_argument("--only-measure", action="store_true", help="choose and measure anew for the network at --out")
    parser.add_argument("--choose", type=Path, help="with --only-measure: frames never trained on, to choose with")
    flags = parser.parse_args()
    torch.set_num_threads(flags.threads)
    cv2.setNumThreads(1)  # batches are made on a thread of their own; more would only take time from the network's
    with tempfile.TemporaryDirectory() as scratch:
        cache = flags.cache or _rendered(Path(scratch), flags.frames)
        plan = Plan(
            seed=flags.seed,
            steps=flags.steps,
            minutes=flags.minutes,
            state=flags.state or Path(scratch, "state.pt"),
            start=flags.start,
            peak_rate=flags.rate,
        )
        if flags.only_measure:
            card = json.loads(flags.out.with_suffix(".json").read_text(encoding="utf-8"))
            choosing = load_frames(flags.choose or cache, "train", flags.frames)
            measure(flags.out, card, choosing if flags.choose else split(choosing)[1], load_frames(cache, "test"))
        else:
            _make(cache, flags.frames, plan, flags.out)


def _make(cache: Path, limit: int, plan: Plan, out: Path) -> None:
    training, choosing = split(load_frames(cache, "train", limit))
    net, steps = train(training, plan)
    out.parent.mkdir(parents=True, exist_ok=True)
    export(net, out.with_name(FLOAT))
    quantise(out.with_name(FLOAT), out, training)
    used = {name for note in training.notes for name in str(note.get("set", "")).split(",")}
    card: dict[str, object] = {
        "classes": list(CLASSES),
        "ap50_target": TARGETS_AP50,
        "ignored": f"objects under {MIN_HEIGHT_PX:.0f} px high or less than {MIN_VISIBLE:.0%} visible",
        "held_out": "mesh family, font, plants, stage seeds (training.stages.stage, split test)",
        "train_frames": len(training),
        "photographs": carded([each for each in SETS if each.name in used]),
        "parameters": sum(p.numel() for p in net.parameters()),
        "started_from": plan.start and hashlib.sha256(plan.start.read_bytes()).hexdigest(),
        "steps": steps,
        "minutes": plan.minutes,
        "seed": plan.seed,
        "recipe": {
            "batches": [crops._asdict() for crops in CROPS],
            "sought": SOUGHT,
            "sought_share": SOUGHT_SHARE,
            "peak_rate": plan.peak_rate,
        },
        "command": "python -m training detector.train " + shlex.join(without_paths(sys.argv[1:])),
        "torch": torch.__version__,
        "licence": "Apache-2.0",
        "eight_bits": origin(out.with_name(FLOAT)),
    }
    measure(out, card, choosing, load_frames(cache, "test"))


def measure(out: Path, card: dict[str, object], choosing: Frames, testing: Frames) -> None:
    """Choose floors and calibration on some frames, score on others, write the card."""
    # a former network's calibration must not bend this one's scores; the networks that look again are part of what is measured
    write_card(out, {key: card[key] for key in ("classes", "second_look") if key in card})
    found = _found(out, choosing)
    measured = scores(out, testing)
    curves = calibration(found, choosing)
    chosen = {"floors": floors(found, choosing, curves), "calibration": curves}
    write_card(out, card | chosen | {"ap50_test": measured, "test_frames": len(testing)})
    say(f"{json.dumps(measured)} written to {out}")


def say(line: str) -> None:
    """Tell of progress at once."""
    sys.stdout.write(line + "\n")
    sys.stdout.flush()


def without_paths(arguments: list[str]) -> list[str]:
    """The command line as another would type it: folders by their role."""
    return ["DIR" if "/" in argument else argument for argument in arguments]


if __name__ == "__main__":
    main()
