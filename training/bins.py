"""Told confidence beside the share that was right: bins of equal width, and the expected calibration error over them."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Bools = NDArray[np.bool_]
BINS = 10


class Bins(NamedTuple):
    """Of each bin: the mean confidence told, the share right (both NaN where it is empty), and how many fell into it."""

    told: Floats
    right: Floats
    counts: NDArray[np.int64]

    @property
    def error(self) -> float:
        """The expected calibration error: the mean distance of the two, by how many are in a bin; NaN without any."""
        full = self.counts > 0
        if not full.any():
            return float("nan")
        return float(np.average(np.abs(self.told[full] - self.right[full]), weights=self.counts[full]))


def binned(told: NDArray[Any], right: NDArray[np.bool_]) -> Bins:
    """Confidences N in [0, 1] and whether each was right, in bins of equal width."""
    place = np.minimum((told * BINS).astype(int), BINS - 1)
    counts = np.bincount(place, minlength=BINS)
    sums = [np.bincount(place, weights=values.astype(np.float64), minlength=BINS) for values in (told, right)]
    with np.errstate(invalid="ignore"):
        return Bins(sums[0] / counts, sums[1] / counts, counts)
