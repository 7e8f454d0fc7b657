"""Detectors behind one interface: our own centre-point net, and any COCO-style YOLOX, both on ONNX Runtime."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from drivemcp.errors import UserError
from drivemcp.inference import CPU
from proto.perception import ObjectClass
from services.perception.detect.detection import Detection

Picture = NDArray[np.uint8]
"""(height, width, 3), RGB."""


class DetectorError(UserError):
    """A detector model that cannot be used: absent, broken, or of an unknown form."""


class Detector(Protocol):
    """Finds objects in one picture."""

    name: str

    def detect(self, rgb: Picture, *, closer: bool = False) -> list[Detection]:
        """Objects in `rgb`, best first; boxes in its pixels.

        `closer`: the strip about the horizon is looked at once more, enlarged, by a detector that can do so.
        """
        ...


@dataclass(frozen=True, slots=True, kw_only=True)
class DetectorOptions:
    """How a detector runs. `floors` overrides the score below which boxes of a class are dropped."""

    threads: int = 1
    score_floor: float = 0.3
    overlap_limit: float = 0.5
    floors: dict[ObjectClass, float] | None = None
    providers: tuple[str, ...] = CPU
    """Execution providers of ONNX Runtime, by the names of `drivemcp.inference.PROVIDERS`."""

    layout: str = ""
    """The layout of a COCO-style model, by its name in `coco.LAYOUTS`; empty: its outputs tell."""

    def floor(self, kind: ObjectClass) -> float:
        """The lowest score that counts for a class."""
        return (self.floors or {}).get(kind, self.score_floor)
