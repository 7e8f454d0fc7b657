"""The tables as data: rows, runs, seeds."""

import msgspec
import pytest

from evaluation.campaign.names import PROPOSER, TABLES, TableName
from evaluation.campaign.plan import FAMILIES, Amount, placed, route_m, rows_of, runs_of, with_settings
from evaluation.corruption.spec import CLEAN, read_spec
from evaluation.run.methods import OBEDIENT
from evaluation.run.spec import run_key
from evaluation.tables.paper import paper, paper_rows


@pytest.mark.parametrize("table", [*TABLES, PROPOSER])
def test_every_row_of_the_paper_stands_beside_one_of_ours(table: TableName) -> None:
    assert set(paper_rows(table)) <= {row.paper for row in rows_of(table, "rendered")}


@pytest.mark.parametrize("table", [*TABLES, PROPOSER])
def test_keys_of_rows_are_unique(table: TableName) -> None:
    keys = [row.key for row in rows_of(table, "rendered")]
    assert len(keys) == len(set(keys))


def test_all_methods_meet_the_same_place_and_seed() -> None:
    for family in FAMILIES:
        rows = [row for row in rows_of("results", "rendered") if row.family == family]
        met = {(placed(row, 3, 0.0).scenario, placed(row, 3, 0.0).seed) for row in rows}
        assert met == {(f"{family}/test/3", 1004)}


def test_what_is_corrupted_is_drawn_anew_in_each_place_and_alike_for_all_rates() -> None:
    for row in rows_of("corruption", "model"):
        specs = [placed(row, number, 0.0) for number in range(4)]
        if row.spec.corruption == CLEAN:
            assert {spec.corruption for spec in specs} == {CLEAN}
            continue
        asked = read_spec(row.spec.corruption)
        drawn = [read_spec(spec.corruption) for spec in specs]
        assert [each.seed for each in drawn] == [1, 2, 3, 4]
        assert {msgspec.structs.replace(each, seed=asked.seed) for each in drawn} == {asked}


def test_obedient_drivers_are_a_row_of_the_results_alone_and_else_the_full_system() -> None:
    for table in TABLES:
        rows = {row.key: row for row in rows_of(table, "model") if row.label == OBEDIENT.label}
        assert len(rows) == (3 if table == "results" else 0)
        for row in rows.values():
            (ours,) = [each for each in rows_of("results", "model") if each.key == f"{row.family}/DriveMCP"]
            assert row.spec.settings == with_settings(ours.spec, "simulator", {"driver": "obedient"}).settings
            assert row.paper not in paper_rows("results")


def test_the_faulty_and_the_sound_car_differ_in_the_faults_alone() -> None:
    rows = {row.key: placed(row, 0, 0.0) for row in rows_of("can-fault", "rendered")}
    faulty, sound = rows["DriveMCP/faulty"], rows["DriveMCP/sound"]
    assert faulty.settings["simulator"]["faults"] == ["abs_fault@2", "low_tyre@2"]
    assert msgspec.structs.replace(faulty, settings=sound.settings) == sound


def test_tables_share_the_runs_that_are_the_same() -> None:
    keys = {}
    for table, row in (("results", "cross-border/DriveMCP"), ("corruption", "clean"), ("ablation", "DriveMCP")):
        (found,) = [each for each in rows_of(table, "rendered") if each.key == row]  # type: ignore[arg-type]
        keys[table] = run_key(placed(found, 0, 0.0))
    assert len(set(keys.values())) == 1


def test_the_first_run_of_every_row_comes_before_any_second_one() -> None:
    numbers = [run.number for run in runs_of(rows_of("delta", "rendered"), Amount(runs=3))]
    assert numbers == sorted(numbers)
    assert len(numbers) == 3 * len(rows_of("delta", "rendered"))


def test_kilometres_are_reached_by_the_length_of_the_routes() -> None:
    rows = rows_of("delta", "rendered")[:1]
    runs = runs_of(rows, Amount(km=5.0))
    lengths = [route_m(rows[0].family, run.number) for run in runs]
    assert sum(lengths) >= 5000 > sum(lengths[:-1])


@pytest.mark.parametrize("amount", [Amount(runs=2, first=20), Amount(km=2.0, first=20)])
def test_places_may_begin_anywhere(amount: Amount) -> None:
    runs = runs_of(rows_of("results", "model"), amount)
    numbers = sorted({run.number for run in runs})
    assert numbers == list(range(20, 20 + len(numbers)))
    assert all(run.spec.scenario == f"{run.row.family}/test/{run.number}" for run in runs)
    if amount.km is not None:
        for family in FAMILIES:
            lengths = [route_m(family, run.number) for run in runs if run.row.key == f"{family}/DriveMCP"]
            assert sum(lengths) >= 2000.0 > sum(lengths[:-1])


def test_one_method_may_drive_farther_than_the_others_of_the_results_alone() -> None:
    rows = [*rows_of("results", "model"), *rows_of("ablation", "model")]
    runs = runs_of(rows, Amount(runs=1, km_of={"DriveMCP": 6.0}))
    many = {run.row.key for run in runs if run.number > 0}
    assert many == {f"{family}/DriveMCP" for family in FAMILIES}
    for family in FAMILIES:
        lengths = [route_m(family, run.number) for run in runs if run.row.key == f"{family}/DriveMCP"]
        assert sum(lengths) >= 6000 > sum(lengths[:-1])


def test_one_table_may_have_more_runs_a_row_than_the_others() -> None:
    rows = [*rows_of("corruption", "model"), *rows_of("ablation", "model")]
    runs = runs_of(rows, Amount(runs=2, runs_of={"corruption": 3}))
    assert {(run.row.table, run.number) for run in runs} == {
        ("corruption", 0), ("corruption", 1), ("corruption", 2), ("ablation", 0), ("ablation", 1),
    }  # fmt: skip
    assert len(runs_of(rows, Amount(runs=4, runs_of={"corruption": 3}))) == 4 * len(rows)


def test_modelled_sensors_have_no_row_without_tracking() -> None:
    assert "No tracking" not in {row.key for row in rows_of("ablation", "model")}


def test_the_papers_numbers_are_as_printed() -> None:
    assert paper()["source"]
    assert paper_rows("results")["CROSS-BORDER/DriveMCP"]["infractions_per_10km"] == 0.2
    assert paper_rows("delta")["0.2"]["false_positive_pct"] == 8
    assert paper_rows("can-fault")["DriveMCP"]["target_kph"] == 65


def test_of_a_group_of_settings_those_that_are_not_named_stay() -> None:
    row = next(row for row in rows_of(PROPOSER, "model") if row.label.endswith("forms"))
    spec = with_settings(row.spec, "drivelm", {"gguf": {"threads": 2}})
    assert spec.settings["drivelm"]["gguf"] == {"decoding": "forms", "threads": 2}
