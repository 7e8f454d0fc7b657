"""The documentation states the constants and events that are in force."""

import pytest

from services.arbiter.profiles.table import BEGIN, with_table
from services.orchestrator.events import TABLE
from tests.shared import ROOT

DOCUMENT = ROOT / "docs" / "explanation" / "safety.md"


@pytest.fixture
def document() -> str:
    if not DOCUMENT.is_file():
        pytest.skip("docs/explanation/safety.md is not installed with the package")
    return DOCUMENT.read_text(encoding="utf-8")


def test_the_constants_in_the_documentation_are_those_of_the_profiles(document: str) -> None:
    assert BEGIN in document
    assert with_table(document) == document, "run: python -m services.arbiter.profiles.table docs/explanation/safety.md"


def test_the_event_table_in_the_documentation_is_the_one_in_force(document: str) -> None:
    rows = {line.split("|")[1].strip(): line.split("|") for line in document.splitlines() if line.startswith("| ")}
    for row in TABLE:
        assert float(rows[row.kind][3]) == row.eta, row.kind
        if row.kind != "stale_fact":
            assert all(tool in rows[row.kind][4] for tool in row.tools), row.kind
