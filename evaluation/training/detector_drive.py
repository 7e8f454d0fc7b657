"""Drives a scenario without a bus through renderer, LiDAR and perception, and compares tracks and boxes with the truth.

`python -m evaluation.training.detector_drive --scenario urb-rain --seconds 60` prints the figures of docs/perception.md.
Nobody advises here: the driver drives alone. Road users count where at least half of them is visible and they are 12 px
high in the front camera; signs and panels where their unoccluded face is 20 px high.
"""

from __future__ import annotations

import argparse
import json
import sys
import time
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

import cv2
import numpy as np

from drivemcp.paths import data
from evaluation.training.dataset import MIN_HEIGHT_PX, MIN_VISIBLE
from proto import topics
from proto.perception import Boxes, Track
from proto.sensors import CameraFrame, LidarSweep, MapView
from proto.truth import TrueActor, Truth
from proto.vehicle import Ego
from services.perception.detection import overlaps
from services.perception.loading import load_detector
from services.perception.pipeline import Perception, Seen
from services.simulator import sensors
from services.simulator.render import Label, Renderer
from services.simulator.scenario import load_scenario
from services.simulator.session import CAMERAS, Batch, Session

REACH_M = 60.0
NEAR_ENOUGH_M = 3.0
SIGN_PX = 20.0
JPEG_QUALITY = 85
EPOCH_NS = 1_000_000_000


@dataclass(frozen=True, slots=True, eq=False)
class Look:
    """One picture of the drive: what perception said, what was to be seen, what was so."""

    camera: str
    seen: Seen
    labels: list[Label]
    truth: Truth
    spent_s: float


@dataclass(slots=True)
class Figures:
    """Sums over a drive."""

    wanted: int = 0
    matched: int = 0
    ghosts: int = 0
    published: int = 0
    switches: int = 0
    gap_errors_m: list[float] = field(default_factory=list)
    side_errors_m: list[float] = field(default_factory=list)
    speed_errors_mps: list[float] = field(default_factory=list)
    lead_wanted: int = 0
    lead_right: int = 0
    lead_false: int = 0
    lead_free: int = 0
    signs: dict[tuple[str, int, int], list[int]] = field(default_factory=dict)
    sign_pictures: int = 0
    spent_s: list[float] = field(default_factory=list)
    owners: dict[int, int] = field(default_factory=dict)


def drive(scenario: str, seed: int, seconds: float, model: Path) -> Iterator[Look]:
    """The drive picture by picture."""
    plan = load_scenario(data(f"scenarios/{scenario}.toml"))
    session = Session(plan, seed, seconds=seconds, epoch_ns=EPOCH_NS, dbc=data("vehicles/sim/sim.dbc"), bus="car")
    renderer = Renderer(session.world.static, seed)
    perception = Perception(load_detector(model))
    for name, camera in CAMERAS.items():
        perception.calibrate(name, sensors.calibration(camera))
    while not session.finished:
        batch = session.advance()
        truth = _take_in(perception, batch)
        for shot in batch.shots:
            picture = renderer.render(shot.scene, CAMERAS[shot.camera])
            labels = renderer.render_labels(shot.scene, CAMERAS[shot.camera])
            frame = _coded(picture, shot.frame)
            started = time.thread_time()
            seen = perception.see(shot.camera, batch.stamp_ns, frame)
            yield Look(shot.camera, seen, labels, truth, time.thread_time() - started)
    renderer.close()


def _take_in(perception: Perception, batch: Batch) -> Truth:
    ego, truth = batch.moment.ego, None
    perception.ego(batch.stamp_ns, Ego(speed_mps=ego.speed_mps, yaw_rate_radps=ego.yaw_rate_radps))
    for out in batch.messages:
        if isinstance(out.message, LidarSweep):
            perception.sweep(batch.stamp_ns, out.message)
        elif isinstance(out.message, MapView):
            perception.map(batch.stamp_ns, out.message)
        elif isinstance(out.message, Truth):
            truth = out.message
    if truth is None:
        raise ValueError(f"a step without {topics.TRUTH.name}")
    return truth


def _coded(picture: np.typing.NDArray[np.uint8], number: int) -> CameraFrame:
    settings = [cv2.IMWRITE_JPEG_QUALITY, JPEG_QUALITY]
    jpeg = cv2.imencode(".jpg", cv2.cvtColor(picture, cv2.COLOR_RGB2BGR), settings)[1].tobytes()
    return CameraFrame(jpeg=jpeg, width_px=picture.shape[1], height_px=picture.shape[0], frame=number)


def count(figures: Figures, look: Look) -> None:
    """Add one picture."""
    figures.spent_s.append(look.spent_s)
    _count_signs(figures, look.camera, look.labels, look.seen.boxes)
    if look.seen.tracks is not None:
        tracks = look.seen.tracks.tracks
        _count_actors(figures, look, tracks)
        _count_lead(figures, look.truth, tracks, look.seen.tracks.lead_track_id)


