"""The banner of a rendered video: what was said, whole, in letters that OpenCV has."""

import cv2
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from msgspec.structs import replace

from app.play.render import BANNER_PX, LINE_PX, MOST_LINES, draw, lines_of
from proto.decision import Advisory
from proto.rules import LegalLimit
from tests.unit.app.drive.test_summary import advisory

LONG = "Hold 50 km/h. (StVO § 3 (3) no. 1: 50 km/h inside built-up areas; told by the town sign of Köln, 12 s ago, and by no other.)"


def test_sections_and_accents_are_letters_that_opencv_draws() -> None:
    """Before version 5 it drew each as a question mark."""
    drawn = {
        text: draw(np.zeros((90, 640, 3), np.uint8), None, None, advisory("SPEAK", directive=text)) for text in "§ö–?"
    }
    assert all((drawn["?"] != drawn[text]).any() for text in "§ö–")


@given(st.text(max_size=400), st.integers(200, 1920))
def test_lines_fit_the_picture_and_the_banner(text: str, width_px: int) -> None:
    lines = lines_of(text, width_px)
    assert len(lines) <= MOST_LINES
    assert 20 + LINE_PX * MOST_LINES <= BANNER_PX


def test_a_long_reason_is_shown_to_its_end() -> None:
    lines = lines_of(LONG, 640)
    assert " ".join(lines) == LONG
    widest = max(cv2.getTextSize(line, cv2.FONT_HERSHEY_SIMPLEX, 0.42, 1)[0][0] for line in lines)
    assert widest < 630


@pytest.mark.parametrize("said", [None, advisory("SPEAK", justification=LONG)])
def test_the_banner_stands_below_the_picture(said: Advisory | None) -> None:
    picture = np.zeros((480, 640, 3), np.uint8)
    drawn = draw(picture, None, None, said)
    assert drawn.shape == (480 + BANNER_PX, 640, 3)
    assert (drawn[480:] > 100).any()


def test_an_assumed_limit_is_shown_grey_and_one_in_force_with_a_red_ring() -> None:
    def red(limit: LegalLimit) -> bool:
        told = advisory("SILENT", legal_limit=limit)
        drawn = draw(np.zeros((480, 640, 3), np.uint8), None, told, None)[:100, 540:].astype(int)
        return bool((drawn[..., 2] - drawn[..., 0] > 100).any())

    limit = LegalLimit(value=50, unit="km/h", mps=13.9)
    assert red(limit)
    assert not red(replace(limit, assumed=True))
