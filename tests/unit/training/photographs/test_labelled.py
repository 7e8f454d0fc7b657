"""Photographs come with their boxes in our classes; what is upside down is left out, and pasted signs stand where they are told."""

import zipfile
from pathlib import Path

import cv2
import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from proto.perception import ObjectClass
from services.drivelm.reading.crops import Picture, Region
from services.perception.detect.detection import Detection
from training.dataset.shards import CLASSES
from training.photographs.gtsrb import RealSign
from training.photographs.labelled import Light, Photograph, is_held_out, is_upright, photographs
from training.photographs.pasting import pasted
from training.photographs.shards import PASTED, WINDOWS, rows_of, shots_of


def _jpeg(picture: Picture) -> bytes:
    return bytes(cv2.imencode(".jpg", cv2.cvtColor(picture, cv2.COLOR_RGB2BGR))[1])


def _light(lit: int, lamp: tuple[int, int, int]) -> Picture:
    """A grey picture with a dark head in its middle, one of its three thirds lit."""
    picture = np.full((120, 120, 3), 128, np.uint8)
    picture[30:90, 50:70] = 20
    picture[30 + 20 * lit : 50 + 20 * lit, 50:70] = lamp
    return picture


class Sees:
    """A detector that finds what it was given."""

    name = "sees"

    def __init__(self, *found: Detection) -> None:
        self.found = list(found)

    def detect(self, rgb: Picture, *, closer: bool = False) -> list[Detection]:
        return [each for each in self.found if each.x1_px <= rgb.shape[1] and each.y1_px <= rgb.shape[0]]


def _found(kind: ObjectClass, score: float, x0: float = 10.0) -> Detection:
    return Detection(kind=kind, score=score, x0_px=x0, y0_px=10.0, x1_px=x0 + 20.0, y1_px=40.0)


def _written(folder: Path) -> Path:
    red, turned = _light(0, (230, 10, 10)), _light(2, (230, 10, 10))
    with zipfile.ZipFile(folder / "traffic-lights.zip", "w") as stored:
        for name, picture in (("0000", red), ("0001", turned)):
            stored.writestr(f"images/{name}.jpg", _jpeg(picture))
            stored.writestr(f"labels/{name}.txt", "1 0.5 0.5 0.1667 0.5\n")
    with zipfile.ZipFile(folder / "road-signs-877.zip", "w") as stored:
        stored.writestr("road0.jpg", _jpeg(red))
        stored.writestr(
            "labels.csv", "file,x1,y1,x2,y2,class\nroad0.jpg,1,2,30,40,stop\nroad0.jpg,50,30,70,90,trafficlight\n"
        )
    return folder


def test_a_light_that_is_upside_down_is_left_out(tmp_path: Path) -> None:
    signs, lights = photographs(_written(tmp_path), held_out=False)
    assert lights.name == "images/0000.jpg"
    assert lights.whole == {"light"}
    assert np.allclose(lights.boxes["light"][0], Region(50, 30, 70, 90), atol=0.1)
    assert signs.boxes == {"sign": (Region(1, 2, 30, 40),), "light": (Region(50, 30, 70, 90),)}
    assert not signs.whole, "of the 877-set's pictures only some classes are labelled"


def test_a_set_can_be_left_out(tmp_path: Path) -> None:
    (lights,) = photographs(_written(tmp_path), held_out=False, without=["road-signs-877"])
    assert lights.name == "images/0000.jpg"


