"""Scores of our detector as probabilities, by its card."""

import json
import math
import shutil
from pathlib import Path

import cv2
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from drivemcp.paths import data
from services.perception.detect.centre_point import (
    BESIDE_PX,
    CANVAS_PX,
    CLOSER_PX,
    MOST_ENLARGED,
    SIDES_PX,
    formed,
    strip,
    strip_rows,
    whole,
)
from services.perception.detect.detection import Detection, overlaps
from services.perception.detect.detector import DetectorOptions, Picture
from services.perception.detect.loading import load_detector
from services.simulator.render.device.context import RendererUnavailable
from services.simulator.scene.scene import FRONT, Actor, Lane, Pose, Road, Scene, StaticWorld
from training.labelling import LabellingRenderer

Edges = np.typing.NDArray[np.float32]
TOLD_FROM = 0.15
"""The score from which a driver can be told of a person."""


def with_curve(folder: Path, slope: float, offset: float) -> Path:
    path = folder / "detector.onnx"
    shutil.copytree(data("models"), folder, dirs_exist_ok=True)
    card = json.loads(data("models/detector.json").read_text(encoding="utf-8"))
    card["calibration"] = {kind: [slope, offset] for kind in card["classes"]}
    path.with_suffix(".json").write_text(json.dumps(card), encoding="utf-8")
    return path


def test_the_cards_curve_bends_scores_and_moves_no_box(street: Picture, tmp_path: Path) -> None:
    plain = load_detector(with_curve(tmp_path, 1.0, 0.0)).detect(street)
    bent = load_detector(with_curve(tmp_path, 2.0, 0.5)).detect(street)
    assert [(each.kind, each.x0_px, each.y1_px) for each in plain] == [
        (each.kind, each.x0_px, each.y1_px) for each in bent
    ]
    for before, after in zip(plain, bent, strict=True):
        odds = math.log(before.score / (1 - before.score))
        assert after.score == pytest.approx(1 / (1 + math.exp(-(2.0 * odds + 0.5))), abs=1e-3)


@pytest.mark.parametrize(("height_px", "width_px"), [(1, 2000), (2000, 1), (4, 8192), (1, 1)])
def test_a_picture_thinner_than_a_pixel_of_the_canvas_still_fits_on_it(height_px: int, width_px: int) -> None:
    canvas, _ = whole(np.full((height_px, width_px, 3), 200, np.uint8))
    assert canvas.max() == 200


