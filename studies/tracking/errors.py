"""How far off tracks are: the gap and the closing speed."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from proto.perception import Track
from services.simulator.traffic.cars import EGO_BODY
from studies.tracking.pairing import Scene, Vehicle, near_m

SETTLED_S = 1.0
"""From this age on a track's speed must be right."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Errors:
    """Medians of the gap's error; the speed's root mean square over settled tracks, its median and nine in ten."""

    gap_m: float
    gap_share: float
    gap_p90_m: float
    closing_rms_mps: float
    closing_median_mps: float
    closing_p90_mps: float


def errors(scenes: Sequence[Scene]) -> Errors:
    """Over all pairs of a counted vehicle and its track."""
    pairs = [(vehicle, track) for scene in scenes for vehicle, track in _pairs(scene)]
    gaps = np.array([(near_m(track) - vehicle.x_m, _gap_m(vehicle)) for vehicle, track in pairs]).reshape(-1, 2)
    off_m = np.abs(gaps[:, 0])
    speeds = np.array([track.vx_mps - vehicle.vx_mps for vehicle, track in pairs if track.age_s >= SETTLED_S])
    return Errors(
        gap_m=_quantile(off_m, 0.5),
        gap_share=_quantile(off_m / gaps[:, 1], 0.5),
        gap_p90_m=_quantile(off_m, 0.9),
        closing_rms_mps=float(np.sqrt(np.mean(speeds**2))) if len(speeds) else float("nan"),
        closing_median_mps=_quantile(np.abs(speeds), 0.5),
        closing_p90_mps=_quantile(np.abs(speeds), 0.9),
    )


def _pairs(scene: Scene) -> Iterator[tuple[Vehicle, Track]]:
    tracks = {track.track_id: track for track in scene.tracks}
    for vehicle in scene.vehicles:
        if vehicle.actor_id in scene.pairs:
            yield vehicle, tracks[scene.pairs[vehicle.actor_id]]


def _gap_m(vehicle: Vehicle) -> float:
    """From the ego's front; nearer than a metre all counts as that."""
    return max(1.0, vehicle.x_m - EGO_BODY.length_m / 2)


def _quantile(values: np.typing.NDArray[np.float64], share: float) -> float:
    return float(np.quantile(values, share)) if len(values) else float("nan")