def test_ten_in_a_row_are_left_out_of_training_together() -> None:
    left = [is_held_out(f"road{number}.png") for number in range(160)]
    assert left == [number // 10 % 8 == 4 for number in range(160)]


def test_a_lamp_belongs_in_its_third() -> None:
    region = Region(50, 30, 70, 90)
    assert is_upright(_light(0, (230, 10, 10)), Light("red", region))
    assert not is_upright(_light(2, (230, 10, 10)), Light("red", region))
    assert is_upright(_light(2, (10, 230, 60)), Light("green", region))


def _photograph(*signs: Region, whole: bool = True) -> Photograph:
    picture = np.random.default_rng(3).integers(0, 256, (800, 1360, 3)).astype(np.uint8)
    return Photograph("one", picture, {"sign": signs}, frozenset({"sign"} if whole else ()))


def test_what_the_teacher_doubts_and_what_looks_like_a_sign_is_ignored() -> None:
    teacher = Sees(_found("vehicle", 0.9), _found("pedestrian", 0.3, 200.0), _found("light", 0.9, 500.0))
    ours = Sees(_found("sign", 0.5, 300.0), _found("sign", 0.9, 800.0))
    rows = rows_of(_photograph(Region(800, 10, 820, 40)), teacher, ours)
    told = {(CLASSES[int(row[0])], float(row[1]), float(row[5])) for row in rows}
    assert {("vehicle", 10.0, 1.0), ("pedestrian", 200.0, 0.0), ("light", 500.0, 1.0)} <= told
    assert {("sign", 300.0, 0.0), ("panel", 300.0, 0.0), ("sign", 800.0, 1.0)} <= told
    assert ("panel", 800.0, 0.0) not in told, "a labelled sign is no panel"


def test_where_not_all_signs_are_labelled_the_rest_of_the_picture_is_neither_sign_nor_none() -> None:
    rows = rows_of(_photograph(Region(800, 10, 820, 40), whole=False), Sees(), Sees())
    wide = rows[rows[:, 3] == 1360]
    assert {CLASSES[int(kind)] for kind in wide[:, 0]} == {"sign", "panel"}
    assert (wide[:, 5] == 0).all()


def test_a_large_picture_is_shown_whole_and_in_windows_some_with_pasted_signs() -> None:
    photograph = _photograph(Region(400, 300, 430, 330))
    rows = rows_of(photograph, Sees(), Sees())
    shots = list(shots_of(photograph, rows, [_sign(), _sign()], WINDOWS + PASTED, np.random.default_rng(4)))
    assert len(shots) == 1 + WINDOWS + PASTED
    whole, near = shots[0].objects, shots[1].objects
    assert np.allclose(whole[0, 1:5], np.array([400, 300, 430, 330]) * 640 / 1360, atol=0.5)
    assert np.isclose(near[0, 4] - near[0, 2], 30 * 1280 / 1360, atol=0.5), "a window shows it as the closer look does"
    assert sum(len(shot.objects) for shot in shots[1 + WINDOWS :]) >= PASTED


def _sign() -> RealSign:
    picture = np.full((60, 60, 3), 200, np.uint8)
    return RealSign(_jpeg(picture), Region(6, 6, 54, 54), 14, 1)


@given(seed=st.integers(0, 10_000), count=st.integers(0, 6))
def test_pasted_signs_touch_nothing_and_change_the_picture_only_where_they_are(seed: int, count: int) -> None:
    picture = np.full((240, 320, 3), 90, np.uint8)
    taken = [Region(100, 40, 180, 120)]
    out, put = pasted(picture, [_sign()], taken, np.random.default_rng(seed), count)
    changed = (out != picture).any(axis=2)
    for region in put:
        assert 0 <= region.x0_px < region.x1_px <= 320
        assert 0 <= region.y0_px < region.y1_px <= 240
        x0, y0, x1, y1 = (round(edge) for edge in region)
        assert changed[y0:y1, x0:x1].mean() > 0.3
        changed[y0:y1, x0:x1] = False
    assert not changed.any()
    assert len(put) <= count


def test_a_red_and_white_beacon_is_a_mistake_and_no_person() -> None:
    picture = np.full((800, 1360, 3), 100, np.uint8)
    picture[10:40, 10:30] = 235
    for row in (10, 20, 30):
        picture[row : row + 4, 10:30] = (200, 20, 20)
    photograph = Photograph("one", picture, {}, frozenset({"sign"}))
    found = _found("pedestrian", 0.9), _found("pedestrian", 0.9, 500.0)
    rows = rows_of(photograph, Sees(*found), Sees())
    people = rows[rows[:, 2] == 10]  # the parts of the picture that the teacher sees show its boxes elsewhere
    assert 500.0 in people[:, 1]
    assert 10.0 not in people[:, 1], "the beacon has no row, not even to be ignored"
