"""What may be of a class, looked at once more: squares and boxes, what the two words weigh, and what the detector makes of it."""

import json
import shutil
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from drivemcp.paths import data
from services.perception.detect.detection import FloatArray, overlaps
from services.perception.detect.detector import DetectorError, DetectorOptions, Picture
from services.perception.detect.loading import digest, load_detector
from services.perception.detect.second_look import AROUND, MOST, SIDE_PX, SecondLook, boxes_in, cut, windows
from services.simulator.render.device.context import RendererUnavailable
from services.simulator.scene.scene import FRONT, Actor, Lane, Pose, Road, Scene, StaticWorld
from training.labelling import LabellingRenderer

edges = st.floats(-20.0, 600.0)
sizes = st.floats(1.0, 300.0)


class Sure:
    """A network that says the same of everything: log-odds, and edges in shares of the square."""

    def __init__(self, odds: float, sides: tuple[float, float, float, float] = (-0.1, -0.2, 0.1, 0.2)) -> None:
        self.odds, self.sides, self.asked = odds, sides, 0

    def run(self, names: list[str], inputs: dict[str, Any]) -> list[FloatArray]:
        count = len(inputs["pictures"])
        self.asked += count
        return [np.full(count, self.odds, np.float32), np.tile(np.array(self.sides, np.float32), (count, 1))]


@given(edges, edges, sizes, sizes)
def test_a_box_told_as_its_own_edges_in_its_square_is_where_it_was(
    x: float, y: float, wide: float, high: float
) -> None:
    box = np.array([[x, y, x + wide, y + high]], np.float32)
    seen = windows(box)
    sides = (box - np.tile(seen[:, :2], 2)) / seen[:, 2:]
    np.testing.assert_allclose(boxes_in(seen, sides), box, atol=1e-2)
    assert np.abs(sides).max() <= 0.5 / AROUND + 1e-5, "the square holds it, with room around"


def test_a_square_shows_what_is_in_the_picture_there_at_its_scale() -> None:
    picture = np.zeros((200, 300, 3), np.uint8)
    picture[80:112, 100:132] = 255
    (seen,) = cut(picture, np.array([[116.0, 96.0, 64.0]], np.float32))
    bright = np.argwhere(seen[..., 0] > 127)
    assert bright.min(axis=0).tolist() == [16, 16]
    assert bright.max(axis=0).tolist() == [47, 47]


def test_beyond_the_edge_the_pictures_last_pixels_go_on() -> None:
    picture = np.full((40, 40, 3), 90, np.uint8)
    (seen,) = cut(picture, np.array([[0.0, 20.0, 64.0]], np.float32))
    assert (seen == 90).all()


@given(st.lists(st.floats(0.15, 0.99), min_size=1, max_size=MOST + 6), st.floats(-8.0, 8.0))
def test_a_surer_network_makes_everybody_it_looks_at_surer_and_scores_stay_probabilities(
    scores: list[float], odds: float
) -> None:
    raw = np.sort(np.array(scores, np.float32))[::-1].copy()
    boxes = np.array([(10.0 * i, 50.0, 10.0 * i + 8, 70.0) for i in range(len(raw))], np.float32)
    picture = np.zeros((100, 400, 3), np.uint8)
    before, after = (
        SecondLook(Sure(each), (1.0, 0.5, 0.0)).look(picture, boxes, raw)[1] for each in (odds, odds + 1.0)
    )
    assert ((before[:MOST] > 0.0) & (after[:MOST] < 1.0)).all()
    assert (after[:MOST] > before[:MOST]).all()
    np.testing.assert_array_equal(after[MOST:], raw[MOST:])


def test_no_more_are_looked_at_than_there_is_time_for() -> None:
    network = Sure(0.0)
    boxes = np.tile(np.array([10.0, 10.0, 20.0, 30.0], np.float32), (MOST + 9, 1))
    better, _ = SecondLook(network, (1.0, 0.0, 0.0)).look(
        np.zeros((60, 60, 3), np.uint8), boxes, np.full(MOST + 9, 0.2, np.float32)
    )
    assert network.asked == MOST
    np.testing.assert_array_equal(better[MOST:], boxes[MOST:])


