"""The packs' own test cases hold."""

import msgspec
import pytest

from drivemcp.paths import data
from services.rules.authoring.cases import failures
from services.rules.book import RuleBook, load_book
from services.rules.errors import PackError
from services.rules.packs.format import Case
from services.rules.packs.loading import load

NAMES = ("DEU-v1", "DEU-v1-VSL", "GBR-v1")
PACKS = sorted(path.parent.name for path in data("rulepacks").glob("*/manifest.json"))
CASES = [(name, case) for name in PACKS for case in load(data(f"rulepacks/{name}")).cases]
BOOKS = {name: load_book([data(f"rulepacks/{name}")])[0] for name in PACKS}


@pytest.mark.parametrize(("name", "case"), CASES, ids=[f"{name}: {case.name}" for name, case in CASES])
def test_what_the_pack_says_of_itself_holds(name: str, case: Case) -> None:
    assert failures(BOOKS[name], case) == []


@pytest.mark.parametrize("name", NAMES)
def test_german_cases_hold_beside_the_other_packs_too(name: str, book: RuleBook) -> None:
    for case in load(data(f"rulepacks/{name}")).cases:
        assert failures(book, case) == []


def test_a_wrong_expectation_is_found() -> None:
    _, case = CASES[0]
    wrong = msgspec.structs.replace(case, expect={"limit": [51, "km/h"], "cites": ["nothing"], "max_confidence": 0.1})
    assert len(failures(BOOKS["DEU-v1"], wrong)) == 3


def test_a_malformed_question_names_the_case() -> None:
    _, case = CASES[0]
    with pytest.raises(PackError, match=f"case '{case.name}': ask"):
        failures(BOOKS["DEU-v1"], msgspec.structs.replace(case, ask={"wet": "perhaps"}))
