"""What the reader learns from: every class can be drawn, splits share nothing, labels and scores are honest."""

from collections.abc import Sequence

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from drivemcp.paths import data
from evaluation.modelled_sensors.sign_faces import orders
from proto.perception import ObjectClass
from services.drivelm.reading.crops import Region
from services.drivelm.reading.reader import Reader
from services.drivelm.vocabulary.classes import LIGHTS, OTHER, READER_CLASSES
from training.labelling import Label
from training.reader.samples import Source
from training.reader.scores import SURE, SURELY_WRONG, Measured, score_table, sure_from
from training.reader.train import tuned
from training.sign_pictures.avenue import avenue, class_of
from training.sign_pictures.avenue_lights import light_avenue
from training.sign_pictures.degrade import any_conditions, jittered, view
from training.sign_pictures.faces import Face, drawable
from training.sign_pictures.fonts import TEST_STEMS, TEST_STYLES, TRAIN_STEMS, TUNE_STEMS, letterings
from training.sign_pictures.texts import text_for


@pytest.fixture(scope="module")
def source() -> Source:
    return Source("train", 3, (), each=1)


def test_every_class_but_other_has_something_to_draw() -> None:
    assert set(drawable()) == set(READER_CLASSES) - {OTHER}
    assert all(orders(label) for label in drawable() if label not in LIGHTS)


def test_train_and_test_share_no_lettering() -> None:
    train, test = letterings("train", ()), letterings("test", ())
    assert set(test) == {f"stroke-{style}" for style in TEST_STYLES}
    assert not set(train) & set(test)


def test_letterings_for_thresholds_are_neither_trained_on_nor_scored() -> None:
    assert not set(TUNE_STEMS) & {*TRAIN_STEMS, *TEST_STEMS}
    assert not letterings("tune", ())


def test_without_letterings_for_thresholds_none_are_chosen() -> None:
    assert tuned(Reader.load(data("models/reader.onnx")), 10, ()) is None


def test_a_batch_has_crops_labels_and_sizes_and_is_the_same_for_the_same_seed(source: Source) -> None:
    crops, labels, sizes = source.batch(24, np.random.default_rng(1))
    again = source.batch(24, np.random.default_rng(1))
    assert crops.shape == (24, 48, 48, 3)
    assert np.array_equal(crops, again[0])
    assert np.array_equal(labels, again[1])
    assert ((sizes == 0) == (labels == READER_CLASSES.index(OTHER))).all()


def test_lights_alone_are_of_every_state_and_none_is_nothing(source: Source) -> None:
    crops, labels, sizes = source.batch(200, np.random.default_rng(1), lights=True)
    assert crops.shape == (200, 48, 48, 3)
    assert {READER_CLASSES[label] for label in labels} == set(LIGHTS)
    assert (sizes > 0).all()


def test_a_face_lies_where_its_box_says() -> None:
    white = Face(np.full((64, 64, 4), 255, np.uint8), 1.0)
    chance = np.random.default_rng(2)
    now = any_conditions(chance, 0.0)._replace(yaw_rad=0, roll_rad=0, noise=0, blur_px=0, gain=1, gamma=1, sign_gain=1)
    taken = view(white, np.zeros((160, 160, 3), np.uint8), 30, now, chance, False)
    x0, y0, x1, y1 = (round(edge) for edge in taken.region)
    assert taken.picture[y0 + 3 : y1 - 3, x0 + 3 : x1 - 3].min() > 180
    assert abs((x1 - x0) - 30) <= 1


def test_a_sloppy_box_stays_near() -> None:
    chance = np.random.default_rng(4)
    boxes = np.array([jittered(Region(10, 10, 40, 40), chance) for _ in range(200)])
    assert np.abs(boxes.mean(axis=0) - (10, 10, 40, 40)).max() < 1
    assert boxes.std() > 0


@pytest.mark.parametrize("kind", ["town", "distance", "time"])
def test_texts_are_made_up_but_never_empty(kind: str) -> None:
    chance = np.random.default_rng(5)
    assert all(len(text_for(kind, chance)) >= 3 for _ in range(20))


def test_labels_of_rendered_objects_find_their_class() -> None:
    def label(kind: ObjectClass, code: str, country: str = "DEU") -> Label:
        box = (0.0, 0.0, 9.0, 9.0)
        return Label(id=1, kind=kind, box_px=box, full_box_px=box, visible_fraction=1, distance_m=1, visible_px=9,
                     code=code, country=country)  # fmt: skip

    assert class_of(label("sign", "limit_end:80")) == "limit_end"
    assert class_of(label("sign", "town_entry", "GBR")) == "town_entry:white"
    assert class_of(label("sign", "info:side", "GBR")) == "info:side_left"
    assert class_of(label("panel", "")) == "led:blank"
    assert class_of(label("light", "red_amber", "")) == "light:red_amber"
    assert class_of(label("vehicle", "")) is None


def test_an_avenue_has_unique_ids_and_a_sign_for_every_place() -> None:
    world = avenue(15, "train", 3).static
    panels = [panel.id for gantry in world.gantries for panel in gantry.panels]
    ids = [*(post.id for post in world.signs), *panels, *(light.id for light in world.lights)]
    assert len(ids) == len(set(ids))
    assert len(world.signs) + len(world.gantries) + len(world.lights) == 15


