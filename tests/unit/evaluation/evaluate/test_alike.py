"""Published runs of other code count as today's once some of them, drawn, came out alike; else they do not."""

from collections.abc import Iterator
from pathlib import Path

import msgspec
import pytest

from drivemcp.cli import run
from evaluation.evaluate import report, whole
from evaluation.evaluate.alike import drawn, groups, judged, may_differ
from evaluation.evaluate.pool import Done, Job
from evaluation.evaluate.published import ALL, publish, read
from evaluation.evaluate.store import Kept, Store
from tests.unit.evaluation.evaluate.test_published import ASKED, SPECS, finished, leave, lines, of_other_code

OTHER = "000000000000-000000000000"
KEYS = [line.key for line in lines()]
"""Of today's code."""


class Drives:
    """In place of the pool: leaves in the folder what a run is said to come to."""

    comes_to: dict[str, Kept]
    asked: list[str]

    def __init__(self, folder: str, *_: object) -> None:
        self._out = Path(folder).parent

    def done(self, jobs: list[Job]) -> Iterator[Done]:
        for job in jobs:
            type(self).asked.append(job.key)
            leave(self._out, job.spec, type(self).comes_to[job.key])
            yield Done(job.key, "", 1.0)


@pytest.fixture
def file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Three runs of other code, published; whoever drives them anew comes to the same."""
    monkeypatch.setattr(report, "plots_of", lambda _: ())
    monkeypatch.setattr(whole, "Pool", Drives)
    Drives.comes_to = {key: finished(nags=at) for at, key in enumerate(KEYS)}
    Drives.asked = []
    path = tmp_path / "runs.jsonl"
    publish(path, map(of_other_code, lines()))
    return path


def evaluate(file: Path, *more: str) -> int:
    return run([*ASKED, "--out", str(file.parent / "out"), "--published", str(file), *more])


def test_one_that_was_drawn_and_came_out_alike_speaks_for_the_others(
    file: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert evaluate(file, "--alike", "1") == 0
    assert Drives.asked == [min(KEYS)]
    said = "count as today's: 1 of them, drawn by their keys and driven by today's code as well, came out alike, to the bit"
    assert said in capsys.readouterr().err
    text = (file.parent / "out" / "report.html").read_text(encoding="utf-8")
    assert "2 runs are taken from" in text
    assert "0 of its 3 runs fit this code and its models; the other 3 are of other code" in text
    assert f"3 runs of other code ({OTHER}) {said}" in text.replace("&#x27;", "'")
    assert "--alike 1" in text, "the command that makes these tables"
    assert all(f"--again {key}" in text for key in KEYS if key != min(KEYS)), "what drives it here"


def test_one_that_came_out_otherwise_speaks_against_all(file: Path, capsys: pytest.CaptureFixture[str]) -> None:
    Drives.comes_to[min(KEYS)] = msgspec.structs.replace(Drives.comes_to[min(KEYS)], outcome="another")
    assert evaluate(file, "--alike", "1") == 0
    assert sorted(Drives.asked) == sorted(KEYS), "all are driven by today's code"
    assert f"do not count: {min(KEYS)} came out otherwise by today's" in capsys.readouterr().err


def test_so_does_one_that_was_not_drawn(file: Path, capsys: pytest.CaptureFixture[str]) -> None:
    last = max(KEYS)
    leave(file.parent / "out", SPECS[KEYS.index(last)], finished(nags=99))
    assert evaluate(file, "--alike", "1") == 0
    assert f"do not count: {last} came out otherwise by today's" in capsys.readouterr().err


def test_what_was_drawn_and_could_not_be_driven_lets_none_count(
    file: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(Drives, "done", lambda self, jobs: iter(()))
    assert evaluate(file, "--alike", "2") == 1
    assert "do not count: 2 of those that were drawn are not driven by today's" in capsys.readouterr().err


def test_the_next_sitting_finds_in_the_file_what_today_drove(file: Path) -> None:
    assert evaluate(file, "--alike", "1", "--publish", str(file)) == 0
    there = read(file)
    assert sum(line.of_today for line in there.values()) == 1
    assert len(there) == 4, "those of other code stay what they are"
    other = file.with_name("other.jsonl")
    assert (
        run(
            [*ASKED, "--out", str(file.parent / "b"), "--published", str(file), "--alike", "1", "--publish", str(other)]
        )
        == 0
    )
    assert Drives.asked == [min(KEYS)], "nothing was driven"
    assert {line.driven_by == OTHER for line in read(other).values()} == {True, False}
    assert len(read(other)) == 3


def test_without_the_word_other_code_is_ignored(file: Path) -> None:
    assert evaluate(file) == 0
    assert sorted(Drives.asked) == sorted(KEYS)


@pytest.mark.parametrize("again", [max(KEYS), ALL])
def test_what_is_asked_for_again_is_driven(file: Path, again: str) -> None:
    assert evaluate(file, "--alike", "1", "--again", again) == 0
    assert set(Drives.asked) == ({min(KEYS), max(KEYS)} if again != ALL else set(KEYS))


def test_runs_of_other_code_need_a_file(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run([*ASKED, "--out", str(tmp_path / "out"), "--alike", "1"]) == 2
    assert "--alike counts runs of --published" in capsys.readouterr().err


def test_runs_that_others_measured_are_in_no_group() -> None:
    foreign = [msgspec.structs.replace(of_other_code(line), measured_by="before") for line in lines()]
    assert groups({line.key: line for line in foreign}) == ()


def test_a_draw_is_of_what_is_wanted_and_each_code_draws_by_its_own_keys(tmp_path: Path) -> None:
    (group,) = groups({line.key: line for line in map(of_other_code, lines())})
    assert group.driver == OTHER
    assert set(group.lines) == set(KEYS)
    assert drawn(group, KEYS, 2) == tuple(sorted(KEYS)[:2])
    assert drawn(group, [max(KEYS), "of-another-table"], 2) == (max(KEYS),)
    verdict = judged(group, drawn(group, KEYS, 2), Store(tmp_path), {})
    assert (verdict.alike, verdict.lacking, verdict.counts) == ((), 2, False)


def test_how_much_a_draw_leaves_open() -> None:
    # with 14 alike of 14, a share of 19.3 % of odd runs would have had a chance of 5 %
    assert may_differ(14) == pytest.approx(0.193, abs=0.001)
    assert may_differ(1) == pytest.approx(0.95)
