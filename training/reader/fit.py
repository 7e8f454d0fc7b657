"""Fitting, calibrating and exporting the reader's network; the only modules here that need torch."""

import logging
import math
import time
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor, nn
from torch.nn import functional

from services.drivelm.vocabulary.classes import READER_CLASSES
from training.precision import has_bfloat16
from training.reader.net import ReaderNet, levelled

_log = logging.getLogger("reader")


Crops = tuple[NDArray[np.uint8], NDArray[np.int64]]
GREEN_FOR_RED, HIGHER = 10.0, 2.0
"""What the probability of a green lamp costs where the lamp is red, and that of a higher number on the same kind of sign,
beside the cross entropy."""


class Part(NamedTuple):
    """One kind of crops (uint8 N x 48 x 48 x 3 RGB), their class indexes, and its share of each batch."""

    crops: NDArray[np.uint8]
    labels: NDArray[np.int64]
    share: float


def fit(
    parts: Sequence[Part],
    steps: int,
    batch: int,
    seed: int,
    peak_rate: float = 3e-3,
    start: Path | None = None,
    threads: int = 1,
    minutes: float | None = None,
) -> ReaderNet:
    """Train for ``steps`` batches with one rising and falling learning rate, from nothing or from an exported network;
    ends with averaged weights. The shares of the parts sum to one. With ``minutes`` the rate follows the clock and training
    ends with it or with the steps, whichever comes first: a seed then no longer gives the same network."""
    torch.set_num_threads(threads)
    torch.manual_seed(seed)
    chance = np.random.default_rng([seed, 4])
    network = ReaderNet(len(READER_CLASSES)) if start is None else resumed(start, _batch(parts, 2000, chance)[0])
    network.to(memory_format=torch.channels_last)  # type: ignore[call-overload]
    decay = torch.optim.swa_utils.get_ema_multi_avg_fn(0.995)  # type: ignore[no-untyped-call]
    average = torch.optim.swa_utils.AveragedModel(network, multi_avg_fn=decay, use_buffers=True)
    optimiser = torch.optim.AdamW(network.parameters(), lr=peak_rate, weight_decay=0.02)
    losses, started = [], time.monotonic()
    network.train()
    for step in range(steps):
        past = step / steps if minutes is None else (time.monotonic() - started) / (60 * minutes)
        if past >= 1:
            break
        for group in optimiser.param_groups:
            group["lr"] = peak_rate * rate_share(past)
        crops, labels = _batch(parts, batch, chance)
        with torch.autocast("cpu", torch.bfloat16, enabled=has_bfloat16()):  # three fifths of the time
            scores = network(_varied(crops, chance))
        loss = loss_of(scores.float(), torch.from_numpy(labels))
        optimiser.zero_grad(set_to_none=True)
        loss.backward()  # type: ignore[no-untyped-call]
        optimiser.step()
        average.update_parameters(network)
        losses.append(float(loss.detach()))
        if step % 50 == 49:
            pace = (time.monotonic() - started) / (step + 1)
            _log.info("step %d loss %.3f (%.0f ms a step)", step + 1, float(np.mean(losses[-50:])), 1000 * pace)
    trained = average.module.eval()
    assert isinstance(trained, ReaderNet)
    return trained


RISING = 0.15


def rate_share(past: float) -> float:
    """The learning rate as a share of its peak, by the share of the training that is past: a rise, then half a cosine."""
    if past < RISING:
        return 0.04 + 0.96 * past / RISING
    return 0.5 + 0.5 * math.cos(math.pi * (past - RISING) / (1 - RISING))


def resumed(path: Path, crops: NDArray[np.uint8]) -> ReaderNet:
    """The exported network, to be trained further: its scores, with the normalisation that the export folded away
    measured again on some crops."""
    import onnx

    stored = {part.name: torch.tensor(onnx.numpy_helper.to_array(part)) for part in onnx.load(path).graph.initializer}
    network = ReaderNet(len(READER_CLASSES)).eval()
    with torch.no_grad():
        seen = levelled(torch.from_numpy(np.array(crops)).permute(0, 3, 1, 2).float())
        for name, block in network.features.named_children():
            if isinstance(block, nn.Sequential):
                weight = stored[f"network.features.{name}.0.weight"]
                _unfold(block, weight, stored[f"network.features.{name}.0.weight_bias"], seen)
            seen = block(seen)
        last = network.head[2]
        assert isinstance(last, nn.Linear)
        last.weight.copy_(stored["network.head.2.weight"])
        last.bias.copy_(stored["network.head.2.bias"])
    return network


