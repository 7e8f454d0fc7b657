"""Every situation with a known answer is answered rightly, and in none is the limit above the law's."""

from collections import Counter
from functools import cache
from typing import get_args

import msgspec
import pytest

from proto.rules import LegalAction, LegalLimit, RulesAnswer
from services.rules.authoring.cases import answer
from studies.law.__main__ import sheet
from studies.law.scores import Measured, above_the_law, measure
from studies.law.situations import every_book, own_cases, read_table, situations
from tests.unit.services.rules.quotes import misquoted

PACKS = {
    "DEU-v1", "GBR-v1", "FRA-v1", "AUT-v1", "NLD-v1", "POL-v1", "CHE-v1", "BEL-v1", "IRL-v1", "ITA-v1", "ESP-v1", "USA-v1",
    "USA-CA-v1", "USA-NY-v1", "USA-TX-v1", "USA-FL-v1", "USA-WA-v1", "VIENNA-v1",
}  # fmt: skip


@cache
def from_the_law() -> Measured:
    return measure("from the law", every_book(), situations())


def answered(value: float | None, *, advisory: bool = False) -> RulesAnswer:
    limit = None if value is None else LegalLimit(value=value, unit="km/h", mps=value / 3.6, advisory=advisory)
    return RulesAnswer(
        legal_action="comply_with_limit", limit=limit, citations=(), confidence=1.0, rulepack_version="DEU-v1@1.0.0"
    )


def test_every_situation_is_answered_as_the_law_says() -> None:
    assert from_the_law().wrong == []


def test_no_limit_is_above_the_laws() -> None:
    assert from_the_law().total.above == 0


def test_the_packs_own_cases_hold_beside_all_other_packs() -> None:
    book = every_book()
    found = measure("own", book, own_cases(book))
    assert found.wrong == []
    assert found.total.above == 0


def test_every_answer_names_its_pack_and_quotes_what_stands_at_the_offsets() -> None:
    book = every_book()
    asked = [*situations(), *own_cases(book)]
    answers = [(case.name, answer(book, case)) for _, case in asked]
    assert [name for name, found in answers if "#" not in found.rulepack_version] == []
    assert {found.legal_action for _, found in answers} <= set(get_args(LegalAction))
    assert [wrong for _, found in answers for wrong in misquoted(found.citations)] == []
    uncited = [name for name, found in answers if not found.citations and getattr(found, "limit", None) is not None]
    assert uncited == []


def test_the_table_covers_every_country_and_names_its_sources() -> None:
    entries = read_table()
    counted = Counter(entry.pack for entry in entries)
    assert len(entries) >= 400
    assert set(counted) == PACKS
    assert min(counted.values()) >= 20
    assert len({entry.name for entry in entries}) == len(entries)
    assert all(entry.source and entry.expect for entry in entries)


@pytest.mark.parametrize(
    ("expect", "got", "above"),
    [
        ({"limit": [50, "km/h"]}, answered(50), False),
        ({"limit": [50, "km/h"]}, answered(51), True),
        ({"limit": [30, "mph"]}, answered(49), True),
        ({"limit": [50, "km/h"]}, answered(None), True),
        ({"limit": [50, "km/h"]}, answered(50, advisory=True), True),
        ({"limit": None}, answered(50), False),
        ({"limit": [130, "km/h"], "advisory": True}, answered(None), False),
    ],
)
def test_above_the_law_is_what_allows_more_than_expected(
    expect: dict[str, object], got: RulesAnswer, above: bool
) -> None:
    assert above_the_law(expect, got) is above


def test_a_wrong_expectation_is_counted_and_printed() -> None:
    pack, case = situations()[0]
    found = measure("one", every_book(), [(pack, msgspec.structs.replace(case, expect={"limit": [40, "km/h"]}))])
    assert not found.all_right
    assert (found.total.asked, found.total.right, found.total.above) == (1, 0, 1)
    assert f"wrong: {case.name}" in sheet(found).markdown()