def people(count: int) -> tuple[list[Picture], list[FloatArray]]:
    """Pictures of one person each, 12 to 30 m ahead, and where they are."""
    line = np.array([(x, 0.0) for x in np.arange(-20.0, 200.0, 5.0)])
    static = StaticWorld(road=Road(lanes=(Lane(centre_m=line, left="dashed", right="edge"),)))
    try:
        renderer = LabellingRenderer(static)
    except RendererUnavailable as error:
        pytest.skip(str(error))
    pictures, boxes = [], []
    for look in range(count):
        place = Pose(x_m=12.0 + 1.5 * look, y_m=-3.0 if look % 2 else 2.5, yaw_rad=1.5 * look)
        person = Actor(id=1, kind="pedestrian", pose=place, length_m=0.5, width_m=0.5, height_m=1.75, look_seed=look)
        scene = Scene(static=static, ego=Pose(x_m=0.0, y_m=0.0), actors=(person,))
        pictures.append(renderer.render(scene, FRONT))
        boxes.append(np.array([label.box_px for label in renderer.render_labels(scene, FRONT)], np.float32))
    renderer.close()
    return pictures, boxes


def alone(folder: Path) -> Path:
    """The shipped detector without its second look: a card that names none, and raw scores."""
    path = folder / "detector.onnx"
    shutil.copy(data("models/detector.onnx"), path)
    path.with_suffix(".json").write_text("{}", encoding="utf-8")
    return path


def test_the_shipped_one_draws_people_at_least_as_well_as_the_detector_alone(tmp_path: Path) -> None:
    pictures, boxes = people(12)
    plain = load_detector(alone(tmp_path), DetectorOptions(floors={"pedestrian": 0.3}))
    overlap = {"alone": 0.0, "second": 0.0}
    for picture, there in zip(pictures, boxes, strict=True):
        for name, detector in (("alone", plain), ("second", load_detector(data("models/detector.onnx")))):
            found = [each.box_px for each in detector.detect(picture, closer=True) if each.kind == "pedestrian"]
            overlap[name] += float(overlaps(there, np.array(found, np.float32).reshape(-1, 4)).max(initial=0.0))
    assert overlap["second"] >= overlap["alone"] - 0.02 * len(pictures)
    assert overlap["second"] > 0.75 * len(pictures)


def with_second(folder: Path, content: str) -> Path:
    """The shipped detector and its second looks, with another card of the one at people."""
    shutil.copytree(data("models"), folder, dirs_exist_ok=True)
    (folder / "people.json").write_text(content, encoding="utf-8")
    return folder / "detector.onnx"


@pytest.mark.parametrize("weights", ["[1.0, 2.0]", '"much"', "[1.0, null, 0.0]"])
def test_a_card_with_other_than_three_weights_is_refused_by_name(tmp_path: Path, weights: str) -> None:
    with pytest.raises(DetectorError, match=r"people\.json.*weights"):
        load_detector(with_second(tmp_path, f'{{"weights": {weights}}}'))


def test_the_digest_told_is_of_all_networks(tmp_path: Path) -> None:
    path = with_second(tmp_path, "{}")
    before = digest(path)
    (tmp_path / "people.onnx").write_bytes(b"another")
    assert digest(path) != before


def test_a_second_look_that_is_not_there_is_refused_by_name(tmp_path: Path) -> None:
    path = with_second(tmp_path, '{"weights": [1.0, 1.0, 0.0]}')
    (tmp_path / "people.onnx").unlink()
    with pytest.raises(DetectorError, match=r"people\.onnx"):
        load_detector(path)


def test_a_network_that_believes_nobody_leaves_nobody(tmp_path: Path) -> None:
    pictures, _ = people(1)
    path = with_second(tmp_path, json.dumps({"weights": [0.0, 0.0, -9.0]}))
    assert not [each for each in load_detector(path).detect(pictures[0], closer=True) if each.kind == "pedestrian"]
    assert SIDE_PX == 64


@pytest.mark.parametrize("named", ['"people.onnx"', '{"vehicle": "people.onnx"}', "[1]"])
def test_second_looks_of_no_class_that_has_one_are_refused_by_what_to_write(tmp_path: Path, named: str) -> None:
    path = with_second(tmp_path, "{}")
    path.with_suffix(".json").write_text(f'{{"second_look": {named}}}', encoding="utf-8")
    with pytest.raises(DetectorError, match=r"detector\.json.*second_look.*sign, pedestrian, light"):
        load_detector(path)


def test_signs_are_judged_by_a_network_of_their_own(tmp_path: Path, street: Picture) -> None:
    path = with_second(tmp_path, data("models/people.json").read_text(encoding="utf-8"))
    before = load_detector(path).detect(street, closer=True)
    (tmp_path / "signs.json").write_text(json.dumps({"weights": [0.0, 0.0, -9.0]}), encoding="utf-8")
    after = load_detector(path).detect(street, closer=True)
    assert [each for each in before if each.kind != "sign"] == after
    assert any(each.kind == "sign" for each in before)
