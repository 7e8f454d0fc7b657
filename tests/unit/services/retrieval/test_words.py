"""Search terms."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from services.retrieval.words import terms


@pytest.mark.parametrize(
    ("text", "found"),
    [
        ("Zeichen 274.1", ["zeich", "274.1", "274", "1"]),
        ("1053-35", ["1053-35", "1053", "35"]),
        ("The limits on the road", ["limit", "road"]),
        ("Überholen überholt", ["überhol", "überholt"]),
        ("§ 3 Abs. 3", ["3", "abs", "3"]),
        ("", []),
    ],
)
def test_terms(text: str, found: list[str]) -> None:
    assert terms(text) == found


@given(st.text(max_size=300))
def test_any_text_has_terms_without_an_error(text: str) -> None:
    assert all(term == term.lower() for term in terms(text))
