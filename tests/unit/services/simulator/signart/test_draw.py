"""Drawn faces: complete, distinguishable, of the right shape, the same for the same seed."""

import numpy as np
import pytest

from services.simulator.signart import CODES, COUNTRIES, UnknownSign, draw_face, face_size_m


@pytest.mark.parametrize("country", COUNTRIES)
def test_every_code_draws_with_its_true_aspect_and_visible_ink(country: str) -> None:
    for code in CODES[country]:
        face = draw_face(country, code, size_px=64, text="Neustadt" if "town" in code else "")
        width_m, height_m = face_size_m(country, code)
        assert face.dtype == np.uint8
        assert face.shape[2] == 4
        assert max(face.shape[:2]) == 64
        assert face.shape[1] / face.shape[0] == pytest.approx(width_m / height_m, rel=0.05)
        assert (face[..., 3] > 128).mean() > 0.35, code


def test_the_same_order_gives_the_same_picture_and_wear_changes_it() -> None:
    once, again = draw_face("DEU", "limit:80", seed=7), draw_face("DEU", "limit:80", seed=7)
    assert np.array_equal(once, again)
    assert not np.array_equal(once, draw_face("DEU", "limit:80", seed=8))
    assert not np.array_equal(once, draw_face("DEU", "limit:80", seed=7, font=2))


def test_different_limits_look_different_and_an_empty_ring_has_no_number() -> None:
    pictures = [draw_face("DEU", f"limit:{value}", size_px=48)[..., :3].astype(int) for value in range(10, 140, 10)]
    for index, one in enumerate(pictures):
        for other in pictures[index + 1 :]:
            assert np.abs(one - other).mean() > 1.0
    ring = draw_face("DEU", "no_vehicles", size_px=96)
    assert ring[40:56, 30:66, :3].min() > 200


def test_a_limit_is_black_on_white_in_a_red_ring() -> None:
    face = draw_face("DEU", "limit:50", size_px=200)[..., :3].astype(int)
    red, green, _ = face[100, 12]
    assert red > 150 > 80 > green
    assert face[60, 100].min() > 200
    assert face[70:130, 50:150].min() < 60


def test_corners_of_a_disc_are_transparent() -> None:
    face = draw_face("GBR", "limit:40", size_px=80)
    assert face[0, 0, 3] == face[79, 79, 3] == 0


def test_a_lit_panel_shines_and_a_blank_one_is_dark() -> None:
    lit, blank = draw_face("DEU", "led:80", size_px=220), draw_face("DEU", "led:blank", size_px=220)
    assert lit[..., :3].max() > 230
    assert blank[..., :3].max() < 60


def test_text_changes_a_board_and_unknown_letters_do_no_harm() -> None:
    one, other = draw_face("DEU", "town_entry", text="Überlingen"), draw_face("DEU", "town_entry", text="Aßlar")
    assert not np.array_equal(one, other)
    strange = draw_face("DEU", "town_entry", text="北‮\x00")
    assert strange.shape == one.shape


def test_an_unknown_code_or_country_is_refused_by_name() -> None:
    with pytest.raises(UnknownSign, match="limit:77"):
        draw_face("DEU", "limit:77")
    with pytest.raises(UnknownSign, match="XXX"):
        face_size_m("XXX", "stop")