def _unfold(block: nn.Sequential, weight: Tensor, bias: Tensor, seen: Tensor) -> None:
    """Weights of the size that training knows, and a normalisation that gives the folded convolution's values."""
    convolution, norm = block[0], block[1]
    assert isinstance(convolution, nn.Conv2d)
    assert isinstance(norm, nn.BatchNorm2d)
    assert norm.running_mean is not None
    assert norm.running_var is not None
    scale = 1 / (weight.pow(2).mean() * weight[0].numel()).sqrt()
    convolution.weight.copy_(weight * scale)
    out = convolution(seen)
    mean, spread = out.mean(dim=(0, 2, 3)), out.var(dim=(0, 2, 3), unbiased=False)
    norm.running_mean.copy_(mean)
    norm.running_var.copy_(spread)
    norm.weight.copy_((spread + norm.eps).sqrt() / scale)
    norm.bias.copy_(bias + mean / scale)


def cost_of(true: str, read: str) -> float:
    """What the probability of reading one class as another costs, beside the cross entropy."""
    if true.startswith("light:red") and read.startswith("light:green"):
        return GREEN_FOR_RED
    (kind, _, number), (read_kind, _, read_number) = true.rpartition(":"), read.rpartition(":")
    numbers = number.isdigit() and read_number.isdigit()
    return HIGHER if kind == read_kind and numbers and int(read_number) > int(number) else 0.0


_COSTS = torch.tensor([[cost_of(true, read) for read in READER_CLASSES] for true in READER_CLASSES])


def loss_of(scores: Tensor, labels: Tensor) -> Tensor:
    """Cross entropy of the scores (N x classes), and what dangerous mistakes cost beside it (`cost_of`)."""
    dangerous = (torch.softmax(scores, dim=1) * _COSTS[labels]).sum() / len(labels)
    return functional.cross_entropy(scores, labels) + dangerous


def _batch(parts: Sequence[Part], batch: int, chance: np.random.Generator) -> Crops:
    counts = [round(part.share * batch) for part in parts]
    counts[0] += batch - sum(counts)
    picked = [_picked(part, count, chance) for part, count in zip(parts, counts, strict=True)]
    return np.concatenate([each[0] for each in picked]), np.concatenate([each[1] for each in picked])


def _picked(part: Part, count: int, chance: np.random.Generator) -> Crops:
    places = np.sort(chance.integers(0, len(part.crops), count))
    return part.crops[places], part.labels[places]


def _varied(crops: NDArray[np.uint8], chance: np.random.Generator) -> Tensor:
    """Small shifts and exposure changes, different each time a crop is met again."""
    dy, dx = (int(v) for v in chance.integers(-2, 3, 2))
    moved = torch.from_numpy(np.ascontiguousarray(crops)).permute(0, 3, 1, 2).float()
    moved = functional.pad(moved, (2, 2, 2, 2), mode="replicate")[:, :, 2 + dy : 50 + dy, 2 + dx : 50 + dx]
    gain = torch.from_numpy(chance.uniform(0.8, 1.2, (len(crops), 1, 1, 1)).astype(np.float32))
    tint = torch.from_numpy(chance.uniform(0.94, 1.06, (len(crops), 3, 1, 1)).astype(np.float32))
    return (moved * gain * tint).clamp(0, 255).contiguous(memory_format=torch.channels_last)


def _scores(network: ReaderNet, crops: NDArray[np.uint8]) -> Tensor:
    with torch.no_grad():
        parts = [network(torch.from_numpy(part).permute(0, 3, 1, 2).float()) for part in np.array_split(crops, 32)]
    return torch.cat(parts)


def temperature(network: ReaderNet, crops: NDArray[np.uint8], labels: NDArray[np.int64]) -> float:
    """The divisor of the scores that makes fresh crops' probabilities honest: least cross entropy on a fine grid."""
    scores, truth = _scores(network, crops), torch.from_numpy(labels)
    grid = np.exp(np.linspace(np.log(0.4), np.log(4.0), 120))
    costs = [float(functional.cross_entropy(scores / float(value), truth)) for value in grid]
    return float(grid[int(np.argmin(costs))])


class _Calibrated(nn.Module):
    def __init__(self, network: ReaderNet, divisor: float) -> None:
        super().__init__()
        self.network, self.divisor = network, divisor

    def forward(self, crops: Tensor) -> Tensor:
        return torch.softmax(self.network(crops) / self.divisor, dim=1)


def export(network: ReaderNet, divisor: float, path: Path) -> None:
    """Write one self-contained ONNX file with a free batch size."""
    example = torch.zeros(2, 3, 48, 48)
    program = torch.onnx.export(
        _Calibrated(network, divisor).eval(),
        (example,),
        input_names=["crops"],
        output_names=["probabilities"],
        dynamic_shapes=({0: torch.export.Dim("count", min=1, max=256)},),
        dynamo=True,
        external_data=False,
        verbose=False,
    )
    assert program is not None
    model = program.model_proto
    for part in (model.graph, *model.graph.node, *model.graph.value_info):
        part.ClearField("doc_string")  # exporters note where the source stands on this computer
        part.ClearField("metadata_props")
    path.write_bytes(model.SerializeToString())
