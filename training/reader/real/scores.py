"""Single photographed crops: how often right, how often sure and wrong, of limits, of all known classes, of unknown signs."""

import json
from collections import Counter
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from services.drivelm.reading.crops import crop
from services.drivelm.reading.reader import Reader
from services.drivelm.vocabulary.classes import BY_KIND, OTHER, READER_CLASSES
from training.bins import binned
from training.photographs.gtsrb import RealSign, signs
from training.reader.scores import LEGIBLE_PX, SMALL_PX, SURE, Sure

_SIZES_PX = ((0, 16), (16, 24), (24, 32), (32, 48), (48, 1000))
_MISTAKES = 12
SURE_AND_WRONG = 0.0005
"""At most so many photographed signs may be told wrong by a reader that is sure."""
_THRESHOLDS = np.round(np.arange(SURE, 0.9995, 0.005), 3)


def sure_of(card: Path) -> Sure:
    """From where a crop counts as sure, by the model's card: chosen on photographs where there were any."""
    content = json.loads(card.read_text(encoding="utf-8"))
    stored = content.get("real", {}).get("sure") or content.get("scores", {}).get("sure", {})
    return Sure(float(stored.get("small", SURE)), float(stored.get("large", SURE)))


def read_all(reader: Reader, found: Sequence[RealSign]) -> NDArray[np.float32]:
    """Probabilities N x classes of the signs through their published boxes; what no sign can be goes to `other`."""
    cut = [crop(sign.picture(), sign.region) for sign in found]
    images = np.stack([each if each is not None else np.zeros((48, 48, 3), np.uint8) for each in cut])
    told = reader.probabilities(images)
    allowed = np.isin(reader.classes, BY_KIND["sign"])
    told[:, reader.classes.index(OTHER)] += told[:, ~allowed].sum(axis=1)
    told[:, ~allowed] = 0.0
    return told


def sure_on(told: NDArray[np.float32], found: Sequence[RealSign]) -> Sure:
    """The least confidences from which at most `SURE_AND_WRONG` of these signs are told wrong, unknown ones taken for known
    ones among them, with one standard deviation of that count to spare where there are any."""
    truth = np.array([sign.label for sign in found])
    sizes = np.array([sign.region.height_px for sign in found], np.float32)
    read, top = np.array(READER_CLASSES)[told.argmax(axis=1)], told.max(axis=1)
    wrong = (read != truth) & (read != OTHER)

    def least(chosen: NDArray[np.bool_]) -> float:
        for threshold in _THRESHOLDS.tolist():
            count = int((chosen & wrong & (top > threshold)).sum())
            if count + np.sqrt(count) <= SURE_AND_WRONG * chosen.sum():
                break
        return float(threshold)

    return Sure(least(sizes < SMALL_PX), least(sizes >= SMALL_PX))


def table(told: NDArray[np.float32], found: Sequence[RealSign], sure: Sure) -> dict[str, Any]:
    """Shares of each group; `told`: probabilities N x READER_CLASSES of the signs in `found`."""
    truth = np.array([sign.label for sign in found])
    sizes = np.array([sign.region.height_px for sign in found], np.float32)
    limits, other = np.char.startswith(truth, "limit:"), truth == OTHER
    groups = {
        "limits of 24 px and more": limits & (sizes >= LEGIBLE_PX),
        "limits": limits,
        "known": ~other,
        "other": other,
    }
    sides = {f"known, {low} to {high} px": ~other & (sizes >= low) & (sizes < high) for low, high in _SIZES_PX}
    read = np.array(READER_CLASSES)[told.argmax(axis=1)]
    certain = (told.max(axis=1) > sure.of(sizes)) & (read != OTHER)
    rows = {name: _row(chosen, read == truth, certain) for name, chosen in {**groups, **sides}.items()}
    wrong = Counter(f"{sign.label} ({sign.number}) as {label}" for sign, label in zip(found, read, strict=True)
                    if label != sign.label)  # fmt: skip
    return {
        "crops": len(found),
        "tracks": len({(sign.number, sign.track) for sign in found}),
        "sure from": {f"below {SMALL_PX} px": sure.small, "above": sure.large},
        **rows,
        "calibration error": round(binned(told.max(axis=1), read == truth).error, 4),
        "most frequent mistakes": dict(wrong.most_common(_MISTAKES)),
    }


def _row(chosen: NDArray[np.bool_], right: NDArray[np.bool_], certain: NDArray[np.bool_]) -> dict[str, Any]:
    count = int(chosen.sum())
    if not count:
        return {"crops": 0}
    share = {"right": right, "sure and right": right & certain, "sure and wrong": ~right & certain}
    return {"crops": count, **{name: round(float(flags[chosen].mean()), 4) for name, flags in share.items()}}


def real_table(reader: Reader, folder: Path | None, drawn: Sure | None) -> dict[str, Any] | None:
    """What a card says of the tracks that training leaves out: scores, and from where a crop counts as sure, no lower than on
    drawn crops; None without the photographs."""
    found = [sign for each in (signs(folder) if folder else {}).values() for sign in each if sign.held_out]
    if not found:
        return None
    told = read_all(reader, found)
    own, least = sure_on(told, found), drawn or Sure(SURE, SURE)
    sure = Sure(max(own.small, least.small), max(own.large, least.large))
    return {"sure": sure._asdict(), "held_out_tracks": table(told, found, sure)}