def _count_actors(figures: Figures, look: Look, tracks: tuple[Track, ...]) -> None:
    plain = {
        label.id
        for label in look.labels
        if label.kind in ("vehicle", "pedestrian")
        and label.visible_fraction >= MIN_VISIBLE
        and label.box_px[3] - label.box_px[1] >= MIN_HEIGHT_PX
    }
    near = [track for track in tracks if 0 < track.x_m < REACH_M]
    figures.published += len(near)
    figures.ghosts += sum(
        not any(_gap_m(track, actor) < 2 * _reach_m(actor) for actor in look.truth.actors) for track in near
    )
    for actor in look.truth.actors:
        if actor.actor_id in plain and 0 < actor.x_m < REACH_M:
            figures.wanted += 1
            near = [track for track in tracks if track.kind == actor.kind and _gap_m(track, actor) < _reach_m(actor)]
            if near:
                _count_match(figures, actor, min(near, key=lambda track: _gap_m(track, actor)))


def _reach_m(actor: TrueActor) -> float:
    return NEAR_ENOUGH_M + 0.05 * actor.x_m


def _gap_m(track: Track, actor: TrueActor) -> float:
    """Between the near surfaces' middles."""
    return float(np.hypot(_near_m(track) - (actor.x_m - actor.length_m / 2), track.y_m - actor.y_m))


def _near_m(track: Track) -> float:
    return track.x_m - track.length_m / 2


def _count_match(figures: Figures, actor: TrueActor, track: Track) -> None:
    figures.matched += 1
    figures.switches += figures.owners.get(actor.actor_id, track.track_id) != track.track_id
    figures.owners[actor.actor_id] = track.track_id
    figures.gap_errors_m.append(_near_m(track) - (actor.x_m - actor.length_m / 2))
    figures.side_errors_m.append(track.y_m - actor.y_m)
    if track.age_s > 1.0:
        figures.speed_errors_mps.append(track.vx_mps - actor.vx_mps)


def _count_lead(figures: Figures, truth: Truth, tracks: tuple[Track, ...], lead: int | None) -> None:
    """The lead is right where its gap is the true one within 3 m or a tenth."""
    told = next((track for track in tracks if track.track_id == lead), None)
    if truth.gap_m is not None and truth.gap_m < REACH_M:
        figures.lead_wanted += 1
        gap = _near_m(told) - 2.25 if told is not None else None
        figures.lead_right += gap is not None and abs(gap - truth.gap_m) < max(3.0, 0.1 * truth.gap_m)
    elif truth.gap_m is None:
        figures.lead_free += 1
        figures.lead_false += told is not None


def _count_signs(figures: Figures, camera: str, labels: list[Label], boxes: Boxes) -> None:
    for label in labels:
        if label.kind in ("sign", "panel") and label.disc_px >= SIGN_PX and label.visible_fraction > 0.9:
            figures.sign_pictures += 1
            mine = [box for box in boxes.boxes if box.kind == label.kind]
            places = np.array([(b.x0_px, b.y0_px, b.x1_px, b.y1_px) for b in mine], np.float32).reshape(-1, 4)
            overlap = overlaps(np.array([label.box_px], np.float32), places)[0]
            owners = figures.signs.setdefault((camera, label.id, label.part), [])
            if len(overlap) and overlap.max() >= 0.5:
                owners.append(mine[int(overlap.argmax())].track_id)


def summary(figures: Figures) -> dict[str, float]:
    """The figures as they stand in the documentation."""
    found = [owners for owners in figures.signs.values() if owners]
    gap, side, speed = (
        np.abs(values) if values else np.zeros(1)
        for values in (figures.gap_errors_m, figures.side_errors_m, figures.speed_errors_mps)
    )
    return {
        "road_users_tracked": figures.matched / max(figures.wanted, 1),
        "ghost_share": figures.ghosts / max(figures.published, 1),
        "identity_switches": figures.switches,
        "road_users": len(figures.owners),
        "gap_error_median_m": float(np.median(gap)),
        "gap_error_p90_m": float(np.quantile(gap, 0.9)),
        "lateral_error_median_m": float(np.median(side)),
        "speed_error_median_mps": float(np.median(speed)),
        "speed_error_p90_mps": float(np.quantile(speed, 0.9)),
        "lead_right": figures.lead_right / max(figures.lead_wanted, 1),
        "lead_pictures": figures.lead_wanted,
        "lead_false": figures.lead_false / max(figures.lead_free, 1),
        "faces": len(figures.signs),
        "faces_found": len(found),
        "face_pictures_found": sum(map(len, found)) / max(figures.sign_pictures, 1),
        "tracks_per_found_face": sum(len(set(owners)) for owners in found) / max(len(found), 1),
        "ms_per_picture": 1e3 * float(np.mean(figures.spent_s)),
    }


def main() -> None:
    """Print the figures of one drive as JSON."""
    parser = argparse.ArgumentParser(prog="python -m evaluation.training.detector_drive")
    parser.add_argument("--scenario", default="urb-rain")
    parser.add_argument("--seconds", type=float, default=60.0)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--model", type=Path, default=None)
    flags = parser.parse_args()
    figures = Figures()
    for look in drive(flags.scenario, flags.seed, flags.seconds, flags.model or data("models/detector.onnx")):
        count(figures, look)
    rounded = {name: round(value, 3) for name, value in summary(figures).items()}
    sys.stdout.write(json.dumps({"scenario": flags.scenario, "seed": flags.seed, **rounded}, indent=1) + "\n")


if __name__ == "__main__":
    main()
