"""Runs become numbers: worked by hand."""

import csv
from pathlib import Path

import msgspec
import pytest

from evaluation.campaign.names import TABLES, TableName
from evaluation.metrics import RATES, Metrics
from evaluation.tables import files
from evaluation.tables.columns import (
    COLLISIONS,
    COLUMNS,
    FALSE,
    INFRACTIONS,
    LATENCY_P50,
    RESPONSE,
    Column,
    columns_of,
)
from evaluation.tables.goals import told
from evaluation.tables.tables import value_of
from tests.unit.evaluation.evaluate.made import NUMBERS, kept, table


@pytest.mark.parametrize("name", TABLES)
def test_columns_name_what_is_measured(name: TableName) -> None:
    fields = set(Metrics.__struct_fields__)
    for column in columns_of(name):
        if column.rate:
            assert {RATES[column.rate].count, RATES[column.rate].exposure} <= fields
            assert RATES[column.rate].unit == column.unit
        else:
            assert {each.partition(".")[0] for each in (column.field, *column.share) if each} <= fields


def test_a_rate_pools_all_runs_and_has_the_exact_interval() -> None:
    value = value_of(INFRACTIONS, [{**NUMBERS, "infractions_total": 3}, {**NUMBERS, "infractions_total": 0}])
    assert value.value == pytest.approx(3 / 4.0 * 10), "3 in 4 km"
    assert value.low == pytest.approx(0.6187 / 0.4, rel=1e-3)
    assert value.high == pytest.approx(8.7673 / 0.4, rel=1e-3)
    assert value.sd == pytest.approx(7.5 * 2**0.5), "15 and 0 per 10 km"
    assert value.of == "3 in 4.0 km"


def test_a_rate_of_nothing_has_an_upper_end_and_no_distance_has_none() -> None:
    none = value_of(INFRACTIONS, [{**NUMBERS, "infractions_total": 0}])
    assert none.value == none.low == 0.0
    assert none.high == pytest.approx(3.689 / 0.2, rel=1e-3)
    assert value_of(INFRACTIONS, []).value is None


def test_a_mean_is_over_runs_and_a_run_without_the_thing_is_left_out() -> None:
    value = value_of(
        RESPONSE, [NUMBERS, {**NUMBERS, "hazard_response_s": (0.5,)}, {**NUMBERS, "hazard_response_s": ()}]
    )
    assert value.value == pytest.approx((0.3 + 0.5) / 2)
    assert value.of == "2 runs"
    assert value_of(LATENCY_P50, [{**NUMBERS, "advisory_latency_s": (0.1, 0.2, 0.9)}]).value == pytest.approx(0.2)


def test_the_table_of_corruption_tells_what_a_rate_came_to() -> None:
    (column,) = (each for each in columns_of("corruption") if each.title == "signs corrupted")
    runs = [{**NUMBERS, "signs_corrupted": hit, "signs_drawn": drawn} for hit, drawn in ((8, 17), (4, 14))]
    value = value_of(column, runs)
    assert value.value == pytest.approx(100 * 12 / 31)
    assert value.of == "12 of 31"
    assert value_of(column, [NUMBERS]).value is None, "clean"
    assert column not in columns_of("results")


def column(title: str) -> Column:
    (found,) = (each for each in columns_of("results") if each.title == title)
    return found


def test_hazards_are_told_kind_by_kind_and_only_of_runs_that_had_the_kind() -> None:
    response, answered = column("hazard response, lead brakes"), column("hazards answered, lead brakes")
    runs = [
        {
            "hazard_response_by_kind_s": {"lead_brakes": times_s},
            "hazards_by_kind": {"lead_brakes": 2},
            "hazards_answered_by_kind": {"lead_brakes": len(times_s)},
        }
        for times_s in ((0.2, 0.6), (1.0,), ())
    ]
    other = {
        "hazard_response_by_kind_s": {"cut_in": (9.0,)},
        "hazards_by_kind": {"cut_in": 1},
        "hazards_answered_by_kind": {"cut_in": 1},
    }
    value = value_of(response, [*runs, other, NUMBERS])
    assert value.value == pytest.approx((0.4 + 1.0) / 2)
    assert value.of == "2 runs"
    value = value_of(answered, [*runs, other, NUMBERS])
    assert (value.value, value.of) == (50.0, "3 of 6")
    assert {each for each in columns_of("delta") if each in (response, answered)} == set()


