"""The reader's network: about 0.9 million parameters, 48 x 48 RGB in, one score per class out."""

from torch import Tensor, nn

from services.drivelm.reading.crops import CROP_PX


def _block(channels_in: int, channels_out: int, size: int = 3, stride: int = 1) -> nn.Sequential:
    convolution = nn.Conv2d(channels_in, channels_out, size, stride, size // 2, bias=False)
    return nn.Sequential(convolution, nn.BatchNorm2d(channels_out), nn.ReLU(inplace=True))


class ReaderNet(nn.Module):
    """Plain convolutions; the last map keeps 3 x 3 places, because the order of digits matters.

    Takes float32 N x 3 x 48 x 48 in [0, 255] (normalising is part of the network), gives N x classes scores.
    """

    def __init__(self, classes: int) -> None:
        super().__init__()
        self.features = nn.Sequential(
            _block(3, 32, 5, 2),
            _block(32, 48),
            _block(48, 80, 3, 2),
            _block(80, 96),
            _block(96, 96),
            _block(96, 160, 3, 2),
            _block(160, 192),
            nn.MaxPool2d(2),
        )
        places = (CROP_PX // 16) ** 2
        self.head = nn.Sequential(nn.Flatten(), nn.Dropout(0.2), nn.Linear(192 * places, classes))

    def forward(self, crops: Tensor) -> Tensor:
        """Scores before softmax."""
        scores: Tensor = self.head(self.features(levelled(crops)))
        return scores


def levelled(crops: Tensor) -> Tensor:
    """Each crop scaled by its own mean and spread, so exposure and fog matter less."""
    mean = crops.mean(dim=(1, 2, 3), keepdim=True)
    spread = (crops - mean).pow(2).mean(dim=(1, 2, 3), keepdim=True).sqrt()
    return (crops - mean) / (spread + 6.0)
