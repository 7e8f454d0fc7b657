"""Published runs: not driven again, told of as what they are, and refused where a line is wrong."""

import re
import threading
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import msgspec
import pytest

from drivemcp.cli import run
from drivemcp.errors import UserError
from evaluation.campaign import published
from evaluation.campaign.moments import Moment
from evaluation.campaign.plan import Amount, rows_of, runs_of
from evaluation.campaign.pool import Done, Job
from evaluation.campaign.published import Line, line_of, otherwise, publish, read, taken
from evaluation.campaign.replacing import write_whole
from evaluation.campaign.store import LOG, MEASURES, METRICS, Kept, Store
from evaluation.evaluate import whole
from evaluation.metrics import Metrics
from evaluation.metrics.labels import Drive, Label
from evaluation.report import report
from evaluation.run.spec import RunSpec, key_of
from tests.unit.evaluation.evaluate.made import NUMBERS, moment

ASKED = ("evaluate", "results", "--quick", "--sensors", "model", "--method", "DriveMCP", "--jobs", "1")
SPECS = [
    run.spec
    for run in runs_of(rows_of("results", "model"), Amount(runs=1, seconds=5.0))
    if run.row.spec.method == "DriveMCP"
]


def finished(**numbers: Any) -> Kept:
    """What a run came to, as it is read from its folder."""
    metrics = msgspec.json.decode(msgspec.json.encode(Metrics(**{**NUMBERS, **numbers})))
    return Kept(
        metrics=metrics,
        moments=(moment(),),
        wall_s=60.12,
        machine="a test's machine",
        cpu_s=50.0,
        measured_by=MEASURES,
        outcome="as it was",
        labelled=Drive((Label(12.5, "annoying"),), 120.0),
    )


def leave(folder: Path, spec: RunSpec, kept: Kept) -> None:
    """A run as if it had been driven into the folder."""
    place = Store(folder / "runs").path(Store(folder / "runs").key(spec))
    place.mkdir(parents=True, exist_ok=True)
    (place / METRICS).write_bytes(msgspec.json.encode(kept))
    for name in (LOG, "spec.json"):
        (place / name).touch()


def lines(count: int = 3) -> list[Line]:
    store = Store(Path("nowhere"))
    return [line_of(store.key(spec), spec, finished(nags=at)) for at, spec in enumerate(SPECS[:count])]


def of_other_code(line: Line) -> Line:
    driver = "000000000000-000000000000"
    return msgspec.structs.replace(line, driven_by=driver, key=key_of(bytes(line.spec), driver))


class NobodyDrives:
    """In place of the pool: what is not there stays missing."""

    def __init__(self, *_: object) -> None: ...

    def done(self, jobs: list[Job]) -> Iterator[Done]:
        return iter(())


