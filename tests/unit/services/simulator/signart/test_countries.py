"""What tells countries apart: boards and diamonds in the United States, green motorways in Switzerland, plates in words."""

import numpy as np
import pytest
from numpy.typing import NDArray

from services.simulator.signart import CODES, COUNTRIES, draw_face, face_size_m
from services.simulator.signart.catalogue import WET_LANGUAGES

Floats = NDArray[np.float64]


def _paint(country: str, code: str, text: str = "", size_px: int = 128) -> Floats:
    """Over grey, as floats."""
    face = draw_face(country, code, text=text, size_px=size_px).astype(float)
    share = face[..., 3:] / 255
    out: Floats = face[..., :3] * share + 135 * (1 - share)
    return out


def _share(picture: Floats, red: tuple[int, int], green: tuple[int, int], blue: tuple[int, int]) -> float:
    inside = [(picture[..., k] >= low) & (picture[..., k] <= high) for k, (low, high) in enumerate((red, green, blue))]
    return float(np.mean(inside[0] & inside[1] & inside[2]))


def _red(picture: Floats) -> float:
    return _share(picture, (150, 255), (0, 80), (0, 80))


def _yellow(picture: Floats) -> float:
    return _share(picture, (200, 255), (160, 255), (0, 90))


def test_every_country_of_the_table_has_faces_and_its_own_languages() -> None:
    assert (
        {"DEU", "AUT", "FRA", "POL", "NLD", "CHE", "GBR", "USA"} == set(COUNTRIES) == set(CODES) == set(WET_LANGUAGES)
    )
    spoken = {language for languages in WET_LANGUAGES.values() for language in languages}
    assert spoken == {"de", "en", "fr", "nl", "pl"}


@pytest.mark.parametrize("value", range(5, 90, 5))
def test_an_american_limit_is_a_number_on_an_upright_white_board_without_red(value: int) -> None:
    board = _paint("USA", f"limit:{value}")
    assert board.shape[0] > board.shape[1]
    assert _red(board) == 0
    assert _share(board, (230, 255), (230, 255), (230, 255)) > 0.5


def test_a_school_limit_says_so_in_yellow_above_and_stands_taller() -> None:
    school = _paint("USA", "school_limit:20")
    assert _yellow(school[: len(school) // 5]) > 0.2
    assert _yellow(school[len(school) // 5 :]) == 0
    width_m, height_m = face_size_m("USA", "school_limit:20")
    assert height_m > 1.6 * width_m


@pytest.mark.parametrize("code", ["crossing", "children", "slippery", "roundabout"])
def test_american_warnings_are_yellow_diamonds(code: str) -> None:
    face = draw_face("USA", code, size_px=100)
    assert _yellow(face.astype(float)) > 0.2
    assert face[3, 3, 3] == face[96, 96, 3] == 0
    assert face[50, 4, 3] == 255


def test_swiss_motorways_are_green_and_german_ones_blue() -> None:
    assert _share(_paint("CHE", "motorway"), (0, 30), (80, 140), (40, 100)) > 0.2
    assert _share(_paint("DEU", "motorway"), (0, 40), (40, 100), (120, 200)) > 0.2


@pytest.mark.parametrize("bent", ["", "bent"])
@pytest.mark.parametrize("country", COUNTRIES)
def test_arrow_plates_mirror_each_other(country: str, bent: str) -> None:
    left, right = (_paint(country, f"plate:arrow_{way}", bent, 80) for way in ("left", "right"))
    assert np.abs(left - right[:, ::-1]).mean() < 3
    assert np.abs(left - right).mean() > 10
    assert np.abs(left - _paint(country, "plate:arrow_ahead", size_px=80)).mean() > 10


@pytest.mark.parametrize("country", COUNTRIES)
def test_when_wet_is_written_in_the_countrys_own_words(country: str) -> None:
    for language in WET_LANGUAGES[country]:
        own = _paint(country, f"plate:when_wet:{language}")
        assert np.abs(own - _paint(country, "plate:when_wet:drawn")).mean() > 5
        assert not np.array_equal(own, _paint(country, f"plate:when_wet:{language}", "other words"))


def test_rings_of_five_fifteen_and_fifty_differ_and_ends_carry_no_red() -> None:
    rings = [_paint("DEU", f"limit:{value}") for value in (5, 15, 50)]
    assert all(np.abs(a - b).mean() > 3 for a, b in ((rings[0], rings[1]), (rings[0], rings[2]), (rings[1], rings[2])))
    for country in ("DEU", "FRA", "CHE"):
        assert _red(_paint(country, "limit_end:50")) == 0
