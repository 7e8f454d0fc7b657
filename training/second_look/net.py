"""The network of a second look: a small picture of what may be of a class, to how sure that is and where its edges are."""

from __future__ import annotations

import copy

import torch
from torch import Tensor, nn

from proto.perception import ObjectClass
from training.detector.net import PIXEL_SCALE, ConvBlock, Residual

SIDE_PX = 64
HIDDEN = 64
Widths = tuple[int, int, int, int]
WIDTHS: dict[ObjectClass, Widths] = {
    "pedestrian": (24, 32, 64, 96),
    "sign": (16, 24, 48, 64),
    "light": (16, 24, 48, 64),
}
"""Channels at strides 2, 4, 8 and 16: people differ more, and fewer boxes may be one."""
SHAPE_SCALE, MOVE_SCALE = 4.0, 0.25
"""They bring the box's size and the edges' moves, in shares of the square, to the order of one."""


class LookNet(nn.Module):
    """RGB (N, 3, 64, 64) in 0..255 and the size (N, 2) of the box asked about, to log-odds (N) and edges (N, 4).

    The log-odds are that the box is of the class. The edges are the thing's, from the middle, at first the box's own. Size and
    edges are in shares of the square.
    """

    def __init__(self, widths: Widths = WIDTHS["sign"]) -> None:
        super().__init__()
        w2, w4, w8, w16 = widths
        self.features = nn.Sequential(
            ConvBlock(3, w2, stride=2),
            ConvBlock(w2, w4, stride=2),
            Residual(w4),
            ConvBlock(w4, w8, stride=2),
            Residual(w8),
            Residual(w8),
            ConvBlock(w8, w16, stride=2),
            Residual(w16),
            nn.Flatten(),
            nn.Linear(w16 * (SIDE_PX // 16) ** 2, HIDDEN),
            nn.ReLU(inplace=True),
        )
        self.mixed = nn.Sequential(nn.Linear(HIDDEN + 2, HIDDEN), nn.ReLU(inplace=True))
        self.odds = nn.Linear(HIDDEN, 1)
        self.moves = nn.Linear(HIDDEN, 4)
        nn.init.zeros_(self.moves.weight)
        nn.init.zeros_(self.moves.bias)

    def forward(self, pictures: Tensor, sizes: Tensor) -> tuple[Tensor, Tensor]:
        """See the class."""
        return self.forward_scaled(pictures / PIXEL_SCALE, sizes)

    def forward_scaled(self, pictures: Tensor, sizes: Tensor) -> tuple[Tensor, Tensor]:
        """As `forward`, of pixels that are scaled already (or a first layer that does it)."""
        seen = self.mixed(torch.cat([self.features(pictures), sizes * SHAPE_SCALE], dim=1))
        own = torch.cat([-sizes / 2, sizes / 2], dim=1)
        return self.odds(seen)[:, 0], own + self.moves(seen) * MOVE_SCALE


class ExportLook(nn.Module):
    """`LookNet` as it runs in the car: uint8 (N, 64, 64, 3) in."""

    def __init__(self, net: LookNet) -> None:
        super().__init__()
        self.net = copy.deepcopy(net).eval()
        first = self.net.features[0]
        assert isinstance(first, nn.Sequential)
        with torch.no_grad():
            first[0].weight.div_(PIXEL_SCALE)  # type: ignore[operator]

    def forward(self, pictures: Tensor, sizes: Tensor) -> tuple[Tensor, Tensor]:
        """Log-odds (N) and edges (N, 4)."""
        odds, sides = self.net.forward_scaled(pictures.permute(0, 3, 1, 2).float(), sizes)
        return odds, sides
