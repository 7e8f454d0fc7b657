"""A plate is read only where one line of letters stands on it, whole."""

import numpy as np
import pytest

from services.drivelm.ocr.plate_text import only_line
from services.drivelm.reading.crops import Picture
from services.simulator.signart import draw_face


def plate(text: str, width_px: int = 90, code: str = "plate:time") -> Picture:
    """A drawn plate before grey, with some of it around."""
    face = draw_face("DEU", code, text=text, size_px=width_px)
    share = face[..., 3:] / 255
    image = np.asarray(face[..., :3] * share + 110 * (1 - share), np.uint8)
    around = width_px // 12
    return np.pad(image, ((around, around), (around, around), (0, 0)), constant_values=110)


@pytest.mark.parametrize("width_px", [45, 60, 90, 160])
def test_one_line_is_found_with_the_height_of_its_letters(width_px: int) -> None:
    line = only_line(plate("22-6 h", width_px))
    assert line is not None
    assert line.height_px == pytest.approx(0.21 * width_px, rel=0.25)
    assert line.picture.shape[1] > line.picture.shape[0]


@pytest.mark.parametrize("text", ["Mo-Fr\n7-17 h", "7-9 h\n16-18 h"])
def test_two_lines_are_none(text: str) -> None:
    assert only_line(plate(text)) is None


def test_the_arrows_of_a_length_are_no_letters() -> None:
    with_arrows = plate("600 m", 120, "plate:length")
    line = only_line(with_arrows, between_arrows=True)
    assert line is not None
    assert line.picture.shape[1] < 0.62 * with_arrows.shape[1]
    assert only_line(plate("600 m", 120), between_arrows=True) is None


@pytest.mark.parametrize("shade", [30, 60, 90])
@pytest.mark.parametrize("hidden_px", range(16, 50, 2))
def test_a_line_whose_first_letter_is_hidden_or_cut_is_none(hidden_px: int, shade: int) -> None:
    image = plate("22-6 h", 120)
    image[:, :hidden_px] = shade
    assert only_line(image) is None


def test_noise_darkness_and_specks_are_none() -> None:
    noise = np.random.default_rng(1).integers(0, 255, (40, 70, 3), np.uint8)
    assert only_line(noise) is None
    assert only_line(np.zeros((40, 70, 3), np.uint8)) is None
    assert only_line(np.full((1, 1, 3), 255, np.uint8)) is None
    assert only_line(plate(" ")) is None