@pytest.fixture
def driven(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder with three finished runs; nobody can drive any, and nobody draws plots."""
    monkeypatch.setattr(report, "plots_of", lambda _: ())
    monkeypatch.setattr(whole, "Pool", NobodyDrives)
    for at, spec in enumerate(SPECS):
        leave(tmp_path / "a", spec, finished(nags=at))
    return tmp_path


def test_published_runs_are_not_driven_again_and_make_the_same_tables(
    driven: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file, page = driven / "runs.jsonl.gz", driven / "page.md"
    assert run([*ASKED, "--out", str(driven / "a"), "--publish", str(file)]) == 0
    assert run([*ASKED, "--out", str(driven / "b"), "--published", str(file), "--docs", str(page)]) == 0
    for name in ("results.csv", "results.json", "runs.csv"):
        assert (driven / "a" / name).read_bytes() == (driven / "b" / name).read_bytes()
    assert "3 runs, 0 of them are there, 3 are published" in capsys.readouterr().err

    said = f"3 runs are taken from {file} (3 of its 3 runs have this behaviour and these models)"
    assert said in page.read_text(encoding="utf-8")
    text = (driven / "b" / "report.html").read_text(encoding="utf-8")
    assert said in text
    assert "their logs are not here" in text
    leads = re.findall(r"href=['\"]([^#'\"]+)", text)
    assert all((driven / "b" / lead).exists() for lead in leads), "no link leads nowhere"
    for key in read(file):
        assert f"--published {file} --out {driven / 'b'} --again {key}</code>" in text, "what drives it here"
        assert f"drivemcp replay runs/{key}" not in text


def test_one_command_begins_a_file_and_goes_on_with_it(driven: Path) -> None:
    file = driven / "results" / "runs.jsonl.gz"
    both = ("--published", str(file), "--publish", str(file))
    assert run([*ASKED, "--out", str(driven / "a"), *both]) == 0
    first = file.read_bytes()
    assert run([*ASKED, "--out", str(driven / "b"), *both]) == 0
    assert file.read_bytes() == first


def test_a_run_that_came_out_otherwise_than_published_is_told_and_does_not_replace_it(
    driven: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = driven / "runs.jsonl"
    publish(file, lines())
    before = file.read_bytes()
    leave(driven / "a", SPECS[1], finished(nags=7))
    assert run([*ASKED, "--out", str(driven / "a"), "--publish", str(file)]) == 1
    assert f"{Store(driven).key(SPECS[1])} came out otherwise here" in capsys.readouterr().err
    assert file.read_bytes() == before


def test_a_run_that_another_machine_took_longer_for_came_out_the_same() -> None:
    store, one = Store(Path("nowhere")), finished()
    other = msgspec.structs.replace(one, machine="another", wall_s=600.0, cpu_s=500.0)
    published = {line.key: line for line in lines(1)}
    key, spec = store.key(SPECS[0]), SPECS[0]
    assert (
        otherwise(published, [line_of(key, spec, msgspec.structs.replace(other, metrics=finished(nags=0).metrics))])
        == []
    )
    assert otherwise(published, [line_of(key, spec, finished(nags=7))]) == [key]


def test_what_is_published_into_is_not_taken_from_unless_it_is_asked_for(
    driven: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = driven / "runs.jsonl"
    publish(file, lines())
    assert run([*ASKED, "--out", str(driven / "b"), "--publish", str(file)]) == 1, "nobody drove them"
    assert "3 are missing" in capsys.readouterr().err
    file.write_text("{}", encoding="utf-8")
    assert run([*ASKED, "--out", str(driven / "c"), "--publish", str(file)]) == 2
    assert not (driven / "c").exists(), "it is told before anything is driven"


def test_two_files_become_one(driven: Path) -> None:
    one, other, both = (driven / name for name in ("one.jsonl", "other.jsonl", "both.jsonl"))
    publish(one, lines()[:2])
    publish(other, [lines()[2], of_other_code(lines()[0])])
    asked = (*ASKED, "--out", str(driven / "b"), "--published", str(one))
    assert run([*asked, "--publish", str(other)]) == 1
    assert run([*ASKED, "--out", str(driven / "c"), "--published", str(other), "--publish", str(both)]) == 0
    assert set(read(other)) == {line.key for line in [*lines(), of_other_code(lines()[0])]}
    assert set(read(both)) == {line.key for line in lines()}, "into a new file goes what is of today's code"


def test_runs_of_other_code_are_told_and_ignored(driven: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = driven / "runs.jsonl"
    publish(file, map(of_other_code, lines()))
    assert run([*ASKED, "--out", str(driven / "b"), "--published", str(file)]) == 1, "and nobody drove them"
    assert "0 of its 3 runs have this behaviour and these models; the other 3 are ignored" in capsys.readouterr().err


def test_lines_are_sorted_added_to_and_of_the_same_bytes_for_the_same_runs(tmp_path: Path) -> None:
    one, other = tmp_path / "one.jsonl.gz", tmp_path / "other.jsonl.gz"
    assert publish(one, lines(1)) == 1
    assert publish(one, lines(3)) == 2
    assert publish(one, lines(3)) == 0
    assert publish(other, reversed(lines(3))) == 3
    assert one.read_bytes() == other.read_bytes()
    assert list(read(one)) == sorted(line.key for line in lines())


def test_who_publishes_at_the_same_time_loses_no_run(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The first is held where it has read and not yet written; the second then waits for it."""
    file, (first, second, third) = tmp_path / "runs.jsonl", lines()
    publish(file, [first])
    has_read, may_write = threading.Event(), threading.Event()

    def held(path: Path, data: bytes) -> None:
        has_read.set()
        may_write.wait(5.0)
        write_whole(path, data)

    monkeypatch.setattr(published, "write_whole", held)
    both = [threading.Thread(target=publish, args=(file, [line])) for line in (second, third)]
    both[0].start()
    assert has_read.wait(5.0)
    both[1].start()
    both[1].join(0.3)
    may_write.set()
    for each in both:
        each.join(5.0)
    assert read(file) == {line.key: line for line in (first, second, third)}


def test_what_is_there_stays_unless_today_measures_otherwise(tmp_path: Path) -> None:
    file, (first, second, third) = tmp_path / "runs.jsonl", lines()
    slower = msgspec.structs.replace(first, wall_s=99.0)
    older = msgspec.structs.replace(second, measured_by="before", metrics=msgspec.Raw(b'{"gone":1}'))
    publish(file, [first, older, of_other_code(third)])
    assert publish(file, [slower, second]) == 1
    assert read(file) == {line.key: line for line in (first, second, of_other_code(third))}


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"key": "0123456789abcdef"}, r"`\$\.key`: 0123456789abcdef does not fit `\$\.spec` and `\$\.driven_by`"),
        ({"wall_s": "long"}, r"Expected `float`, got `str` - at `\$\.wall_s`"),
        ({"outcome": None}, r"Expected `str`, got `null` - at `\$\.outcome`"),
        ({"metrics": {"nags": "few"}}, r"`\$\.metrics`: Expected `int`, got `str` - at `\$\.nags`"),
        ({"metrics": {}}, r"`\$\.metrics\.advisory_latency_s`: missing"),
        ({"moments": [{}]}, r"`\$\.moments`: Object missing required field `kind` - at `\$\[0\]`"),
    ],
)
def test_a_wrong_line_is_named_by_file_line_and_field(tmp_path: Path, change: dict[str, Any], said: str) -> None:
    file, (first, second) = tmp_path / "runs.jsonl", lines(2)
    wrong = msgspec.json.encode({**msgspec.json.decode(msgspec.json.encode(second)), **change})
    file.write_bytes(msgspec.json.encode(first) + b"\n" + wrong + b"\n")
    with pytest.raises(UserError, match=rf"runs\.jsonl, line 2: .*{said}"):
        read(file)


