"""Published runs of other code count as today's once some of them, drawn, came out alike; else they do not."""

from collections.abc import Iterator
from pathlib import Path

import msgspec
import pytest

from drivemcp.cli import run
from evaluation.evaluate import report, whole
from evaluation.evaluate.alike import NAMED, drawn, groups, judged, may_differ, sentences
from evaluation.evaluate.plan import Amount, rows_of, runs_of
from evaluation.evaluate.pool import Done, Job
from evaluation.evaluate.published import ALL, Line, line_of, publish, read
from evaluation.evaluate.store import Kept, Store
from evaluation.run.spec import key_of
from tests.unit.evaluation.evaluate.test_published import ASKED, finished, leave, of_other_code

OTHER, LATER = "000000000000-000000000000", "111111111111-111111111111"
SPECS = {
    Store(Path("nowhere")).key(each.spec): each.spec
    for each in runs_of(rows_of("results", "model"), Amount(runs=3, seconds=5.0))
    if each.row.spec.method == "DriveMCP"
}
"""Three runs of each family, by their keys of today's code."""
COMES_TO = {key: finished(nags=at) for at, key in enumerate(SPECS)}
FAMILIES = {
    family: sorted(key for key, spec in SPECS.items() if spec.scenario.startswith(family))
    for family in ("cross-border", "dynamic-vsl", "urb-rain")
}
DRAWN = sorted(keys[0] for keys in FAMILIES.values())
"""One of each family."""


def lines() -> list[Line]:
    return [of_other_code(line_of(key, spec, COMES_TO[key])) for key, spec in SPECS.items()]


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
    """Nine runs of other code, published; whoever drives them anew comes to the same."""
    monkeypatch.setattr(report, "plots_of", lambda _: ())
    monkeypatch.setattr(whole, "Pool", Drives)
    Drives.comes_to = dict(COMES_TO)
    Drives.asked = []
    path = tmp_path / "runs.jsonl"
    publish(path, lines())
    return path


def evaluate(file: Path, *more: str, out: str = "out") -> int:
    return run([*ASKED, "--runs", "3", "--out", str(file.parent / out), "--published", str(file), *more])


def otherwise(key: str) -> None:
    Drives.comes_to[key] = msgspec.structs.replace(COMES_TO[key], outcome="another")


