"""The reader's score table: how often right, how often believed and wrong, by size of the sign in the picture."""

import re
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from services.drivelm.reading.evidence import CLEAR
from services.drivelm.vocabulary.classes import READER_CLASSES
from training.bins import Bins, binned

_SIZES_PX = ((9, 14), (14, 20), (20, 24), (24, 30), (30, 45), (45, 76))
LEGIBLE_PX = 24
"""From this size on a sign is to be read right in 99 of 100 crops; a light's state in 98 from 10 px."""
LIGHT_PX = 10
_DISC_SHARES = {
    "limit:": 1.0, "limit_end": 1.0, "limit_board": 1.0, "school_limit": 1.0, "all_end": 1.0, "no_": 1.0, "stop": 1.0, "yield": 1.0,
    "priority_": 1.0, "roundabout": 1.0, "ahead_only": 1.0, "keep_": 1.0, "national": 1.0, "danger": 1.0, "children": 1.0, "roadworks": 1.0,
    "slippery": 1.0, "crossing": 1.0, "one_way": 1.0, "led:": 1.0, "zone": 0.63, "general": 0.63, "light:": 0.25,
}  # fmt: skip
"""What share of a face's longer side its disc is (its symbol, number, lamp), by the start of the class. Boards of words have none."""
SURE = 0.9
"""A single crop counts as sure from here; the drive believes only several agreeing crops (see ``services.drivelm``)."""
SURELY_WRONG = 0.002
"""Of all crops of signs, at most so many may be read wrong by a reader that is sure."""
SMALL_PX = 20
_THRESHOLDS = np.round(np.arange(SURE, 0.995, 0.005), 3)
_GROUPS = {
    "limit": "limit:",
    "limit_board": "limit_board:",
    "zone": "zone:",
    "led": "led:",
    "light": "light:",
    "plate": "plate:",
}


class Measured(NamedTuple):
    """Probabilities N x classes, true class indexes, true sizes in pixels (0: no sign)."""

    probabilities: NDArray[np.float32]
    labels: NDArray[np.int64]
    sizes_px: NDArray[np.float32]

    def bins(self) -> Bins:
        """The highest probability of each crop, and whether its class is the right one."""
        return binned(self.probabilities.max(axis=1), self.probabilities.argmax(axis=1) == self.labels)


class Sure(NamedTuple):
    """The confidence from which a crop counts as sure, of faces below ``SMALL_PX`` and of all larger ones."""

    small: float
    large: float

    def of(self, sizes_px: NDArray[np.float32]) -> NDArray[np.float32]:
        """The one for each of the sizes."""
        return np.where(sizes_px < SMALL_PX, self.small, self.large).astype(np.float32)


def sure_from(measured: Measured) -> Sure:
    """The least confidences, ``SURE`` or more, from which at most ``SURELY_WRONG`` of these crops are read wrong, with one
    standard deviation of that count to spare. For crops that are neither trained on nor scored."""
    signs = measured.labels != 0
    small = measured.sizes_px < SMALL_PX
    return Sure(_least(measured, signs & small), _least(measured, signs & ~small))


def _least(measured: Measured, chosen: NDArray[np.bool_]) -> float:
    for threshold in _THRESHOLDS.tolist():
        wrong = int(_sure(measured, chosen, threshold, right=False).sum())
        if wrong + np.sqrt(wrong) <= SURELY_WRONG * chosen.sum():
            break
    return float(threshold)


def _sure(
    measured: Measured, chosen: NDArray[np.bool_], threshold: float | NDArray[np.float32], right: bool
) -> NDArray[np.bool_]:
    """Which of the chosen crops are read with more confidence than the threshold (or each than its own), and right, or
    wrong."""
    best, top = measured.probabilities[chosen].argmax(axis=1), measured.probabilities[chosen].max(axis=1, initial=0)
    return np.asarray(((best == measured.labels[chosen]) == right) & (top > threshold) & (best != 0))


