"""Logs of other code's runs decided again: what comes out otherwise counts for nothing, and the file keeps it."""

import sys
from collections.abc import Callable, Iterator
from pathlib import Path

import msgspec
import pytest

from evaluation.evaluate import published
from evaluation.evaluate import redecided as redecided_module
from evaluation.evaluate.alike import groups
from evaluation.evaluate.published import Line, line_of, publish, read
from evaluation.evaluate.redecided import main, redecided
from evaluation.evaluate.store import LOG
from proto.decision import TraceRecord
from tests.unit.app.replay.drive import drive, write_log
from tests.unit.evaluation.evaluate import test_alike as runs
from tests.unit.evaluation.evaluate.test_alike import COMES_TO, DRAWN, FAMILIES, SPECS, evaluate, file
from tests.unit.evaluation.evaluate.test_published import of_other_code

__all__ = ["file"]
replace = msgspec.structs.replace
KEYS = dict(zip(SPECS, (line.key for line in runs.lines()), strict=True))
"""Under which each run was driven by other code."""


@pytest.fixture(scope="module")
def traces() -> list[TraceRecord]:
    return drive(30)


@pytest.fixture
def logged(tmp_path: Path, traces: list[TraceRecord]) -> Callable[..., Path]:
    """A run's log in its folder; `changed`: with a word in it that today's code would not say."""

    def write(key: str, *, changed: bool = False) -> Path:
        (tmp_path / "runs" / key).mkdir(parents=True)
        said = [*traces]
        if changed:
            said[20] = replace(said[20], fused=replace(said[20].fused, directive="Drive on"))
        path: Path = tmp_path / "runs" / key / LOG
        write_log(path, said, tmp_path / "secrets")
        return path

    return write


def run(file: Path, monkeypatch: pytest.MonkeyPatch) -> int:
    monkeypatch.setattr(sys, "argv", ["redecided", str(file), "--runs", str(file.parent / "runs"), "--jobs", "1"])
    return main()


def line(file: Path, key: str) -> Line:
    return read(file)[KEYS[key]]


def test_a_log_is_decided_alike_or_otherwise_or_says_nothing(logged: Callable[..., Path]) -> None:
    assert redecided(logged("same")) == "alike"
    assert redecided(logged("changed", changed=True)) == "otherwise"
    tampered = logged("tampered")
    whole = bytearray(tampered.read_bytes())
    whole[len(whole) // 2] ^= 1
    tampered.write_bytes(whole)
    assert redecided(tampered) == ""
    cut = logged("cut")
    cut.write_bytes(cut.read_bytes()[:-200])
    assert redecided(cut) == "", "what stood behind the cut might have come out otherwise"


def test_of_a_log_that_begins_in_the_midst_of_a_drive_nothing_is_known(
    tmp_path: Path, traces: list[TraceRecord]
) -> None:
    write_log(tmp_path / "late.mcap", [replace(each, state=None) for each in traces[5:]], tmp_path / "secrets")
    assert redecided(tmp_path / "late.mcap") == ""


def test_what_is_decided_otherwise_is_driven_anew_and_speaks_not_against_the_others(
    file: Path, logged: Callable[..., Path], monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    first, second, third = FAMILIES["urb-rain"]
    logged(KEYS[first], changed=True)
    logged(KEYS[second])
    assert run(file, monkeypatch) == 0
    assert capsys.readouterr().out == (
        f"9 runs of other code: 1 decided again alike, 1 otherwise ({KEYS[first]}), 0 not decidable, 7 without a log here\n"
    )
    assert line(file, first).refuted
    assert not line(file, second).refuted
    runs.otherwise(first)
    assert evaluate(file, "--alike", "1", "--publish", str(file)) == 0
    drawn = [key for key in DRAWN if key != first]
    assert sorted(runs.Drives.asked) == sorted([*drawn, first, second]), "and of the other two one was drawn"
    told = (file.parent / "out" / "report.html").read_text(encoding="utf-8").replace("&#x27;", "'")
    assert f"2 in urb-rain ({runs.OTHER})" in told, "count"
    assert "The logs of 1 runs of other code were decided again by today's, every tick alike." in told
    assert f"1 others do not count, as today's decides otherwise in their logs: {KEYS[first]}." in told
    assert read(file)[first].outcome == "another"
    assert line(file, first).refuted, "the file keeps both"
    assert line(file, third).redecided_by == ""


def test_where_other_code_is_ignored_nothing_is_said_of_its_logs(
    file: Path, logged: Callable[..., Path], monkeypatch: pytest.MonkeyPatch
) -> None:
    for key, changed in zip(FAMILIES["urb-rain"], (True, False, False), strict=True):
        logged(KEYS[key], changed=changed)
    assert run(file, monkeypatch) == 0
    assert evaluate(file) == 0
    text = (file.parent / "out" / "report.html").read_text(encoding="utf-8")
    assert "the other 9 are ignored" in text
    assert "logs of" not in text


def test_what_was_decided_again_by_yet_other_code_is_decided_again(
    file: Path, logged: Callable[..., Path], monkeypatch: pytest.MonkeyPatch
) -> None:
    key = FAMILIES["urb-rain"][0]
    there = read(file)
    published.write(file, {**there, KEYS[key]: replace(line(file, key), redecided="otherwise", redecided_by="before")})
    assert not line(file, key).refuted
    logged(KEYS[key])
    assert run(file, monkeypatch) == 0
    assert line(file, key).redecided == "alike"
    assert line(file, key).redecided_today


def test_who_has_no_logs_is_told_so(
    file: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run(file, monkeypatch) == 2
    assert "no log of a run of other code" in capsys.readouterr().err


def test_a_file_without_marks_is_read_and_its_groups_are_whole(tmp_path: Path) -> None:
    old = tmp_path / "old.jsonl"
    publish(old, [of_other_code(line_of(key, spec, COMES_TO[key])) for key, spec in SPECS.items()])
    bare = old.read_text().replace(',"redecided":"","redecided_by":""', "")
    assert bare != old.read_text()
    old.write_text(bare)
    assert sum(len(group.lines) for group in groups(read(old))) == len(SPECS)


def test_what_others_publish_meanwhile_stays(
    file: Path, logged: Callable[..., Path], monkeypatch: pytest.MonkeyPatch
) -> None:
    logged(KEYS[FAMILIES["urb-rain"][0]])
    new = line_of(key := DRAWN[0], SPECS[key], COMES_TO[key])

    def each(logs: dict[Path, Line], _: int) -> Iterator[tuple[Line, published.Redecided]]:
        publish(file, [new])
        for line in logs.values():
            yield line, "alike"

    monkeypatch.setattr(redecided_module, "each", each)
    assert run(file, monkeypatch) == 0
    assert read(file)[new.key] == new
    assert line(file, FAMILIES["urb-rain"][0]).redecided == "alike"