@pytest.mark.parametrize("size", [(360, 640), (800, 1360), (768, 1024), (1024, 2048), (300, 2000), (400, 300)])
def test_the_closer_look_distorts_no_picture_and_has_the_horizon(size: tuple[int, int]) -> None:
    height, width = size
    top, bottom = strip_rows(height, width)
    assert 0 <= top < 0.5 * height < bottom <= height
    disc = np.zeros((*size, 3), np.uint8)
    cv2.circle(disc, (width // 2, (top + bottom) // 2), (bottom - top) // 4, (255,) * 3, -1)
    canvas, shown, scale = strip(disc)
    rows, columns = np.nonzero(canvas[0, :, :, 0] > 127)
    assert canvas[0, :, :, 0].size <= np.prod(CLOSER_PX)
    assert scale <= 1.1 * MOST_ENLARGED, "by a canvas rounded up to 32 px"
    assert np.ptp(columns) == pytest.approx(np.ptp(rows), abs=2)
    assert shown == (top, bottom)
    assert columns.mean() / scale == pytest.approx(width / 2, abs=1)


@given(st.integers(1, 5000), st.integers(1, 5000))
def test_no_form_of_a_picture_costs_more_than_our_cameras(height_px: int, width_px: int) -> None:
    for size_px, most in ((BESIDE_PX, math.inf), (CANVAS_PX, math.inf), (CLOSER_PX, MOST_ENLARGED)):
        height, width = formed((height_px, width_px), size_px, most)
        assert height * width <= np.prod(size_px)
        assert height % SIDES_PX == width % SIDES_PX == 0 < min(height, width)


def test_our_cameras_pictures_and_upright_ones_are_looked_at_as_large_as_may_be() -> None:
    assert [formed((360, 640), size_px) for size_px in (BESIDE_PX, CANVAS_PX)] == [BESIDE_PX, CANVAS_PX]
    assert formed((144, 640), CLOSER_PX, MOST_ENLARGED) == CLOSER_PX
    height, width = formed((400, 300), BESIDE_PX)
    assert min(height / 400, width / 300) > 1.4 * min(BESIDE_PX[0] / 400, BESIDE_PX[1] / 300)


def of_kind(found: list[Detection], kind: str = "pedestrian") -> Edges:
    boxes = [(d.x0_px, d.y0_px, d.x1_px, d.y1_px) for d in found if d.kind == kind]
    return np.array(boxes, dtype=np.float32).reshape(-1, 4)


def straight_road() -> tuple[StaticWorld, LabellingRenderer]:
    line = np.array([(x, 0.0) for x in np.arange(-20.0, 200.0, 5.0)])
    static = StaticWorld(road=Road(lanes=(Lane(centre_m=line, left="dashed", right="edge"),)))
    try:
        return static, LabellingRenderer(static)
    except RendererUnavailable as error:
        pytest.skip(str(error))


def test_a_closer_look_finds_people_that_are_small_each_once_and_where_they_are() -> None:
    static, renderer = straight_road()
    detector, plain, closer = load_detector(data("models/detector.onnx")), 0, 0
    for look in range(20):
        place = Pose(x_m=30.0 + 1.5 * look, y_m=-3.0 if look % 2 else 2.5, yaw_rad=1.5 * look)
        person = Actor(
            id=1, kind="pedestrian", pose=place, length_m=0.5, width_m=0.5, height_m=1.75, look_seed=look
        )  # fmt: skip
        scene = Scene(static=static, ego=Pose(x_m=0.0, y_m=0.0), actors=(person,))
        picture, (label,) = renderer.render(scene, FRONT), renderer.render_labels(scene, FRONT)
        there = np.array([label.box_px], dtype=np.float32)
        with_closer = of_kind(detector.detect(picture, closer=True))
        plain += bool((overlaps(there, of_kind(detector.detect(picture))) >= 0.5).any())
        closer += bool((overlaps(there, with_closer) >= 0.5).any())
        assert len(with_closer) <= 1, "one that was seen twice is still one"
    renderer.close()
    assert closer > plain, (closer, plain)
    assert closer >= 17


def is_half_of_another(box: Edges, boxes: Edges) -> bool:
    """Whether it ends where the closer look ends, and lies in a box that goes on."""
    _, top, _, bottom = box
    rows = strip_rows(360, 640)
    cut = top < rows[0] + 8 or bottom > rows[1] - 8
    low, high = np.maximum(box[:2], boxes[:, :2]), np.minimum(box[2:], boxes[:, 2:])
    inside = np.prod(np.maximum(high - low, 0.0), axis=1) / np.prod(box[2:] - box[:2])
    larger = np.prod(boxes[:, 2:] - boxes[:, :2], axis=1) > np.prod(box[2:] - box[:2])
    return bool(cut and rows[0] <= top and bottom <= rows[1] and (larger & (inside > 0.7)).any())


def test_of_near_vehicles_that_the_closer_look_cuts_there_is_one_box_each() -> None:
    static, renderer = straight_road()
    detector = load_detector(data("models/detector.onnx"))
    for look in range(20, 93):
        rng = np.random.default_rng(look)
        nearest_m, side = rng.uniform(5.0, 12.0), 1 if look % 2 else -1
        parked = tuple(
            Actor(
                id=number + 1, kind="van" if look % 3 == 2 and not number else "saloon", look_seed=7 * look + number,
                pose=Pose(x_m=nearest_m + 6.2 * number, y_m=side * rng.uniform(2.5, 3.2)),
                length_m=4.5, width_m=1.9, height_m=2.3 if look % 3 == 2 and not number else 1.5,
            )
            for number in range(1 + look % 3)
        )  # fmt: skip
        picture = renderer.render(Scene(static=static, ego=Pose(x_m=0.0, y_m=0.0), actors=parked), FRONT)
        found = of_kind(detector.detect(picture, closer=True), "vehicle")
        assert not [box for box in found if is_half_of_another(box, found)], f"look {look}: {found.round().tolist()}"
    renderer.close()


def test_what_the_whole_picture_shows_well_stays_where_it_is(street: Picture) -> None:
    detector = load_detector(data("models/detector.onnx"))
    plain, closer = (
        [each for each in detector.detect(street, closer=closer) if each.score >= TOLD_FROM] for closer in (False, True)
    )
    assert sorted(each.kind for each in closer) == sorted(each.kind for each in plain)
    for before, after in zip(by_kind(plain), by_kind(closer), strict=True):
        edges = [(each.x0_px, each.y0_px, each.x1_px, each.y1_px) for each in (before, after)]
        assert float(overlaps(*np.array(edges, dtype=np.float32)[:, None])[0, 0]) > 0.7


@pytest.mark.parametrize("size", [(1, 1), (2, 300), (4, 4), (5, 700), (37, 20), (1080, 1920)])
def test_pictures_of_any_size_are_looked_at_closer(size: tuple[int, int]) -> None:
    grey = np.full((*size, 3), 110, np.uint8)
    assert load_detector(data("models/detector.onnx")).detect(grey, closer=True) == []


def test_two_looks_side_by_side_find_what_one_after_the_other_finds(street: Picture) -> None:
    one, two = (load_detector(data("models/detector.onnx"), DetectorOptions(threads=n)) for n in (1, 2))
    for _ in range(5):
        assert two.detect(street, closer=True) == one.detect(street, closer=True)
        assert two.detect(street) == one.detect(street)


def by_kind(found: list[Detection]) -> list[Detection]:
    return sorted(found, key=lambda each: (each.kind, each.x0_px))
