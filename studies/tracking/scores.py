"""IDF1, HOTA and MOTA by TrackEval, the reference implementation of these metrics.

The similarity of a vehicle and a track falls from 1 where they coincide to 0 at twice the gate, so that TrackEval's
threshold of 0.5 (for IDF1 and MOTA) is the gate; HOTA is the mean over thresholds from 0.05 to 0.95, 3.8 to 0.2 m.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from drivemcp.errors import UserError
from studies.tracking.pairing import GATE_M, Scene


@dataclass(frozen=True, slots=True, kw_only=True)
class Scores:
    """The standard figures of a drive."""

    idf1: float
    hota: float
    mota: float
    recall: float
    precision: float
    identity_switches: int
    vehicles: int


def scores(scenes: Sequence[Scene]) -> Scores:
    """Score a drive. Raises UserError where TrackEval is not installed."""
    try:
        from trackeval.metrics import CLEAR, HOTA, Identity
    except ImportError as error:
        raise UserError(
            "TrackEval is missing: pip install 'drivemcp[tables]', then pip install --no-deps 'trackeval>=1.3,<2'"
        ) from error
    sequence = _sequence(scenes)
    quiet = {"PRINT_CONFIG": False}
    clear = CLEAR(dict(quiet)).eval_sequence(sequence)
    return Scores(
        idf1=float(Identity(dict(quiet)).eval_sequence(sequence)["IDF1"]),
        hota=float(np.mean(HOTA().eval_sequence(sequence)["HOTA"])),
        mota=float(clear["MOTA"]),
        recall=float(clear["CLR_Re"]),
        precision=float(clear["CLR_Pr"]),
        identity_switches=int(clear["IDSW"]),
        vehicles=int(sequence["num_gt_ids"]),
    )


def _sequence(scenes: Sequence[Scene]) -> dict[str, Any]:
    """TrackEval's form: ids from 0 for each picture, and similarities."""
    true = _numbered([[each.actor_id for each in scene.vehicles] for scene in scenes])
    told = _numbered([[each.track_id for each in scene.tracks] for scene in scenes])
    return {
        "num_timesteps": len(scenes),
        "num_gt_ids": len({k for ids in true for k in ids.tolist()}),
        "num_tracker_ids": len({k for ids in told for k in ids.tolist()}),
        "num_gt_dets": sum(map(len, true)),
        "num_tracker_dets": sum(map(len, told)),
        "gt_ids": true,
        "tracker_ids": told,
        "similarity_scores": [np.maximum(0.0, 1.0 - scene.apart_m / (2 * GATE_M)) for scene in scenes],
    }


def _numbered(ids: Sequence[Sequence[int]]) -> list[np.typing.NDArray[np.int64]]:
    names = {name: k for k, name in enumerate(sorted({each for row in ids for each in row}))}
    return [np.array([names[each] for each in row], dtype=np.int64) for row in ids]
