"""A second of a drive through renderer, LiDAR and perception, and all figures made of it; faces by hand-made boxes."""

from dataclasses import replace

import pytest

from drivemcp.paths import data
from proto.perception import Box, Boxes, ObjectClass
from proto.sensors import CameraFrame
from services.perception.detect.loading import load_detector
from services.perception.pipeline import Seen
from services.simulator.render import RendererUnavailable
from studies.tracking.faces import faces
from studies.tracking.measure import measure, sheet
from studies.tracking.recording import DriveName, Look
from studies.tracking.seeing import Glance
from tests.unit.studies.tracking.views import label, view
from training.labelling import Label


def test_a_drive_gives_figures_that_hold_together() -> None:
    pytest.importorskip("trackeval", reason="the extra `evaluation` is not installed")
    name = DriveName(scenario="urb-rain", seed=1, seconds=1.0)
    try:
        measured = measure(name, load_detector(data("models/detector.onnx")))
    except RendererUnavailable as error:
        pytest.skip(str(error))
    assert measured.pictures == 10
    assert measured.scores.vehicles > 0
    assert 0.3 < measured.scores.recall <= 1.0
    assert measured.errors.gap_m < 1.0
    assert measured.faces.found <= measured.faces.faces
    assert measured.ms_per_picture > 0
    assert len(sheet([measured]).rows) > 10


def test_a_face_counts_as_found_with_one_box_on_it_and_is_told_the_ids_it_had() -> None:
    """Three pictures of one face: found as 7, missed (the box lies beside), found as 8. A small face does not count."""
    large, small = face(1, 30.0), face(2, 15.0)
    glances = [glance((large, small), box) for box in (box_at(7, 0), box_at(7, 100), box_at(8, 0))]
    found = faces(glances)
    assert (found.faces, found.found, found.tracks_each) == (1, 1, 2.0)
    assert found.pictures_found == pytest.approx(2 / 3)


def test_a_vehicles_box_is_no_signs_and_a_drive_without_signs_has_none() -> None:
    assert faces([glance((face(1, 30.0),), box_at(7, 0, "vehicle"))]).found == 0
    assert faces([]).faces == 0


def face(sign_id: int, disc_px: float) -> Label:
    return replace(label(sign_id), kind="sign", disc_px=disc_px)


def box_at(track_id: int, aside_px: float, kind: ObjectClass = "sign") -> Box:
    x0, y0, x1, y1 = label(1).box_px
    return Box(
        track_id=track_id, kind=kind, score=0.9,
        x0_px=x0 + aside_px, y0_px=y0, x1_px=x1 + aside_px, y1_px=y1,
    )  # fmt: skip


def glance(labels: tuple[Label, ...], box: Box) -> Glance:
    picture = CameraFrame(jpeg=b"", width_px=640, height_px=360, frame=1)
    look = Look(camera="front", frame=picture, labels=labels)
    return Glance(0, look, view((), (), ()).truth, Seen(boxes=Boxes(camera="front", frame=1, boxes=(box,))), 0.01)
