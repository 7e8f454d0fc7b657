"""Training goes on from an exported network: its norms, which lie in its convolutions, are taken out of them again."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import onnx
import torch
from torch import Tensor, nn

from training.detector.batches import Batch
from training.detector.exported import convolutions
from training.detector.net import PIXEL_SCALE, DetectorNet

BATCHES = 40
"""From which the norms take their means and variances."""


def begin_with_exported(net: DetectorNet, path: Path, source: Iterator[Batch]) -> None:
    """Give `net` the weights of an exported one of its own shape: it says what that says, and its norms are of `source`.

    Raises ValueError where the file holds another network.
    """
    exported = convolutions(onnx.load(str(path)), str(path))
    weights = [(torch.from_numpy(weight.copy()), torch.from_numpy(bias.copy())) for weight, bias in exported]
    order = _in_order(net)
    if [tuple(conv.weight.shape) for conv, _ in order] != [tuple(weight.shape) for weight, _ in weights]:
        raise ValueError(f"{path}: its convolutions are not those of this network; train from a state, or from nothing")
    norms: dict[nn.BatchNorm2d, list[Tensor]] = {}
    with torch.no_grad():
        for number, ((conv, norm), (weight, bias)) in enumerate(zip(order, weights, strict=True)):
            conv.weight.copy_(weight * PIXEL_SCALE if number == 0 else weight)
            if norm is None:
                conv.bias.copy_(bias)  # type: ignore[union-attr]
                continue
            norm.weight.fill_(1.0)
            norm.bias.copy_(bias)
            norm.running_mean.zero_()  # type: ignore[union-attr]
            norm.running_var.fill_(1.0 - norm.eps)  # type: ignore[union-attr]
            norms[norm] = []
        _watch(net, norms, source)
        for norm, seen in norms.items():
            variance, mean = torch.var_mean(torch.cat(seen), dim=0)
            norm.running_mean.copy_(mean)  # type: ignore[union-attr]
            norm.running_var.copy_(variance)  # type: ignore[union-attr]
            norm.weight.copy_((variance + norm.eps).sqrt())
            norm.bias.add_(mean)


def _watch(net: DetectorNet, norms: dict[nn.BatchNorm2d, list[Tensor]], source: Iterator[Batch]) -> None:
    """Collect what comes to each norm, every 53rd place of it, while the network looks at some batches."""

    def collect(norm: nn.Module, inputs: tuple[Tensor, ...]) -> None:
        features = inputs[0].permute(0, 2, 3, 1).reshape(-1, inputs[0].shape[1])
        norms[norm].append(features[::53].clone())  # type: ignore[index]

    hooks = [norm.register_forward_pre_hook(collect) for norm in norms]
    net.eval()
    for _ in range(BATCHES):
        net(torch.from_numpy(next(source).pictures).float().contiguous(memory_format=torch.channels_last))
    for hook in hooks:
        hook.remove()


def _in_order(net: DetectorNet) -> list[tuple[nn.Conv2d, nn.BatchNorm2d | None]]:
    """The network's convolutions in the order in which they run, each with the norm behind it."""
    modules = list(net.modules())
    behind = {
        module: after if isinstance(after, nn.BatchNorm2d) else None
        for module, after in zip(modules, [*modules[1:], None], strict=True)
        if isinstance(module, nn.Conv2d)
    }
    ran: list[tuple[nn.Conv2d, nn.BatchNorm2d | None]] = []
    hooks = [conv.register_forward_hook(lambda conv, _, __: ran.append((conv, behind[conv]))) for conv in behind]
    net.eval()
    net(torch.zeros(1, 3, 64, 64))
    for hook in hooks:
        hook.remove()
    return ran
