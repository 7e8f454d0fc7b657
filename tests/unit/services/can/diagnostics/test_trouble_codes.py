"""Trouble codes in words."""

from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from drivemcp.paths import data
from services.can.diagnostics.trouble_codes import SEVERITIES, DtcBook, code_of, is_code
from services.simulator.ecus.parameters import code_bytes


def test_the_table_has_at_least_six_hundred_generic_codes_and_each_is_told_in_two_languages_and_what_to_do_in_three(
    book: DtcBook,
) -> None:
    assert len(book) >= 600
    for code in book.codes:
        english, german = book.explain(code), book.explain(code, "de")
        assert english.summary != german.summary
        assert english.next_step
        assert len({english.next_step, german.next_step, book.explain(code, "fr").next_step}) == 3
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
    assert "transmission" in book.explain("P2799").summary
    assert "cylinder deactivation" in book.explain("P3449").summary


@pytest.mark.parametrize(
    ("code", "says"),
    [
        ("P0268", "Injector of cylinder 3: signal too high"),
        ("P0362", "Ignition coil L: fault in its circuit"),
        ("P0773", "Shift valve E: electrical fault"),
        ("P0134", "First oxygen sensor, bank 1: shows no activity"),
        ("U0074", "CAN bus B: switched off: units cannot be reached"),
    ],
)
def test_a_family_s_codes_follow_the_standard_s_numbers(book: DtcBook, code: str, says: str) -> None:
    assert book.explain(code).summary == says


def test_a_code_of_its_own_stands_above_its_family(book: DtcBook) -> None:
    assert book.severity("P0523") == "careful"
    assert book.severity("P0522") == "stop_now"


@pytest.mark.parametrize(
    ("change", "says"),
    [
        (('"circuit early late"', '"circuit erly late"'), r"dtc.toml: family P0010: faults not defined: \['erly'\]"),
        (("P0013 = {", "P0012 = {"), "dtc.toml: family P0012: P0012 is in another family too"),
        (('step = "cool_down"', 'step = "cool"'), r"dtc.toml: steps not defined: \['cool'\]"),
        (("C003B = {", "C103B = {"), r"dtc.toml: no generic trouble codes: \['C103B'\]"),
        (('severity = "note"', 'severity = "grave"'), "dtc.toml: Invalid enum value 'grave'"),
    ],
)
def test_a_broken_table_names_what_is_wrong(tmp_path: Path, change: tuple[str, str], says: str) -> None:
    path = tmp_path / "dtc.toml"
    path.write_text(data("vehicles/dtc.toml").read_text().replace(*change, 1))
    with pytest.raises(ValueError, match=says):
        DtcBook.load(path)


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
