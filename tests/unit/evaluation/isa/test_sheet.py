"""Euro NCAP's sheet: what passes, and the points that its package gives for it."""

import builtins
from typing import Any

import pytest

from evaluation.isa import sheet
from evaluation.isa.capabilities import DRIVES, DYNAMIC, DYNAMIC_LANES, capabilities

ALL = capabilities(dict.fromkeys(DRIVES, True))


@pytest.mark.parametrize(
    ("right", "changes", "tests", "failed"),
    [
        (0.99, 0.98, True, set()),
        (0.989, 0.98, True, {sheet.DISTANCE}),
        (0.99, 0.979, True, {sheet.EVENT}),
        (1.0, 1.0, False, {sheet.GENERAL}),
    ],
)
def test_accuracy_passes_at_its_goals_and_warnings_where_all_tests_do(
    right: float, changes: float, tests: bool, failed: set[str]
) -> None:
    assert {name for name, passed in sheet.lines(right, changes, tests, ALL).items() if not passed} == failed


def test_without_the_package_the_table_says_what_to_install(monkeypatch: pytest.MonkeyPatch) -> None:
    load = builtins.__import__

    def refuse(name: str, *rest: Any) -> Any:
        if name.startswith("euroncap"):
            raise ImportError(name)
        return load(name, *rest)

    monkeypatch.setattr(builtins, "__import__", refuse)
    assert {value for _, value, _ in sheet.rows({})} == {sheet.MISSING}


@pytest.mark.filterwarnings("ignore")
def test_the_package_scores_what_is_measured_and_nothing_for_what_is_not_offered() -> None:
    pytest.importorskip("euroncap_rating_2026")
    found = sheet.points(sheet.lines(1.0, 1.0, True, ALL))
    # rain 0.4, arrows 0.1, vehicle categories 0.2, implicit 0.5, dynamic 0.25 twice
    assert found == pytest.approx(
        {"accuracy": 4.0, "advanced limits": 1.7, "local hazards": 0.0, "updates": 0.0, "control": 0.0}
    )
    assert sum((sheet.points(sheet.lines(1.0, 1.0, False, ALL)) or {}).values()) == 0.0, (
        "general requirements gate it all"
    )
    lanes_alone = {**ALL, DYNAMIC: False}
    assert lanes_alone[DYNAMIC_LANES]
    assert (sheet.points(sheet.lines(1.0, 1.0, True, lanes_alone)) or {})["advanced limits"] == pytest.approx(1.2)
    assert found is not None
    assert found.keys() == sheet.PARTS.keys()
