"""The graph of what is really there: boxes by the renderer's labels, motion by the simulator, readings as drawn."""

from __future__ import annotations

from proto.perception import Box, Track
from proto.scene import Fact, SceneGraph
from proto.truth import TrueActor
from services.drivelm.graph.scene_graph import Seen, build
from services.drivelm.reading.facts import public_code
from services.drivelm.vocabulary.classes import SENTENCES
from services.drivelm.vocabulary.jurisdictions import unit_of
from services.drivelm.vocabulary.parser import statement_of
from services.simulator.sensors import measurements
from services.simulator.session import CAMERAS
from studies.tracking.recording import Look, Step
from training.dataset.shards import MIN_HEIGHT_PX, MIN_VISIBLE
from training.labelling import Label
from training.sign_pictures.avenue import class_of

READABLE_PX = 20.0
"""Signs and lights from this height on count: smaller ones are not to be read yet (docs/explanation/perception.md)."""
_ELEMENTS_FROM = 1_000_000
_ONCOMING_MPS = -1.5


def true_graph(step: Step, look: Look) -> SceneGraph:
    """What a graph of the picture should hold."""
    wanted = [label for label in look.labels if _counts(label)]
    return build(
        Seen(
            camera=look.camera,
            frame=look.frame.frame,
            boxes=[_box(label) for label in wanted],
            tracks=[_track(actor, step.truth.speed_mps) for actor in step.truth.actors],
            facts=[_fact(label, look.camera) for label in wanted if label.kind not in ("vehicle", "pedestrian")],
            ego=step.ego,
            backend="truth",
        )
    )


def _counts(label: Label) -> bool:
    is_actor = label.kind in ("vehicle", "pedestrian")
    height_px = label.full_box_px[3] - label.full_box_px[1]
    is_large = height_px >= (MIN_HEIGHT_PX if is_actor else READABLE_PX)
    return label.visible_fraction >= MIN_VISIBLE and is_large and (is_actor or class_of(label) is not None)


def _track_id(label: Label) -> int:
    return label.id if label.kind in ("vehicle", "pedestrian") else _ELEMENTS_FROM + 16 * label.id + label.part


def _box(label: Label) -> Box:
    x0, y0, x1, y1 = label.box_px
    return Box(x0_px=x0, y0_px=y0, x1_px=x1, y1_px=y1, kind=label.kind, score=1.0, track_id=_track_id(label))


def _track(actor: TrueActor, ego_mps: float) -> Track:
    return Track(
        track_id=actor.actor_id,
        kind=actor.kind,  # type: ignore[arg-type]
        x_m=actor.x_m,
        y_m=actor.y_m,
        vx_mps=actor.vx_mps,
        vy_mps=actor.vy_mps,
        length_m=actor.length_m,
        confidence=1.0,
        in_ego_path=actor.in_ego_path,
        oncoming=ego_mps + actor.vx_mps < _ONCOMING_MPS,
    )


def _fact(label: Label, camera: str) -> Fact:
    reading = class_of(label) or ""
    statement = statement_of(reading)
    focal_px, middle_px = (
        measurements.calibration(CAMERAS[camera]).fx_px,
        measurements.calibration(CAMERAS[camera]).cx_px,
    )
    right_px = (label.box_px[0] + label.box_px[2]) / 2 - middle_px
    return Fact(
        kind=statement.kind,
        reading=public_code(reading),
        confidence=1.0,
        frame_stamp_ns=0,
        track_id=_track_id(label),
        camera=camera,
        value=statement.value,
        unit=unit_of(label.country) if statement.value is not None else None,
        distance_m=label.distance_m,
        lateral_m=-right_px / focal_px * label.distance_m,
        sentence=SENTENCES[reading],
    )
