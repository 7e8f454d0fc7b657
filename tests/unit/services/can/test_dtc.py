"""Trouble codes in words."""

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from services.can.dtc import SEVERITIES, DtcBook, code_of, is_code
from services.simulator.ecus import code_bytes


def test_the_table_has_at_least_eighty_codes_and_each_is_told_in_two_languages(book: DtcBook) -> None:
    assert len(book) >= 80
    for code in book._codes:
        english, german = book.explain(code), book.explain(code, "de")
        assert english.summary != german.summary
        assert english.next_step
        assert german.next_step
        assert english.severity in SEVERITIES


@pytest.mark.parametrize(
    ("pair", "code"),
    [
        ((0x03, 0x00), "P0300"),
        ((0x40, 0x35), "C0035"),
        ((0x81, 0x23), "B0123"),
        ((0xC1, 0x21), "U0121"),
        ((0x14, 0x2A), "P142A"),
    ],
)
def test_two_bytes_are_a_code(pair: tuple[int, int], code: str) -> None:
    assert code_of(*pair) == code
    assert code_bytes(code) == bytes(pair)


def test_a_maker_s_own_code_is_explained_by_its_structure(book: DtcBook) -> None:
    text = book.explain("P1234")
    assert not text.generic
    assert "manufacturer" in text.summary
    assert book.explain("P0399", "de").summary.startswith("Antrieb")
    assert "ignition" in book.explain("P0399").summary


@settings(max_examples=100, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(st.integers(0, 255), st.integers(0, 255))
def test_every_pair_of_bytes_is_a_code_that_can_be_explained(book: DtcBook, high: int, low: int) -> None:
    code = code_of(high, low)
    assert is_code(code)
    assert code_bytes(code) == bytes([high, low])
    assert book.explain(code).summary


@settings(max_examples=100, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(st.text(max_size=8))
def test_what_is_no_code_is_refused_in_words(book: DtcBook, text: str) -> None:
    if not is_code(text.strip().upper()):
        with pytest.raises(ValueError, match="no trouble code"):
            book.explain(text)
