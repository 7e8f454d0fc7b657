"""What a second look learns from, on small made-up pictures of people."""

from pathlib import Path

import numpy as np
import pytest
import torch

from services.perception.detect import second_look
from services.perception.detect.detection import Detection
from services.perception.detect.detector import Picture
from services.perception.detect.second_look import windows
from training.dataset.shards import CLASSES, Shot, coded, shards, write_shard
from training.second_look.crops import (
    CROP_PX,
    REAL_SHARE,
    ROOM,
    Batch,
    batches,
    collected,
    cropped,
    drawn,
    joined,
    mark,
)
from training.second_look.net import SIDE_PX, ExportLook, LookNet
from training.second_look.train import looked_at, loss_of, weights

Rows = np.typing.NDArray[np.float32]
PERSON = CLASSES.index("pedestrian")


def rows(*objects: tuple[float, ...]) -> Rows:
    return np.array(objects, np.float32).reshape(-1, 8)


def person(x: float, y: float, visible: float = 1.0) -> tuple[float, ...]:
    return (PERSON, x, y, x + 12, y + 30, visible, 20.0, 0.0)


def boxes(*each: tuple[float, float, float, float]) -> Rows:
    return np.array(each, np.float32).reshape(-1, 4)


PICTURE = np.full((120, 200, 3), 100, np.uint8)


def test_the_squares_are_of_the_size_that_drives() -> None:
    assert SIDE_PX == second_look.SIDE_PX


def test_a_box_is_of_a_person_of_nobody_or_teaches_neither() -> None:
    objects = rows(person(50, 40), person(120, 40, visible=0.2))
    asked = boxes((51, 41, 63, 71), (51, 30, 63, 50), (10, 60, 22, 80), (120, 40, 132, 70))
    found = cropped(PICTURE, asked, objects)
    assert found.kinds.tolist() == [1, 0, 0, -1], "a person; a third of them; another thing; one too hidden to count"
    np.testing.assert_allclose(found.things[0], (50, 40, 62, 70))
    assert not found.things[2].any()
    assert found.pictures.shape == (4, CROP_PX, CROP_PX, 3)


def test_where_no_person_is_every_box_is_of_nobody() -> None:
    assert cropped(PICTURE, boxes((10, 10, 20, 30)), rows()).kinds.tolist() == [0]


def test_drawn_boxes_lie_about_the_people_that_count() -> None:
    found = drawn(rows(person(50, 40), person(120, 40, visible=0.2)), np.random.default_rng(1))
    assert 1 <= len(found) <= 2
    assert ((found[:, 0] > 40) & (found[:, 2] < 75)).all()


class Everywhere:
    """A detector that takes one box in every picture for a person."""

    name = "everywhere"

    def detect(self, rgb: Picture, *, closer: bool = False) -> list[Detection]:
        return [Detection(kind="pedestrian", score=0.5, x0_px=50, y0_px=40, x1_px=62, y1_px=70)]


def test_what_chooses_does_not_teach(tmp_path: Path) -> None:
    shots = [Shot(coded(PICTURE, 90), rows(person(x, 40)), {"camera": "tele", "set": "made up"}) for x in (50, 120)]
    write_shard(tmp_path / "train-000000.npz", shots)
    chosen = mark(shots[1].objects, shots[1].note)
    found = collected(shards(tmp_path, "train"), Everywhere(), "pedestrian", 1, but={chosen})
    assert found.real.all()
    assert (found.kinds[found.boxes[:, 0] == 50] == 1).all(), (
        "the other picture, with a person in that box, was left out"
    )
    assert (found.things[:, 0] < 60).all()


def one_batch() -> Batch:
    objects = rows(person(50, 40))
    crops = cropped(PICTURE, boxes((48, 38, 61, 72), (150, 10, 160, 30)), objects)
    return next(batches(crops, 64, seed=3))


def test_edges_move_with_the_look() -> None:
    batch = one_batch()
    square = windows(boxes((48, 38, 61, 72)))[0]
    for look, known, sides in zip(batch.looks, batch.known, batch.sides, strict=True):
        if known:
            middle = square[:2] + look[:2] * square[2]
            told = np.tile(middle, 2) + sides * square[2] * look[2]
            np.testing.assert_allclose(told, (50, 40, 62, 70), atol=1e-3)
    assert batch.known.sum() > 16


