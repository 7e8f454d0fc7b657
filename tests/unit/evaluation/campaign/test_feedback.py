"""A row that adapts goes from drive to drive; all others stand still."""

from pathlib import Path

import msgspec
import pytest

from evaluation.campaign.feedback import specs_of
from evaluation.campaign.plan import ADAPTING, OURS, Amount, Run, rows_of, runs_of, with_settings
from evaluation.campaign.store import MEASURES, METRICS, Store
from evaluation.metrics import Record
from evaluation.metrics.labels import labelled
from evaluation.run.spec import RunSpec
from tests.unit.evaluation.evaluate.made import kept
from tests.unit.evaluation.metrics.logs import hazard, steady
from tests.unit.services.arbiter.support import CALIBRATED

QUIET = Record(truths=steady(10.0))
LATE = Record(truths=steady(10.0, hazards=(hazard("stopped_lead", 2.0, 150.0),)))


def runs_with(key: str, count: int = 3) -> list[Run]:
    return [run for run in runs_of(rows_of("ablation", "model"), Amount(runs=count)) if run.row.key == key]


def drive(store: Store, spec: RunSpec, record: Record) -> None:
    """Leave a run of that spec as if it had been driven and had come out like that."""
    folder = store.path(store.key(spec))
    folder.mkdir(parents=True)
    told = msgspec.structs.replace(kept(), measured_by=MEASURES, labelled=labelled(record))
    (folder / METRICS).write_bytes(msgspec.json.encode(told))


def test_each_drive_begins_where_labels_on_the_last_one_have_left_it(tmp_path: Path) -> None:
    store, runs = Store(tmp_path), runs_with(ADAPTING)
    deltas = [CALIBRATED.delta]
    for known, run in enumerate(runs, 1):
        specs = specs_of(runs, store)
        assert len(specs) == known, "the next one is known when this one is driven"
        learnt = specs[id(run)].settings.get("arbiter", {}).get("learnt")
        deltas += [learnt[0]] if learnt else []
        drive(store, specs[id(run)], LATE)
    assert deltas == sorted(deltas, reverse=True), "told late each time, it speaks earlier each time"
    assert len(set(deltas)) == len(runs)
    assert all(CALIBRATED.delta_low <= delta <= CALIBRATED.delta_high for delta in deltas)


def test_its_first_drive_is_drivemcps_own_and_no_other_row_learns(tmp_path: Path) -> None:
    store = Store(tmp_path)
    adapting, ours = runs_with(ADAPTING), runs_with(OURS)
    specs = specs_of([*adapting, *ours], store)
    assert specs[id(adapting[0])] == specs[id(ours[0])]
    assert [specs[id(run)] for run in ours] == [run.spec for run in ours]


def test_published_drives_are_begun_from_as_those_that_are_here(tmp_path: Path) -> None:
    here, runs = Store(tmp_path / "here"), runs_with(ADAPTING)
    for run in runs:
        drive(here, specs_of(runs, here)[id(run)], LATE)
    specs = specs_of(runs, here)
    keys = [here.key(spec) for spec in specs.values()]
    published = {key: found for key in keys if (found := here.kept(key)) is not None}
    assert specs_of(runs, Store(tmp_path / "fresh", published)) == specs
    assert len(set(keys)) == len(runs), "each begins with something else"


def test_drives_that_nobody_labels_change_nothing_but_what_they_say_they_begin_with(tmp_path: Path) -> None:
    store, runs = Store(tmp_path), runs_with(ADAPTING, 2)
    drive(store, specs_of(runs, store)[id(runs[0])], QUIET)
    learnt = specs_of(runs, store)[id(runs[1])].settings["arbiter"]["learnt"]
    assert learnt == [CALIBRATED.delta, CALIBRATED.c_min]


def test_a_row_whose_delta_was_set_learns_from_there(tmp_path: Path) -> None:
    given = (CALIBRATED.delta + CALIBRATED.delta_high) / 2
    store, plain = Store(tmp_path), runs_with(ADAPTING, 2)
    runs = [msgspec.structs.replace(r, spec=with_settings(r.spec, "arbiter", {"delta": given})) for r in plain]
    drive(store, specs_of(runs, store)[id(runs[0])], QUIET)
    settings = specs_of(runs, store)[id(runs[1])].settings["arbiter"]
    assert (settings["delta"], settings["learnt"][0]) == (given, pytest.approx(given))