def test_a_file_that_is_no_such_file_is_named(tmp_path: Path) -> None:
    (file := tmp_path / "runs.jsonl.gz").write_bytes(b"no gzip")
    for path in (file, tmp_path / "nowhere.jsonl"):
        with pytest.raises(UserError, match=path.name):
            read(path)
    file.write_bytes(b"")
    with pytest.raises(UserError, match=r"runs\.jsonl\.gz: no published runs: the file is empty"):
        read(file)
    twice = tmp_path / "twice.jsonl"
    twice.write_bytes(2 * (msgspec.json.encode(lines(1)[0]) + b"\n"))
    with pytest.raises(UserError, match=r"line 2: `\$\.key`: it is there twice"):
        read(twice)


def test_what_is_asked_for_again_is_not_taken() -> None:
    there = {line.key: line for line in lines()}
    first, *others = there
    assert list(taken(there, ())) == [first, *others]
    assert taken(there, ())[first] == finished(nags=0)
    assert list(taken(there, [first])) == others
    assert taken(there, [published.ALL]) == {}
    for lines_there, key in ((there, "0123456789abcdef"), ({}, published.ALL)):
        with pytest.raises(UserError, match=f"--again {key}: no such run in the file of --published"):
            taken(lines_there, [key])


def test_how_long_it_took_is_no_other_outcome() -> None:
    (line,) = lines(1)
    there = {line.key: line}
    assert otherwise(there, [msgspec.structs.replace(line, wall_s=1.0)]) == []
    assert otherwise(there, [msgspec.structs.replace(line, outcome="another")]) == [line.key]
    assert otherwise({line.key: msgspec.structs.replace(line, measured_by="before")}, [line]) == []
    assert isinstance(line.kept().moments[0], Moment)