def test_half_of_a_batch_shows_people_and_nobody_has_edges() -> None:
    batch = one_batch()
    assert (batch.kinds[32:] == 0).all()
    assert not batch.known[32:].any()
    assert (batch.kinds[:32] == 1).sum() > 16


def test_photographs_are_as_many_among_people_as_among_the_others() -> None:
    objects = rows(person(50, 40))
    asked = boxes((48, 38, 61, 72), (150, 10, 160, 30))
    drawn_ones, real = cropped(PICTURE, asked, objects), cropped(PICTURE // 2, asked, objects, real=True)
    batch = next(batches(joined([drawn_ones] * 9 + [real]), 100, seed=3))
    dark = batch.pictures.max(axis=(1, 2, 3)) < 60
    assert dark[:50].sum() == dark[50:].sum() == round(REAL_SHARE * 50)


def test_a_look_shows_the_crop_moved_scaled_and_mirrored() -> None:
    crop = np.zeros((1, CROP_PX, CROP_PX, 3), np.uint8)
    crop[0, :, CROP_PX // 2 + 4 : CROP_PX // 2 + 12] = 255
    torch.manual_seed(0)

    def middle(shift: float, scale: float, mirrored: float) -> float:
        seen = looked_at(crop, torch.tensor([[shift, 0.0, scale]]), torch.tensor([mirrored]))[0, 0, SIDE_PX // 2]
        return float((torch.arange(SIDE_PX)[seen > 127].float()).mean()) - (SIDE_PX - 1) / 2

    assert middle(0.0, 1.0, 0.0) == pytest.approx(8.0, abs=0.6)
    assert middle(0.0, 1.0, 1.0) == pytest.approx(-8.0, abs=0.6)
    assert middle(0.05, 1.0, 0.0) == pytest.approx(8.0 - 0.05 * SIDE_PX, abs=0.6)
    assert middle(0.0, 0.9, 0.0) == pytest.approx(8.0 / 0.9, abs=0.6)
    assert pytest.approx(CROP_PX / SIDE_PX) == ROOM


def test_a_right_word_costs_less_than_a_wrong_one_and_unjudged_boxes_cost_nothing() -> None:
    batch = one_batch()
    sides = torch.from_numpy(batch.sides)
    right = torch.from_numpy(np.where(batch.kinds > 0, 5.0, -5.0).astype(np.float32))
    good, exact = loss_of(right, sides, batch, sides)
    bad, off = loss_of(-right, sides + 0.1, batch, sides)
    assert float(good) < 0.1 < float(bad)
    assert float(exact) == pytest.approx(0.0, abs=1e-4)
    assert float(off) > 0.3
    unjudged = batch._replace(kinds=np.where(batch.kinds > 0, -1, batch.kinds).astype(np.float32))
    mixed = torch.where(torch.from_numpy(batch.kinds) > 0, -right, right)
    assert float(loss_of(mixed, sides, unjudged, sides)[0]) < 0.1


def test_the_words_weigh_what_they_tell() -> None:
    rng = np.random.default_rng(4)
    truth = rng.uniform(size=4000) < 0.4
    telling, noise = np.where(truth, 2.0, -2.0) + rng.normal(0, 1, 4000), rng.normal(0, 1, 4000)
    new, old, _ = weights(telling, noise, truth)
    assert new > 1.0
    assert abs(old) < 0.3


def test_what_is_exported_takes_bytes_and_says_the_same() -> None:
    torch.manual_seed(1)
    net = LookNet().eval()
    pictures = torch.randint(0, 255, (3, SIDE_PX, SIDE_PX, 3), dtype=torch.uint8)
    with torch.no_grad():
        sizes = torch.tensor([[0.2, 0.45], [0.45, 0.3], [0.1, 0.4]])
        person_odds, sides = ExportLook(net)(pictures, sizes)
        plain_odds, plain_sides = net(pictures.permute(0, 3, 1, 2).float(), sizes)
    assert person_odds.shape == (3,)
    assert sides.shape == (3, 4)
    torch.testing.assert_close(person_odds, plain_odds, atol=1e-3, rtol=1e-3)
    torch.testing.assert_close(sides, plain_sides, atol=1e-3, rtol=1e-3)
    own = torch.cat([-sizes / 2, sizes / 2], dim=1)
    torch.testing.assert_close(sides, own, msg="before it has learnt anything a box stays where it is")
