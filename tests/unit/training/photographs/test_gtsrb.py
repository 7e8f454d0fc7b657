"""Photographed signs are read in the layouts of their publisher and as a zip, and whole tracks are left out of training."""

import zipfile
from pathlib import Path

import cv2
import numpy as np
import pytest

from services.drivelm.reading.crops import Region
from services.drivelm.vocabulary.classes import OTHER, READER_CLASSES
from tests.shared import SHARED
from training.photographs.gtsdb import scenes
from training.photographs.gtsrb import CLASSES, NAMES, ZIP, decoded, is_held_out, signs

ROADS = SHARED / "data" / "roads"
needs_photographs = pytest.mark.skipif(
    not (ROADS / ZIP).is_file(),
    reason="no photographs at ../shared/data/roads (or DRIVEMCP_SHARED): they are not ours to ship",
)


def _picture(shade: int, side: int = 40) -> bytes:
    return bytes(cv2.imencode(".ppm", np.full((side, side, 3), shade, np.uint8))[1])


@pytest.fixture
def published(tmp_path: Path) -> Path:
    """GTSRB as its publisher ships it: two tracks of stop signs to train on, one picture to test with."""
    images = tmp_path / "Final_Training" / "Images" / "00014"
    images.mkdir(parents=True)
    rows = ["Filename;Width;Height;Roi.X1;Roi.Y1;Roi.X2;Roi.Y2;ClassId"]
    for name in ("00000_00000", "00000_00001", "00001_00000"):
        (images / f"{name}.ppm").write_bytes(_picture(90))
        rows.append(f"{name}.ppm;40;40;5;6;35;34;14")
    (images / "GT-00014.csv").write_text("\n".join(rows) + "\n", encoding="utf-8")
    test = tmp_path / "Final_Test" / "Images"
    test.mkdir(parents=True)
    (test / "00000.ppm").write_bytes(_picture(20))
    (tmp_path / "GT-final_test.csv").write_text(f"{rows[0]}\n00000.ppm;40;40;5;5;35;35;16\n", encoding="utf-8")
    return tmp_path


def test_the_published_layout_has_tracks_to_train_on_and_none_to_test_with(published: Path) -> None:
    found = signs(published)
    assert [(sign.track, sign.frame) for sign in found["Final_Training"]] == [(0, 0), (0, 1), (1, 0)]
    assert {sign.label for sign in found["Final_Training"]} == {"stop"}
    assert found["Final_Training"][0].region == Region(5, 6, 35, 34)
    (test,) = found["Final_Test"]
    assert test.track is None
    assert test.held_out
    assert test.label == OTHER
    assert test.picture().shape == (40, 40, 3)


def test_test_pictures_beside_their_table_are_found_too(published: Path) -> None:
    images = published / "Final_Test" / "Images"
    (published / "GT-final_test.csv").rename(images / "GT-final_test.csv")
    assert len(signs(published)["Final_Test"]) == 1


def test_a_zip_with_labels_is_read(tmp_path: Path) -> None:
    with zipfile.ZipFile(tmp_path / ZIP, "w") as stored:
        stored.writestr("stop/00003_00006.jpg", _picture(70))
        stored.writestr("labels.csv", "file,class,track,x1,y1,x2,y2\nstop/00003_00006.jpg,stop,00003,,,,\n")
    (sign,) = signs(tmp_path)[ZIP]
    assert (sign.track, sign.frame, sign.label) == (3, 6, "stop")
    assert sign.region == Region(4, 4, 36, 36), "of an unknown box the publisher left a tenth around it"


def test_scenes_are_read_as_published_with_those_that_have_no_sign(tmp_path: Path) -> None:
    for number in (4, 600):
        (tmp_path / f"{number:05d}.ppm").write_bytes(_picture(50))
    (tmp_path / "gt.txt").write_text("00600.ppm;1;2;30;31;14\n", encoding="utf-8")
    empty, other = scenes(tmp_path)
    assert not empty.signs
    assert other.signs[0].region == Region(1, 2, 30, 31)
    assert empty.held_out
    assert other.held_out
    assert other.picture().shape == (40, 40, 3)


def test_every_class_of_theirs_is_one_of_ours_or_other() -> None:
    assert len(NAMES) == len(set(NAMES)) == 43
    assert set(CLASSES) <= set(READER_CLASSES)
    assert CLASSES[NAMES.index("speed_limit_80")] == "limit:80"
    assert CLASSES[NAMES.index("no_overtaking_heavy_end")] == OTHER


def test_one_track_in_eight_of_each_class_is_left_out() -> None:
    shares = [np.mean([is_held_out(number, track) for track in range(64)]) for number in range(43)]
    assert set(shares) == {1 / 8}


def test_what_is_no_picture_is_refused() -> None:
    with pytest.raises(ValueError, match="cannot be decoded"):
        decoded(b"no picture")


@needs_photographs
def test_of_the_photographs_no_track_is_both_trained_on_and_left_out() -> None:
    found = signs(ROADS)[ZIP]
    left, kept = ({(sign.number, sign.track) for sign in found if sign.held_out == part} for part in (True, False))
    assert not left & kept
    assert {number for number, _ in kept} == set(range(43))
    assert len({number for number, _ in left}) == 42, "of the rarest class the zip has no such track"
