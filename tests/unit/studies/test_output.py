"""The one form of what studies tell."""

import json

import pytest

from evaluation.tables.columns import Column
from evaluation.tables.tables import Value
from studies.output import Sheet, percent, show

SHEET = Sheet(
    ("what", percent("right"), Column(title="gap", unit="m")),
    [("a", 0.981, 1.0), ("b", None, float("nan")), ("c", Value(value=2.0, low=1.0, high=3.0), 4)],
    ["so much of it"],
    "All:",
)


def test_a_table_shows_each_value_in_the_unit_and_with_the_places_of_its_column() -> None:
    assert SHEET.markdown().splitlines() == [
        "All:", "", "| what | right, % | gap, m |", "|---|---|---|", "| a | 98.1 | 1.00 |", "| b | - | - |",
        "| c | 2.0 [1.0, 3.0] | 4 |", "", "so much of it",
    ]  # fmt: skip


def test_json_holds_the_same_rows_and_what_the_tables_leave_out(capsys: pytest.CaptureFixture[str]) -> None:
    show([SHEET], as_json=True, figures={"seeds": 3})
    told = json.loads(capsys.readouterr().out)
    assert told["tables"][0]["rows"][0] == {"what": "a", "right, %": 98.1, "gap, m": 1.0}
    assert told["tables"][0]["rows"][1] == {"what": "b", "right, %": None, "gap, m": None}
    assert told["figures"] == {"seeds": 3}


def test_lines_alone_need_no_table() -> None:
    assert Sheet((), (), ["nothing was seen"]).markdown() == "nothing was seen"
