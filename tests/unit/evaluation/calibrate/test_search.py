"""The search: better than it started, never twice, and no change without evidence."""

from pathlib import Path

import pytest

from evaluation.calibrate.constants import BY_NAME, Candidate, shipped
from evaluation.calibrate.score import UNFIT, Counts
from evaluation.calibrate.search import TRIALS, Found, Trials, search
from tests.unit.services.arbiter.support import CALIBRATED


class Landscape:
    """A made-up world in which false interventions fall with act_watched_s and nothing else matters."""

    def __init__(self) -> None:
        self.asked: list[Candidate] = []

    def __call__(self, candidate: Candidate) -> list[Counts]:
        self.asked.append(candidate)
        row = BY_NAME["act_watched_s"]
        share = (candidate.values[row.name] - row.low) / (row.high - row.low)
        return [Counts(km=10.0, false_interventions=round(1000 * (1.0 - share)))]


@pytest.fixture
def log(tmp_path: Path) -> Path:
    (file := tmp_path / "log.mcap").write_bytes(b"a drive")
    return file


def found(folder: Path, log: Path, world: Landscape, count: int = 40) -> Found:
    return search(Trials(folder, [log], CALIBRATED, world), CALIBRATED, count, 3, lambda *_: None)


def test_it_finds_what_helps_and_leaves_the_rest_as_shipped(tmp_path: Path, log: Path) -> None:
    result = found(tmp_path, log, Landscape())
    assert result.best.objective < result.shipped.objective
    moved = {
        name for name, value in result.best.candidate.values.items() if value != result.shipped.candidate.values[name]
    }
    assert "act_watched_s" in moved
    assert len(moved) <= 3, "what changes nothing goes back"


def test_the_same_search_goes_on_where_it_was_cut_and_tries_nothing_twice(tmp_path: Path, log: Path) -> None:
    whole, first = Landscape(), Landscape()
    expected = found(tmp_path / "whole", log, whole)

    class Cut(Exception):
        pass

    def stops(count: int, _: object) -> None:
        if count == 17:
            raise Cut

    with pytest.raises(Cut):
        search(Trials(tmp_path / "cut", [log], CALIBRATED, first), CALIBRATED, 40, 3, stops)
    with (tmp_path / "cut" / TRIALS).open("ab") as file:
        file.write(b'{"key": "half a li')  # killed while it wrote
    second = Landscape()
    assert found(tmp_path / "cut", log, second) == expected
    assert len(first.asked) + len(second.asked) == len(whole.asked)


def test_other_drives_are_other_trials(tmp_path: Path, log: Path) -> None:
    found(tmp_path, log, Landscape(), 5)
    log.write_bytes(b"another drive")
    again = Landscape()
    found(tmp_path, log, again, 5)
    assert again.asked


def test_what_the_design_refuses_is_not_decided_again_and_never_the_best(tmp_path: Path, log: Path) -> None:
    world = Landscape()
    trial = Trials(tmp_path, [log], CALIBRATED, world).run(shipped(CALIBRATED).moved("c_act", 0.45))
    assert (trial.objective, world.asked) == (UNFIT, [])
    assert trial.refused