def test_an_avenue_of_lights_shows_every_state_with_ids_of_their_own_and_splits_differ() -> None:
    train, test = (light_avenue(split, 3).static.lights for split in ("train", "test"))
    assert len({light.id for light in train}) == len(train) > 10
    assert {light.state for light in (*train, *test)} == {"red", "red_amber", "amber", "green", "off"}
    assert [light.pose for light in train] != [light.pose for light in test]


def _read(right: int, wrong: Sequence[float], size_px: float = 30) -> Measured:
    """So many crops of a stop sign read right for certain, and some read as yield with given confidences."""
    stop, give_way = (READER_CLASSES.index(name) for name in ("stop", "yield"))
    probabilities = np.zeros((right + len(wrong), len(READER_CLASSES)), np.float32)
    probabilities[:right, stop] = 1.0
    probabilities[right:, give_way] = wrong
    count = len(probabilities)
    return Measured(probabilities, np.full(count, stop), np.full(count, size_px, np.float32))


@given(st.lists(st.floats(0.5, 0.98), max_size=40))
def test_from_the_tuned_threshold_on_few_enough_are_wrong(wrong: list[float]) -> None:
    measured = _read(2000, wrong)
    told = score_table(measured, sure_from(measured))["sure"]
    assert told["large"] >= SURE
    assert told["wrong"] <= SURELY_WRONG
    assert told["right"] <= told["right_at_0.9"]


def test_small_faces_have_a_threshold_of_their_own() -> None:
    small, large = _read(500, [0.96] * 9, size_px=12), _read(500, [0.92] * 9)
    probabilities = np.concatenate([small.probabilities, large.probabilities])
    sizes = np.concatenate([small.sizes_px, large.sizes_px])
    both = Measured(probabilities, np.full(len(sizes), small.labels[0]), sizes)
    sure = sure_from(both)
    assert sure.small > 0.95 > sure.large > 0.91
    assert score_table(both, sure)["sure"]["wrong"] == 0.0


def test_scores_count_sure_mistakes_and_a_perfect_reader_has_none() -> None:
    labels = np.arange(10) % 4
    perfect = np.full((10, len(READER_CLASSES)), 0.0, np.float32)
    perfect[np.arange(10), labels] = 1.0
    sizes = np.where(labels == 0, 0, 25).astype(np.float32)
    good = score_table(Measured(perfect, labels, sizes))
    assert good["all_signs"][3]["sure_right"] == 1.0
    assert (good["right_when_legible"], good["surely_wrong"]) == (1.0, 0.0)
    assert good["calibration_error"] == 0
    bad = score_table(Measured(np.roll(perfect, 1, axis=1), labels, sizes))
    assert bad["all_signs"][3]["sure_wrong"] == 1.0
    assert (bad["right_when_legible"], bad["surely_wrong"]) == (0.0, 1.0)
    assert (good["right_discs_when_legible"], bad["right_discs_when_legible"]) == (1.0, 0.0)
    assert bad["other"]["taken_for_a_sign_surely"] == 1.0
    assert Measured(np.roll(perfect, 1, axis=1), labels, sizes).bins().error == pytest.approx(1.0)


def test_a_red_read_as_green_is_counted() -> None:
    red, green, left = (READER_CLASSES.index(name) for name in ("light:red", "light:green", "light:red_left"))
    labels = np.array([red, red, left, green])
    read = np.zeros((4, len(READER_CLASSES)), np.float32)
    read[np.arange(4), [red, green, green, green]] = 0.6
    table = score_table(Measured(read, labels, np.full(4, 12, np.float32)))
    assert table["green_for_red"] == {"crops": 3, "taken": 2, "clearly": 0}
    assert table["light_state"]["crops"] == 0  # lamps of three pixels
    near = score_table(Measured(read, labels, np.full(4, 60, np.float32)))
    assert near["light_state"] == {"crops": 4, "right": 0.5}


def test_green_told_of_red_costs_more_than_another_mistake() -> None:
    torch = pytest.importorskip("torch", reason="torch is for training only: pip install .[train]")
    from training.reader.fit import loss_of

    red, green, stop = (READER_CLASSES.index(name) for name in ("light:red", "light:green", "stop"))
    told = torch.zeros(2, 3, len(READER_CLASSES))
    told[0, :, green], told[1, :, stop] = 6.0, 6.0
    as_green, as_stop = (float(loss_of(scores, torch.tensor([red, red, red]))) for scores in told)
    assert as_green > as_stop + 1.0


@given(px=st.floats(9.0, 75.0), read=st.sampled_from(["light:green", "light:red", OTHER]))
def test_green_for_red_counts_at_every_size_and_where_the_lamp_is_legible(px: float, read: str) -> None:
    told = np.zeros((1, len(READER_CLASSES)), np.float32)
    told[0, READER_CLASSES.index(read)] = 0.6
    red = np.array([READER_CLASSES.index("light:red")])
    table = score_table(Measured(told, red, np.array([px], np.float32)))
    assert table["green_for_red"]["taken"] == (read == "light:green")
    legible = table["green_for_red_when_legible"]
    assert (legible["crops"], legible["taken"]) == ((px >= 40.0), (px >= 40.0 and read == "light:green"))
