"""Vehicles withheld from perception, on a drive of a few seconds."""

from collections.abc import Sequence
from pathlib import Path

import pytest

from drivemcp.errors import UserError
from drivemcp.paths import data
from services.perception.detect.detection import Detection
from services.perception.detect.loading import load_detector
from services.simulator.render import RendererUnavailable
from studies.tracking.drop_outs import DropOut, drop_outs, withhold
from studies.tracking.errors import errors
from studies.tracking.pairing import scene
from studies.tracking.recording import DriveName, Step, recording
from studies.tracking.seeing import Noting, glances, see

NAME = DriveName(scenario="urb-rain", seed=1, seconds=4.0)


@pytest.fixture(scope="module")
def drive(tmp_path_factory: pytest.TempPathFactory) -> tuple[list[Step], list[list[Detection]]]:
    try:
        steps = recording(NAME, tmp_path_factory.mktemp("drives"))
    except RendererUnavailable as error:
        pytest.skip(str(error))
    noting = Noting(load_detector(data("models/detector.onnx")))
    assert len(list(glances(steps, noting))) == len(noting.found)
    return steps, noting.found


def test_a_drive_is_seen_again_alike_and_its_tracks_are_near_the_truth(
    drive: tuple[list[Step], list[list[Detection]]],
) -> None:
    steps, found = drive
    views = see(steps, found)
    assert [view.tracks for view in views] == [view.tracks for view in see(steps, found)]
    assert len(views) == 40
    assert errors([scene(view) for view in views]).gap_m < 0.5


def test_the_vehicle_withheld_loses_its_boxes_then_and_only_then(
    drive: tuple[list[Step], list[list[Detection]]],
) -> None:
    steps, found = drive
    lead = next(each.actor_id for each in steps[-1].truth.actors if each.in_ego_path)
    drop = DropOut(actor_id=lead, start_ns=steps[30].stamp_ns)
    left = list(withhold(steps, found, [drop]))
    fewer = [stamp_ns for stamp_ns, a, b in zip(_stamps(steps), found, left, strict=True) if len(b) < len(a)]
    assert fewer
    assert all(drop.start_ns <= stamp_ns < drop.end_ns for stamp_ns in fewer)


def test_a_followed_vehicle_is_withheld_and_keeps_its_id(drive: tuple[list[Step], list[list[Detection]]]) -> None:
    steps, found = drive
    tried = drop_outs(steps, found, [scene(view) for view in see(steps, found)], seed=1, runs=1)
    assert tried.tried >= 1
    assert tried.kept == tried.tried


def test_a_kept_drive_of_another_form_is_refused_by_name(tmp_path: Path) -> None:
    (tmp_path / NAME.file).write_bytes(b"\x93\x01\x02\x03")
    with pytest.raises(UserError, match=r"urb-rain-1-4\.msgpack"):
        recording(NAME, tmp_path)


def _stamps(steps: Sequence[Step]) -> list[int]:
    return [step.stamp_ns for step in steps for _ in step.looks]
