"""Text from the world is cleaned before use."""

import unicodedata

from hypothesis import given
from hypothesis import strategies as st

from services.drivelm.vocabulary.text import MAX_CHARS, cleaned


@given(st.text(max_size=1000))
def test_cleaned_text_is_one_short_line_without_control_or_direction_characters(text: str) -> None:
    out = cleaned(text)
    assert len(out) <= MAX_CHARS
    assert "\n" not in out
    assert all(unicodedata.category(char) not in ("Cc", "Cf", "Co", "Cs", "Cn") for char in out)


def test_direction_overrides_and_zero_width_characters_are_removed() -> None:
    assert cleaned("Neu‮stadt\u200b\x07") == "Neustadt"


def test_umlauts_survive() -> None:
    assert cleaned("bei Nässe") == "bei Nässe"