def test_false_interventions_in_a_hazard_are_a_share_of_the_false_ones() -> None:
    runs = [{"false_interventions": 3, "false_while_hazard": 1}, {"false_interventions": 1, "false_while_hazard": 1}]
    value = value_of(column("of false interventions, while a hazard is on"), runs)
    assert (value.value, value.of) == (50.0, "2 of 4")


@pytest.mark.parametrize(
    "title",
    [
        "repeats within 20 s", "RSS violations", "RSS violations unanswered", "event F1 without overspeed",
        "of false interventions, while a hazard is on", "hazard response, stop line", "hazards answered, stop line",
    ],
)  # fmt: skip
def test_what_runs_of_older_code_did_not_measure_is_no_number(title: str) -> None:
    value = value_of(column(title), [NUMBERS, {**NUMBERS, "hazards": 3, "hazards_answered": 3}])
    assert (value.value, told(value, column(title))) == (None, "-")


def test_a_share_pools_counts() -> None:
    value = value_of(FALSE, [NUMBERS, {**NUMBERS, "interventions": 0, "false_interventions": 0}])
    assert (value.value, value.of) == (25.0, "1 of 4")
    assert value_of(FALSE, [{**NUMBERS, "interventions": 0, "false_interventions": 0}]).value is None


def test_failed_runs_are_counted_as_missing() -> None:
    made = table("delta", lambda row, number: None if number else kept())
    assert {row.missing for row in made.rows} == {1}
    assert {row.km for row in made.rows} == {2.0}


def test_files_hold_every_run_and_row(tmp_path: Path) -> None:
    made = table("delta", lambda row, number: kept())
    files.write(tmp_path, [made])
    with (tmp_path / "runs.csv").open(encoding="utf-8") as file:
        runs = list(csv.DictReader(file))
    assert len(runs) == 2 * len(made.rows)
    assert runs[0]["hazard_response_s"] == "0.2 0.4"
    with (tmp_path / "delta.csv").open(encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    assert float(rows[0]["interventions [/10 km]"]) == 20.0
    assert float(rows[0]["interventions [/10 km] paper"]) == 3.2
    told = msgspec.json.decode((tmp_path / "delta.json").read_bytes())
    assert len(told["table"]["rows"]) == len(made.rows)
    assert len(COLUMNS["delta"]) == 3


def test_seconds_an_hour_have_the_interval_of_what_they_are() -> None:
    """One long run and five short ones, in which much went wrong: the short ones count for little, in the interval too."""
    (column,) = (each for each in columns_of("results") if each.title == "wrong limit")
    count, exposure = RATES[column.rate].count, RATES[column.rate].exposure
    runs = [{count: 0.0, exposure: 3600.0}, *({count: 30.0, exposure: 60.0} for _ in range(5))]
    value = value_of(column, runs)
    assert value.value == pytest.approx(150.0 / 3900.0 * 3600.0)
    assert value.low is not None
    assert value.high is not None
    assert value.value is not None
    assert value.low <= value.value <= value.high


def test_a_run_that_could_not_be_judged_is_in_no_share() -> None:
    unjudged = {**NUMBERS, "interventions": 4, "false_interventions": None}
    value = value_of(FALSE, [unjudged, {**NUMBERS, "interventions": 2, "false_interventions": 2}])
    assert (value.value, value.of) == (100.0, "2 of 2")


def test_what_happens_before_the_first_metre_is_counted() -> None:
    value = value_of(COLLISIONS, [{**NUMBERS, "collisions": 1, "distance_m": 0.0}, NUMBERS])
    assert (value.value, value.of) == (500.0, "1 in 2.0 km")
