"""Crops of photographs to train on: sets that are left out, signs that a mirror changes, unknown signs that are drawn."""

import zipfile
from pathlib import Path

import cv2
import numpy as np
import pytest

from services.drivelm.reading.crops import Region
from services.drivelm.vocabulary.classes import OTHER, READER_CLASSES
from training.photographs.gtsrb import NAMES, ZIP
from training.photographs.sets import SETS, carded, present
from training.reader.real.augment import flipped, seen
from training.reader.real.crops import collect
from training.sign_pictures.unknown import unknown_face

PICTURE = np.random.default_rng(1).integers(0, 255, (60, 60, 3)).astype(np.uint8)
BOX = Region(8, 8, 52, 52)


def test_a_set_that_is_left_out_or_absent_is_named_in_the_card(tmp_path: Path) -> None:
    (tmp_path / ZIP).write_bytes(b"")
    (tmp_path / "gtsdb-0-599.zip").write_bytes(b"")
    used = present(tmp_path, without=["gtsrb"])
    assert [each.name for each in used] == ["gtsdb"]
    card = carded(used)
    assert card["left_out"] == ["gtsrb", "road-signs-877", "traffic-lights"]
    assert present(None) == ()


def test_a_set_that_there_is_not_cannot_be_left_out(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="imagenet"):
        present(tmp_path, without=["imagenet"])


def test_every_set_names_publisher_and_licence() -> None:
    assert all(each.publisher and each.licence for each in SETS)


@pytest.mark.parametrize(
    ("name", "now"), [("right_obstacle", "keep_left"), ("speed_limit_70", OTHER), ("priority_road", "priority_road")]
)
def test_a_mirror_makes_another_sign_of_some(name: str, now: str) -> None:
    chance = np.random.default_rng(1)
    assert {sample.label for _ in range(20) for sample in flipped(PICTURE, BOX, NAMES.index(name), chance)} <= {
        now,
        OTHER,
    }
    assert now in {sample.label for _ in range(20) for sample in flipped(PICTURE, BOX, NAMES.index(name), chance)}


def test_a_sign_that_reads_the_same_in_a_mirror_is_not_mirrored() -> None:
    assert not list(flipped(PICTURE, BOX, NAMES.index("speed_limit_80"), np.random.default_rng(1)))


def test_variants_are_crops_of_the_reader_and_the_same_for_the_same_seed() -> None:
    ours, again = (
        [sample for _ in range(9) for sample in seen(PICTURE, BOX, "stop", np.random.default_rng(3))] for _ in range(2)
    )
    assert {sample.crop.shape for sample in ours} == {(48, 48, 3)}
    assert all(np.array_equal(one.crop, other.crop) for one, other in zip(ours, again, strict=True))


def test_tracks_are_either_trained_on_or_left_out(tmp_path: Path) -> None:
    rows = ["file,class,track,x1,y1,x2,y2"]
    with zipfile.ZipFile(tmp_path / ZIP, "w") as stored:
        for track in range(8):
            stored.writestr(f"stop/{track:05d}_00000.jpg", bytes(cv2.imencode(".png", PICTURE)[1]))
            rows.append(f"stop/{track:05d}_00000.jpg,stop,{track:05d},8,8,52,52")
        stored.writestr("labels.csv", "\n".join(rows))
    held_out = collect(tmp_path, 1, True)
    assert [READER_CLASSES[label] for label in held_out[1]] == ["stop"]
    trained = collect(tmp_path, 1, False)
    assert READER_CLASSES.index("stop") in trained[1]
    assert len(trained[0]) > 7 * 2
    assert (trained[2][trained[1] == 0] == 0).all()


def test_unknown_signs_are_drawn_and_differ() -> None:
    chance = np.random.default_rng(5)
    faces = [unknown_face(chance).picture for _ in range(40)]
    assert all(face.shape == (112, 112, 4) and face[..., 3].max() == 255 for face in faces)
    assert len({face.tobytes() for face in faces}) == len(faces)
