"""Drawn lights: arrows point where their class says, and a lit green beside a red stays part of a red."""

import numpy as np
import pytest

from services.drivelm.vocabulary.classes import ARROW_LIGHTS, LIGHTS, READER_CLASSES, ROUND_LIGHTS
from services.simulator.signart.lettering import STYLES, Lettering, StrokeLettering
from training.reader.samples import share_of
from training.sign_pictures.lights import HEIGHT_PX, draw_head
from training.sign_pictures.odd import odd_faces
from training.sign_pictures.texts import text_for

_LIT_AT = {"red": 0.18, "amber": 0.5, "green": 0.82}


def _lit(label: str) -> list[np.ndarray]:
    """Where a dozen heads of dark housing shine, as masks (bright and coloured)."""
    heads = [draw_head(label, np.random.default_rng(seed))[..., :3].astype(int) for seed in range(30)]
    dark = [head for head in heads if head[4, 4, 0] < 100 and head.shape[1] < 60]
    return [(head.max(axis=2) > 170) & (np.ptp(head, axis=2) > 60) for head in dark][:12]


def _lean(label: str) -> float:
    """How much more shines on the left half than on the right, as a share."""
    halves = [(lit[:, : lit.shape[1] // 2].sum(), lit[:, -(lit.shape[1] // 2) :].sum()) for lit in _lit(label)]
    return float(np.median([(left - right) / (left + right) for left, right in halves]))


@pytest.mark.parametrize("label", ARROW_LIGHTS)
def test_the_lamp_of_the_colour_is_the_one_that_is_lit(label: str) -> None:
    colour = label.partition(":")[2].partition("_")[0]
    for lit in _lit(label):
        assert np.nonzero(lit)[0].mean() == pytest.approx(_LIT_AT[colour] * HEIGHT_PX, abs=4)


@pytest.mark.parametrize("colour", ["red", "amber", "green"])
def test_left_and_right_arrows_point_apart_and_the_others_are_even(colour: str) -> None:
    assert _lean(f"light:{colour}_left") > 0.1
    assert _lean(f"light:{colour}_right") < -0.1
    assert abs(_lean(f"light:{colour}_straight")) < 0.1
    assert abs(_lean(f"light:{colour}")) < 0.1


def test_unlit_lamps_stay_darker_than_lit_ones_even_where_the_sun_stands_on_them() -> None:
    for seed in range(60):
        off, green = (draw_head(f"light:{state}", np.random.default_rng(seed))[..., :3] for state in ("off", "green"))
        x, y = off.shape[1] // 2, round(0.85 * HEIGHT_PX)
        assert int(off[y, x, 1]) < int(green[y, x, 1]) - 15


def test_some_round_reds_have_a_green_arrow_beside_them_and_nothing_else_has() -> None:
    wide = {
        label: sum(draw_head(label, np.random.default_rng(seed)).shape[1] > 60 for seed in range(80))
        for label in LIGHTS
    }
    assert 2 <= wide["light:red"] <= 30
    assert not any(count for label, count in wide.items() if label != "light:red")
    assert set(ROUND_LIGHTS) < set(LIGHTS)


def test_every_class_is_met_often_and_numbers_more_often() -> None:
    shares = {label: share_of(label) for label in READER_CLASSES if label != "other"}
    assert sum(shares.values()) == pytest.approx(1.0)
    assert min(shares.values()) * 150_000 > 300
    assert shares["limit:50"] > 1.3 * shares["limit:40"]
    assert all(share >= shares["stop"] for label, share in shares.items() if label.startswith(("limit", "light:")))


def test_odd_faces_are_drawn_and_no_two_splits_share_them() -> None:
    letters: dict[str, Lettering] = {"one": StrokeLettering(STYLES[0]), "two": StrokeLettering(STYLES[1])}
    train, test = odd_faces(letters, 10, 1), odd_faces(letters, 10, 1001)
    assert all((face.picture[..., 3] > 128).mean() > 0.5 for face in train)
    assert not any(np.array_equal(a.picture, b.picture) for a, b in zip(train, test, strict=True))


@pytest.mark.parametrize("language", ["de", "en", "fr", "nl", "pl"])
def test_when_wet_is_written_in_several_ways(language: str) -> None:
    chance = np.random.default_rng(2)
    assert len({text_for(f"wet:{language}", chance) for _ in range(40)}) >= 2