def score_table(measured: Measured, sure: Sure | None = None) -> dict[str, Any]:
    """Rows by size for all signs and for each group, and how often ``other`` is taken for a sign with certainty.

    ``sure``: the confidences of ``sure_from``; what is right and wrong from there is added.
    """
    names = np.array(READER_CLASSES)
    signs = measured.labels != 0
    table: dict[str, Any] = {"all_signs": _rows(measured, signs)}
    for group, start in _GROUPS.items():
        table[group] = _rows(measured, np.char.startswith(names[measured.labels], start))
    table["right_when_legible"] = _right(measured, signs & (measured.sizes_px >= LEGIBLE_PX))
    table["right_discs_when_legible"] = _right(measured, _discs_px(measured, names) >= LEGIBLE_PX)
    table["light_state"] = _light_state(measured, names)
    table["surely_wrong"] = _share(_sure(measured, signs, SURE, right=False))
    if sure is not None:
        own = sure.of(measured.sizes_px[signs])
        shares = {name: _share(_sure(measured, signs, own, name == "right")) for name in ("right", "wrong")}
        table["sure"] = {**sure._asdict(), **shares, "right_at_0.9": _share(_sure(measured, signs, SURE, right=True))}
    table["green_for_red"] = _taken_for(measured, "light:red", "light:green")
    large = _discs_px(measured, names) >= LIGHT_PX
    legible = Measured(measured.probabilities[large], measured.labels[large], measured.sizes_px[large])
    table["green_for_red_when_legible"] = _taken_for(legible, "light:red", "light:green")
    other = measured.probabilities[~signs]
    table["other"] = {"crops": len(other), "taken_for_a_sign_surely": _share(other[:, 1:].max(axis=1) > SURE)}
    table["calibration_error"] = round(measured.bins().error, 4)
    return table


def _discs_px(measured: Measured, names: NDArray[np.str_]) -> NDArray[np.float64]:
    shares = [next((share for start, share in _DISC_SHARES.items() if name.startswith(start)), 0.0) for name in names]
    return np.array(shares)[measured.labels] * measured.sizes_px


def _light_state(measured: Measured, names: NDArray[np.str_]) -> dict[str, Any]:
    """Of lamps of ten pixels and more: whether red, amber, green or none is told right, whatever the arrow."""
    lights = np.char.startswith(names[measured.labels], "light:") & (_discs_px(measured, names) >= LIGHT_PX)
    states = np.array([re.sub(r"_(left|straight|right)$", "", name) for name in names])
    right = states[measured.labels[lights]] == states[measured.probabilities[lights].argmax(axis=1)]
    return {"crops": int(lights.sum()), "right": _share(right)}


def _rows(measured: Measured, chosen: NDArray[np.bool_]) -> list[dict[str, Any]]:
    rows = []
    for low, high in _SIZES_PX:
        part = chosen & (measured.sizes_px >= low) & (measured.sizes_px < high)
        row = {"px": f"{low}-{high}", "crops": int(part.sum()), "right": _right(measured, part)}
        sure = {f"sure_{name}": _share(_sure(measured, part, SURE, name == "right")) for name in ("right", "wrong")}
        rows.append({**row, **sure})
    return rows


def _right(measured: Measured, chosen: NDArray[np.bool_]) -> float | None:
    return _share(measured.probabilities[chosen].argmax(axis=1) == measured.labels[chosen])


def _taken_for(measured: Measured, true_start: str, read_start: str) -> dict[str, Any]:
    """How many crops of some classes are read as some others: however unsure, and so clearly that it counts on a drive."""
    names = np.array(READER_CLASSES)
    true = np.char.startswith(names[measured.labels], true_start)
    read = np.char.startswith(names[measured.probabilities[true].argmax(axis=1)], read_start)
    clearly = read & (measured.probabilities[true].max(axis=1, initial=0) >= CLEAR)
    return {"crops": int(true.sum()), "taken": int(read.sum()), "clearly": int(clearly.sum())}


def _share(flags: NDArray[np.bool_]) -> float | None:
    return round(float(flags.mean()), 4) if len(flags) else None
