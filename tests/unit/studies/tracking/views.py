"""Pictures with vehicles and tracks, made by hand."""

from proto.perception import Track, Tracks
from proto.sensors import CameraFrame
from proto.truth import TrueActor, Truth
from studies.tracking.recording import Look
from studies.tracking.seeing import View
from training.labelling import Label

BOX = (300.0, 150.0, 340.0, 180.0)


def actor(actor_id: int, x_m: float, y_m: float = 0.0, vx_mps: float = 0.0, *, in_ego_path: bool = False) -> TrueActor:
    return TrueActor(
        actor_id=actor_id, kind="vehicle", x_m=x_m, y_m=y_m, vx_mps=vx_mps, vy_mps=0.0, length_m=4.5, width_m=1.8,
        in_ego_path=in_ego_path,
    )  # fmt: skip


def label(actor_id: int, visible: float = 1.0) -> Label:
    return Label(
        id=actor_id,
        kind="vehicle",
        box_px=BOX,
        full_box_px=BOX,
        visible_fraction=visible,
        distance_m=20,
        visible_px=900,
    )


def track(track_id: int, x_m: float, y_m: float = 0.0, vx_mps: float = 0.0, age_s: float = 2.0) -> Track:
    return Track(track_id=track_id, kind="vehicle", x_m=x_m, y_m=y_m, vx_mps=vx_mps, vy_mps=0.0, age_s=age_s)


def view(
    actors: tuple[TrueActor, ...],
    labels: tuple[Label, ...],
    tracks: tuple[Track, ...],
    *,
    lead: int | None = None,
    at_s: float = 0.0,
) -> View:
    truth = Truth(
        time_s=at_s, distance_m=0.0, speed_mps=15.0, acceleration_mps2=0.0, law_limit_mps=None, jurisdiction="DEU",
        mu=0.8, gap_m=None, closing_mps=None, actors=actors,
    )  # fmt: skip
    look = Look(camera="front", frame=CameraFrame(jpeg=b"", width_px=640, height_px=360, frame=1), labels=labels)
    told = Tracks(camera="front", frame=1, tracks=tracks, lead_track_id=lead)
    return View(round(at_s * 1e9), look, truth, told)
