"""The network of our detector: a small centre-point net whose heat map and box distances lie on a stride of four pixels.

The backbone is plain 3 x 3 convolutions (a CPU runs them at a better rate than depthwise ones) down to stride 32. A
thin top-down path brings the context back to stride 4, where every cell says how much it is the centre of a class and
how far the four sides of the box are.
"""

from __future__ import annotations

import copy

import torch
from torch import Tensor, nn
from torch.nn import functional

STRIDE = 4
HEAD = 32
"""Channels where heat and sides are told."""
SIDE_SCALE_PX = 16.0
"""The box head's unit, so that its outputs are of the order of one."""
MOST_RAW = 4.0
"""Sides end at 870 px: nothing in a picture is larger, and no untrained cell overflows."""
PIXEL_SCALE = 60.0
"""Brings 0..255 to the order of one; the first batch norm takes the mean away."""


class ConvBlock(nn.Sequential):
    """Convolution without bias, batch norm, ReLU."""

    def __init__(self, inputs: int, outputs: int, *, kernel: int = 3, stride: int = 1, groups: int = 1) -> None:
        super().__init__(
            nn.Conv2d(inputs, outputs, kernel, stride, kernel // 2, groups=groups, bias=False),
            nn.BatchNorm2d(outputs),
            nn.ReLU(inplace=True),
        )


class Residual(nn.Module):
    """A bottleneck of half the width beside the identity, which it is at first: one more changes nothing until it learns."""

    def __init__(self, channels: int) -> None:
        super().__init__()
        self.body = nn.Sequential(
            ConvBlock(channels, channels // 2, kernel=1),
            nn.Conv2d(channels // 2, channels, 3, padding=1, bias=False),
            nn.BatchNorm2d(channels),
        )
        nn.init.zeros_(self.body[-1].weight)  # type: ignore[arg-type]

    def forward(self, features: Tensor) -> Tensor:
        """`features` (N, C, H, W) refined, same shape."""
        return functional.relu(features + self.body(features))


class DetectorNet(nn.Module):
    """RGB (N, 3, H, W) in 0..255, H and W multiples of 32, to heat logits (N, K, H/4, W/4) and raw sides (N, 4, H/4, W/4).

    `sides_px` of the raw sides are the distances from the cell's centre to the left, top, right and bottom of the box.
    """

    def __init__(self, classes: int, widths: tuple[int, int, int, int, int] = (16, 32, 64, 96, 128)) -> None:
        super().__init__()
        stem, w4, w8, w16, w32 = widths
        self.stem = ConvBlock(3, stem, stride=2)
        self.stage4 = nn.Sequential(ConvBlock(stem, w4, stride=2), Residual(w4))
        self.stage8 = nn.Sequential(ConvBlock(w4, w8, stride=2), Residual(w8))
        self.stage16 = nn.Sequential(ConvBlock(w8, w16, stride=2), Residual(w16), Residual(w16))
        self.stage32 = nn.Sequential(ConvBlock(w16, w32, stride=2), *(Residual(w32) for _ in range(4)))
        neck = w8
        self.lateral32 = ConvBlock(w32, neck, kernel=1)
        self.lateral16 = ConvBlock(w16, neck, kernel=1)
        self.smooth16 = Residual(neck)
        self.smooth8 = Residual(neck)
        self.refine8 = Residual(neck)
        self.lateral4 = ConvBlock(w4, HEAD, kernel=1)
        self.down4 = ConvBlock(neck, HEAD, kernel=1)
        self.smooth4 = ConvBlock(HEAD, HEAD)
        self.heat4 = Residual(HEAD)
        self.sides4 = Residual(HEAD)
        self.heat = nn.Conv2d(HEAD, classes, 1)
        self.sides = nn.Conv2d(HEAD, 4, 1)
        nn.init.constant_(self.heat.bias, -4.6)  # type: ignore[arg-type]
        nn.init.normal_(self.sides.weight, std=0.01)
        nn.init.constant_(self.sides.bias, 0.0)  # type: ignore[arg-type]

    def forward(self, images: Tensor) -> tuple[Tensor, Tensor]:
        """See the class."""
        return self.forward_scaled(images / PIXEL_SCALE)

    def forward_scaled(self, images: Tensor) -> tuple[Tensor, Tensor]:
        """As `forward`, of pixels that are scaled already (or a stem that does it)."""
        c4 = self.stage4(self.stem(images))
        c8 = self.stage8(c4)
        c16 = self.stage16(c8)
        c32 = self.stage32(c16)
        p16 = self.smooth16(self.lateral16(c16) + _double(self.lateral32(c32)))
        p8 = self.refine8(self.smooth8(c8 + _double(p16)))
        p4 = self.smooth4(self.lateral4(c4) + _double(self.down4(p8)))
        return self.heat(self.heat4(p4)), self.sides(self.sides4(p4))


class ExportNet(nn.Module):
    """`DetectorNet` as it runs in the car: uint8 picture (1, H, W, 3) in, heat at its local peaks (0 elsewhere) out."""

    def __init__(self, net: DetectorNet) -> None:
        super().__init__()
        self.net = copy.deepcopy(net).eval()
        with torch.no_grad():
            self.net.stem[0].weight.div_(PIXEL_SCALE)  # type: ignore[operator]

    def forward(self, picture: Tensor) -> tuple[Tensor, Tensor]:
        """Heat in 0..1 (1, K, H/4, W/4), kept only where it is the largest of its 3 x 3 neighbours; sides in px."""
        logits, raw = self.net.forward_scaled(picture.permute(0, 3, 1, 2).float())
        heat = torch.sigmoid(logits)
        peak = functional.max_pool2d(heat, 3, 1, 1)
        return heat * (heat >= peak), sides_px(raw)


def grown(own: dict[str, Tensor], weights: dict[str, Tensor]) -> tuple[dict[str, Tensor], int]:
    """`own` with another network's weights, as far as they go, and how many tensors those are.

    Where ours is the wider one, the old outputs do not listen to the new inputs at first: the network says what it said.
    """
    out, taken = dict(own), 0
    for name, value in weights.items():
        mine = own.get(name)
        if mine is None or mine.ndim != value.ndim or any(a < b for a, b in zip(mine.shape, value.shape, strict=True)):
            continue
        mine = mine.clone()
        if value.ndim > 1:
            mine[: len(value)] = 0.0
        mine[tuple(slice(size) for size in value.shape)] = value
        out[name], taken = mine, taken + 1
    return out, taken


def sides_px(raw: Tensor) -> Tensor:
    """The box head's output in pixels: an exponential, so that large boxes are learned as fast as small ones."""
    return torch.exp(raw.clamp(max=MOST_RAW)) * SIDE_SCALE_PX


def _double(features: Tensor) -> Tensor:
    return functional.interpolate(features, scale_factor=2.0, mode="nearest")
