"""`studies real` measures signs and scenes in the layouts of their publisher, here filled with drawn ones."""

import json
from pathlib import Path

import cv2
import numpy as np
import pytest

from drivemcp.errors import UserError
from services.drivelm.reading.crops import Region
from services.drivelm.vocabulary.classes import OTHER, READER_CLASSES
from services.perception.detect.detection import Detection
from services.simulator.signart import draw_face
from studies.real.__main__ import main
from studies.real.approaches import Approach
from studies.real.approaches import table as approach_table
from studies.real.scenes import Seen
from studies.real.scenes import table as scene_table
from training.photographs.gtsrb import NAMES, RealSign
from training.reader.real.scores import SURE_AND_WRONG, sure_on, table
from training.reader.scores import Sure


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """One approach of a limit of 80, as drawn, in the layout of GTSRB's training set."""
    images = tmp_path / "Final_Training" / "Images" / "00005"
    images.mkdir(parents=True)
    rows = ["Filename;Width;Height;Roi.X1;Roi.Y1;Roi.X2;Roi.Y2;ClassId"]
    for frame, size in enumerate(range(24, 54, 6)):
        face = draw_face("DEU", "limit:80", font=0, size_px=size)
        picture = np.full((size + 12, size + 12, 3), 135, np.uint8)
        share = face[..., 3:] / 255
        picture[6 : 6 + size, 6 : 6 + size] = (face[..., :3] * share + 135 * (1 - share)).astype(np.uint8)
        name = f"00005_{frame:05d}.ppm"
        cv2.imwrite(str(images / name), picture[..., ::-1])
        rows.append(f"{name};{size + 12};{size + 12};6;6;{size + 6};{size + 6};5")
    (images / "GT-00005.csv").write_text("\n".join(rows) + "\n", encoding="utf-8")
    return tmp_path


def test_crops_of_a_published_folder_are_read(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["reader", str(folder), "--all"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert told["set"] == "Final_Training"
    assert told["limits of 24 px and more"] == told["limits"]
    assert told["limits"]["crops"] == 5
    assert told["limits"]["right"] == 1.0


def test_a_track_is_driven_as_one_approach(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["approaches", str(folder), "--all"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert told["limits"] == {
        "approaches": 1,
        "believed right": 1.0,
        "ever believed wrong": 0.0,
        "ever believed higher": 0.0,
    }


def test_a_folder_without_photographs_is_said_to_hold_none(tmp_path: Path) -> None:
    for what in ("reader", "approaches", "scenes"):
        with pytest.raises(UserError, match="holds nothing to measure"):
            main([what, str(tmp_path)])


def test_a_lower_limit_believed_is_wrong_and_not_higher_and_an_unknown_sign_is_no_limit() -> None:
    lower, unknown = Approach("limit:80", 5, 40, ("limit:30", "limit:80")), Approach(OTHER, 42, 40, ("limit_end",))
    told = approach_table([lower, unknown, Approach(OTHER, 42, 40, ())])
    assert told["limits"] == {
        "approaches": 1,
        "believed right": 1.0,
        "ever believed wrong": 1.0,
        "ever believed higher": 0.0,
    }
    assert told["unknown"] == {"approaches": 2, "ever believed known": 0.5}
    assert told["mistakes"] == {"limit:80 (5) as limit:30": 1, "other (42) as limit_end": 1}


def _told(label: str, share: float, count: int) -> np.ndarray:
    told = np.zeros((count, len(READER_CLASSES)), np.float32)
    told[:, READER_CLASSES.index(label)] = share
    return told


def test_an_unknown_sign_that_is_surely_told_as_known_counts_as_sure_and_wrong() -> None:
    sign = RealSign(b"", Region(0, 0, 30, 30), NAMES.index("rough_road"), 1)
    told = table(_told("crossing", 0.97, 2), [sign, sign], Sure(0.9, 0.95))
    assert told["other"] == {"crops": 2, "right": 0.0, "sure and right": 0.0, "sure and wrong": 1.0}


def test_from_the_threshold_chosen_on_photographs_few_enough_are_wrong() -> None:
    unknown = RealSign(b"", Region(0, 0, 30, 30), NAMES.index("rough_road"), 1)
    stop = RealSign(b"", Region(0, 0, 30, 30), NAMES.index("stop"), 1)
    told, found = np.concatenate([_told("crossing", 0.93, 5), _told("stop", 0.99, 995)]), [unknown] * 5 + [stop] * 995
    sure = sure_on(told, found)
    assert sure.large >= 0.93
    assert table(told, found, sure)["other"]["sure and wrong"] <= SURE_AND_WRONG
    assert sure.small == 0.9, "without small signs nothing is asked of them"


def _box(kind: str, x0: float, score: float = 0.8, side: float = 40) -> Detection:
    return Detection(x0_px=x0, y0_px=100, x1_px=x0 + side, y1_px=100 + side, kind=kind, score=score)  # type: ignore[arg-type]


def test_scenes_count_found_signs_and_what_the_judge_does_not_see() -> None:
    labelled = np.array([[0, 100, 40, 140], [300, 100, 340, 140]], np.float32)
    found = [_box("sign", 2), _box("pedestrian", 500), _box("pedestrian", 700)]
    judged = [_box("pedestrian", 702), _box("vehicle", 900)]
    told = scene_table([Seen(labelled, found, judged, (300, 400))], judged=True)
    assert told["recall of signs"]["24 px and more"] == {"signs": 2, "found": 0.5}
    assert told["AP50 of signs"] == 0.5
    assert told["people a picture that the judge does not see"] == 1.0
    assert told["vehicles that the judge is sure of"] == {"count": 1, "found": 0.0}
