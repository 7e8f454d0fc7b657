"""Photographed road scenes: labelled signs found, by size and by whether the closer look shows them; and, where another
detector judges, people that it does not see, and its vehicles and lights found."""

from collections.abc import Iterable, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from proto.perception import ObjectClass
from services.orchestrator.world.actors import FLOOR
from services.perception.detect.centre_point import strip_rows
from services.perception.detect.detection import Detection, FloatArray, overlaps
from services.perception.detect.detector import Detector
from training.detector.scores import Tally, average_precision
from training.photographs.gtsdb import Scene

OVERLAP = 0.5
_SIZES_PX = ((0, 16), (16, 24), (24, 32), (32, 48), (48, 1000))
JUDGE_SURE, JUDGE_SEES = 0.6, 0.15
"""From which score the judge is sure of a thing, and from which it sees one at all."""
JUDGED_PX = 32
"""Vehicles and lights are asked for from this height."""


class Seen(NamedTuple):
    """One scene: labelled boxes (N, 4), what was found, what the judge found, and the picture's height, pixels."""

    labelled: FloatArray
    found: Sequence[Detection]
    judged: Sequence[Detection]
    size_px: tuple[int, int]
    """Height and width of the picture."""


def looked(detector: Detector, scenes: Iterable[Scene], judge: Detector | None = None) -> list[Seen]:
    """What the detector, looking closer as in the car, and the judge find in each scene."""
    seen = []
    for scene in scenes:
        picture = scene.picture()
        boxes = np.array([sign.region for sign in scene.signs], np.float32).reshape(-1, 4)
        judged = judge.detect(picture) if judge else ()
        seen.append(Seen(boxes, detector.detect(picture, closer=True), judged, picture.shape[:2]))
    return seen


def table(seen: Sequence[Seen], judged: bool) -> dict[str, Any]:
    """Recall and average precision of signs, everything unlabelled counted as false, and what the judge says of the rest."""
    sizes = np.concatenate([one.labelled[:, 3] - one.labelled[:, 1] for one in seen])
    hit = np.concatenate([_hit(one.labelled, boxes(one.found, "sign"), OVERLAP) for one in seen])
    closer = np.concatenate([_in_strip(one) for one in seen])
    sides = {f"{low} to {high} px": (sizes >= low) & (sizes < high) for low, high in _SIZES_PX}
    large = sizes >= 24
    groups = {
        **sides,
        "24 px and more": large,
        "these in the closer look": large & closer,
        "these outside it": large & ~closer,
    }
    told = {
        "scenes": len(seen),
        "signs": len(sizes),
        "AP50 of signs": round(average_precision(tally(seen)), 4),
        "recall of signs": {
            name: {"signs": int(part.sum()), "found": _share(hit[part])} for name, part in groups.items()
        },
        "signs told a picture": round(float(np.mean([len(boxes(one.found, "sign")) for one in seen])), 2),
        "people told a picture": round(float(np.mean([len(boxes(one.found, "pedestrian")) for one in seen])), 2),
    }
    return told | (_judged(seen) if judged else {})


def tally(seen: Sequence[Seen]) -> Tally:
    """Signs found by score, right where they lie on a labelled one that no better one lies on."""
    scores, right = [], []
    for one in seen:
        free = np.ones(len(one.labelled), bool)
        for each in sorted((each for each in one.found if each.kind == "sign"), key=lambda each: -each.score):
            overlap = overlaps(np.array([each.box_px], np.float32), one.labelled)[0] * free
            best = int(overlap.argmax()) if len(overlap) else 0
            good = bool(len(overlap)) and float(overlap[best]) >= OVERLAP
            if good:
                free[best] = False
            scores.append(each.score)
            right.append(good)
    objects = sum(len(one.labelled) for one in seen)
    return Tally(np.array(scores, np.float64), np.array(right, bool), objects)


def _judged(seen: Sequence[Seen]) -> dict[str, Any]:
    invented = {least: [_invented(one, least) for one in seen] for least in (0.0, FLOOR)}
    asked: dict[str, Any] = {}
    for kind in ("vehicle", "light", "pedestrian"):
        wanted = [_tall(boxes(one.judged, kind, JUDGE_SURE)) for one in seen]
        hit = np.concatenate([_hit(each, boxes(one.found, kind), 0.4) for each, one in zip(wanted, seen, strict=True)])
        asked[f"{kind}s that the judge is sure of"] = {"count": len(hit), "found": _share(hit)}
    return {
        "people a picture that the judge does not see": round(float(np.mean(invented[0.0])), 3),
        f"these from {FLOOR}, from which a driver can be told of them": round(float(np.mean(invented[FLOOR])), 3),
        **asked,
    }


def _invented(one: Seen, least: float) -> int:
    return int((~_hit(boxes(one.found, "pedestrian", least), boxes(one.judged, "pedestrian", JUDGE_SEES), 0.1)).sum())


def boxes(found: Sequence[Detection], kind: ObjectClass, least: float = 0.0) -> FloatArray:
    """Boxes (N, 4) of a class from a score on."""
    return np.array([each.box_px for each in found if each.kind == kind and each.score >= least], np.float32).reshape(
        -1, 4
    )


def _tall(rows: FloatArray) -> FloatArray:
    return rows[rows[:, 3] - rows[:, 1] >= JUDGED_PX]


def _hit(wanted: FloatArray, found: FloatArray, least: float) -> NDArray[np.bool_]:
    """Which of the wanted boxes some found one overlaps so much."""
    if not len(found) or not len(wanted):
        return np.zeros(len(wanted), bool)
    return np.asarray((overlaps(wanted, found) >= least).any(axis=1))


def _in_strip(one: Seen) -> NDArray[np.bool_]:
    top, bottom = strip_rows(*one.size_px)
    return np.asarray((one.labelled[:, 1] >= top) & (one.labelled[:, 3] <= bottom))


def _share(flags: NDArray[np.bool_]) -> float | None:
    return round(float(flags.mean()), 4) if len(flags) else None