def test_one_that_was_drawn_and_came_out_alike_speaks_for_its_family(
    file: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert evaluate(file, "--alike", "1") == 0
    assert sorted(Drives.asked) == DRAWN
    told = capsys.readouterr().err
    text = (file.parent / "out" / "report.html").read_text(encoding="utf-8").replace("&#x27;", "'")
    for family in FAMILIES:
        said = (
            f"3 runs of other code ({OTHER}) in {family} count as today's: 1 of them, drawn by their keys and driven by "
            "today's code as well, came out alike"
        )
        assert said in told
    of_each = ", ".join(f"3 in {family} ({OTHER})" for family in FAMILIES)
    assert (
        f"Runs of other code count as today's: {of_each}. Of each group 1 of them, drawn by their keys and driven by today's code "
        "as well, came out alike, to the bit; fewer than 95 % of the others would not, with a confidence of 95 %."
    ) in text
    assert "6 runs are taken from" in text
    assert "0 of its 9 runs fit this code and its models; the other 9 are of other code" in text
    assert "--alike 1" in text, "the command that makes these tables"
    assert all(f"--again {key}" in text for key in set(SPECS) - set(DRAWN)), "what drives it here"


def test_one_that_came_out_otherwise_speaks_against_its_family_alone(
    file: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    wet = FAMILIES["urb-rain"]
    otherwise(wet[0])
    assert evaluate(file, "--alike", "1") == 0
    assert sorted(Drives.asked) == sorted({*DRAWN, *wet}), "all of it are driven by today's code"
    told = capsys.readouterr().err
    assert f"in urb-rain do not count: {wet[0]} came out otherwise by today's" in told
    assert told.count("count as today's") == 2


def test_what_one_other_code_has_counted_is_driven_for_another(file: Path, capsys: pytest.CaptureFixture[str]) -> None:
    lasts = [keys[-1] for keys in FAMILIES.values()]
    of_both = [of_other_code(line_of(key, SPECS[key], COMES_TO[key])) for key in lasts]
    publish(
        file, [msgspec.structs.replace(each, driven_by=LATER, key=key_of(bytes(each.spec), LATER)) for each in of_both]
    )
    assert evaluate(file, "--alike", "1") == 0
    assert sorted(Drives.asked) == sorted([*DRAWN, *lasts])
    told = capsys.readouterr().err
    assert told.count("count as today's") == 6
    assert "do not count" not in told


def test_so_does_one_that_was_not_drawn(file: Path, capsys: pytest.CaptureFixture[str]) -> None:
    last = FAMILIES["dynamic-vsl"][-1]
    leave(file.parent / "out", SPECS[last], finished(nags=99))
    assert evaluate(file, "--alike", "1") == 0
    assert f"in dynamic-vsl do not count: {last} came out otherwise by today's" in capsys.readouterr().err


def test_what_was_drawn_and_could_not_be_driven_lets_none_count(
    file: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(Drives, "done", lambda self, jobs: iter(()))
    assert evaluate(file, "--alike", "2") == 1
    assert capsys.readouterr().err.count("do not count: 2 of those that were drawn are not driven by today's") == 3


def test_the_next_sitting_finds_in_the_file_what_today_drove(file: Path) -> None:
    assert evaluate(file, "--alike", "1", "--publish", str(file)) == 0
    there = read(file)
    assert sum(line.of_today for line in there.values()) == 3
    assert len(there) == 12, "those of other code stay what they are"
    other = file.with_name("other.jsonl")
    assert evaluate(file, "--alike", "1", "--publish", str(other), out="b") == 0
    assert sorted(Drives.asked) == DRAWN, "nothing was driven"
    assert sum(line.driven_by == OTHER for line in read(other).values()) == 6
    assert len(read(other)) == 9


def test_without_the_word_other_code_is_ignored(file: Path) -> None:
    assert evaluate(file) == 0
    assert sorted(Drives.asked) == sorted(SPECS)


def test_what_is_asked_for_again_is_driven(file: Path) -> None:
    last = FAMILIES["urb-rain"][-1]
    assert evaluate(file, "--alike", "1", "--again", last) == 0
    assert sorted(Drives.asked) == sorted({*DRAWN, last})
    Drives.asked.clear()
    assert evaluate(file, "--alike", "1", "--again", ALL, out="b") == 0
    assert sorted(Drives.asked) == sorted(SPECS)


def test_runs_of_other_code_need_a_file(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run([*ASKED, "--out", str(tmp_path / "out"), "--alike", "1"]) == 2
    assert "--alike is about runs of --published; name the file" in capsys.readouterr().err


def test_runs_that_others_measured_are_in_no_group() -> None:
    foreign = [msgspec.structs.replace(line, measured_by="before") for line in lines()]
    assert groups({line.key: line for line in foreign}) == ()


def test_a_run_of_todays_code_that_others_measured_speaks_against_nobody(tmp_path: Path) -> None:
    (first, *_) = groups({line.key: line for line in lines()})
    key = FAMILIES[first.family][0]
    foreign = msgspec.structs.replace(line_of(key, SPECS[key], COMES_TO[key]), measured_by="before")
    assert judged(first, (), Store(tmp_path), {key: foreign}).otherwise == ()


def test_a_draw_is_of_what_is_wanted_and_each_code_draws_by_its_own_keys(tmp_path: Path) -> None:
    found = groups({line.key: line for line in lines()})
    assert {group.driver for group in found} == {OTHER}
    assert {group.family: sorted(group.lines) for group in found} == FAMILIES
    first, keys = found[0], FAMILIES[found[0].family]
    assert drawn(first, SPECS, 2) == tuple(keys[:2])
    assert drawn(first, [keys[-1], "of-another-table"], 2) == (keys[-1],)
    verdict = judged(first, drawn(first, SPECS, 2), Store(tmp_path), {})
    assert (verdict.alike, verdict.lacking, verdict.counts) == ((), 2, False)


def test_only_what_was_drawn_is_told_as_drawn(file: Path, capsys: pytest.CaptureFixture[str]) -> None:
    first, second, _ = FAMILIES["urb-rain"]
    leave(file.parent / "out", SPECS[second], COMES_TO[second])
    assert evaluate(file, "--alike", "1") == 0
    told = capsys.readouterr().err
    assert "in urb-rain count as today's: 1 of them, drawn" in told, "the other speaks against it, or not at all"
    assert first in Drives.asked


def test_how_much_a_draw_leaves_open() -> None:
    # with 14 alike of 14, a share of 19.3 % of odd runs would have had a chance of 5 %
    assert may_differ(14) == pytest.approx(0.193, abs=0.001)
    assert may_differ(1) == pytest.approx(0.95)


def test_where_two_other_codes_say_different_things_neither_counts(file: Path) -> None:
    """Unless today's code has driven that very run, which then speaks against one of them."""
    family = FAMILIES["urb-rain"]
    later = [
        of_other_code(line_of(key, SPECS[key], COMES_TO[key] if key == family[0] else finished(nags=77)))
        for key in family[:2]
    ]
    publish(
        file, [msgspec.structs.replace(each, driven_by=LATER, key=key_of(bytes(each.spec), LATER)) for each in later]
    )
    assert evaluate(file, "--alike", "1") == 0
    assert sorted(Drives.asked) == sorted([*DRAWN, family[1]])


def test_a_run_that_these_tables_have_not_is_not_asked_for_again(
    file: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    before = next(key for key in read(file))
    assert evaluate(file, "--alike", "1", "--again", before) == 2
    assert f"--again {before}: none of these tables' runs; it is of other code, and has another key today" in (
        capsys.readouterr().err
    )
    assert not Drives.asked


@pytest.mark.parametrize("count", [NAMED, NAMED + 1])
def test_few_runs_that_todays_code_decides_otherwise_are_named_and_many_counted(count: int) -> None:
    refuted = {line.key: line.marked("otherwise") for line in lines()[:count]}
    (told,) = sentences(refuted, ())
    assert told.startswith(f"{count} others do not count, as today's decides otherwise in their logs")
    assert [key in told for key in refuted] == [count == NAMED] * count
