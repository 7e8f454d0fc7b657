"""What calls take, measured on this machine, and runs that take it."""

from collections.abc import Iterator
from pathlib import Path

import msgspec
import pytest

from drivemcp import cli
from drivemcp.errors import UserError
from drivemcp.node import Node
from evaluation.run.host import drive
from evaluation.run.latencies import FEWEST, Latencies, Took, read, took
from evaluation.run.ready import RunError
from evaluation.run.spec import RunSpec, run_key
from proto import topics
from proto.decision import Advisory
from studies.latencies import __main__ as latencies
from studies.latencies.__main__ import main
from studies.latencies.measure import STAGES, measure

SPEC = RunSpec(scenario="urb-rain/development/11", seed=1, seconds=1.5, sensors="model")
SPOKEN = RunSpec(scenario="urb-rain", seed=7, seconds=5.5, sensors="model")
"""A drive that says something in its sixth second."""


def table(**tools: Took) -> Latencies:
    return Latencies(machine="a machine", load=0.1, runs=("one",), tools=tools, stages={})


def test_the_spread_is_by_nearest_rank() -> None:
    assert took([float(each) for each in range(100, 0, -1)]) == Took(p50_ms=50.0, p99_ms=99.0, count=100)


def test_runs_take_the_medians_of_tools_that_were_asked_often_enough() -> None:
    found = table(
        retrieve=Took(p50_ms=12.34, p99_ms=30.0, count=FEWEST),
        interpret_sign=Took(p50_ms=1.0, p99_ms=2.0, count=FEWEST - 1),
    )
    assert found.modelled_ms() == {"retrieve": 12.3}
    assert "a machine" in found.told()


def test_a_table_can_be_kept_and_shown(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = tmp_path / "table.json"
    found = table(arbitrate=Took(p50_ms=1.04, p99_ms=6.5, count=300))
    file.write_bytes(msgspec.json.encode(found))
    assert read(file) == found
    assert main(["show", str(file)]) == 0
    assert "| arbitrate | 1.04 | 6.50 | 300 | 1.0 |" in capsys.readouterr().out


@pytest.mark.parametrize("text", [None, "{}", '{"machine": 3}'])
def test_a_file_that_is_no_table_is_named(tmp_path: Path, text: str | None) -> None:
    file = tmp_path / "table.json"
    if text is not None:
        file.write_text(text)
    with pytest.raises(UserError, match=r"table\.json"):
        read(file)
    assert main(["show", str(file)]) == 2


def test_a_table_is_printed_and_written_whole(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    found = table(arbitrate=Took(p50_ms=1.04, p99_ms=6.5, count=300))
    monkeypatch.setattr(latencies, "measure", lambda _: iter(["one", found]))
    assert main(["measure", "--out", str(tmp_path / "new" / "table.json")]) == 0
    assert "| arbitrate | 1.04 |" in capsys.readouterr().out
    assert read(tmp_path / "new" / "table.json") == found
    assert [each.name for each in (tmp_path / "new").iterdir()] == ["table.json"]


def test_where_nothing_can_be_written_nothing_is_driven(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    driven = list[float]()
    monkeypatch.setattr(latencies, "measure", driven.append)
    (tmp_path / "file").touch()
    for out in (tmp_path, tmp_path / "file" / "table.json"):
        assert main(["measure", "--out", str(out)]) == 2
        assert f"--out {out}: " in capsys.readouterr().err
    assert not driven


def test_a_measured_table_is_printed_even_if_it_cannot_be_written(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    found, out = table(arbitrate=Took(p50_ms=1.04, p99_ms=6.5, count=300)), tmp_path / "new" / "table.json"

    def measured(_: float) -> Iterator[Latencies]:
        out.parent.rmdir()
        out.parent.touch()
        yield found

    monkeypatch.setattr(latencies, "measure", measured)
    assert main(["measure", "--out", str(out)]) == 2
    told = capsys.readouterr()
    assert "| arbitrate | 1.04 |" in told.out
    assert f"--out {out}: File exists" in told.err


def test_a_run_that_fails_is_told_in_one_line(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def fails(_: float) -> Iterator[str]:
        yield "one"
        raise RunError("no step within 120 s")

    monkeypatch.setattr(latencies, "measure", fails)
    assert main(["measure", "--out", str(tmp_path / "table.json")]) == 1
    assert capsys.readouterr().err.splitlines() == ["driving one", "no step within 120 s"]
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("seconds", ["-1", "nan", "inf"])
def test_a_time_that_is_none_is_refused(seconds: str, capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as ended:
        main(["measure", "--seconds", seconds])
    assert ended.value.code == 2
    assert f"--seconds: {seconds!r} is no number from 1" in capsys.readouterr().err


def test_evaluate_refuses_a_table_that_is_not_there_before_it_drives(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "out"
    asked = ["evaluate", "results", "--quick", "--out", str(out), "--latencies", str(tmp_path / "none.json")]
    assert cli.run(asked) == 2
    assert "studies latencies measure" in capsys.readouterr().err
    assert not list(out.glob("runs/*"))


def test_calls_pictures_and_ticks_of_real_runs_are_measured() -> None:
    *told, found = measure(SPEC.seconds, (("DriveMCP", "model", SPEC),))
    assert told == ["DriveMCP, urb-rain/development/11, seed 1, 1.5 s, model sensors"]
    assert isinstance(found, Latencies)
    ticks = found.stages[STAGES["orchestrator"].name]
    arbitrate = found.tools["arbitrate"]
    assert ticks.count == arbitrate.count >= 14, "a tick a picture, and the arbiter asked in each"
    assert 0.0 < arbitrate.p50_ms < ticks.p50_ms, "the tick waits for it"
    assert arbitrate.p50_ms <= arbitrate.p99_ms
    assert "applicable_limit" in found.tools
    assert STAGES["perception"].name not in found.stages, "no pictures were drawn"


def test_a_run_takes_the_table_and_its_key_says_so(tmp_path: Path) -> None:
    first = []
    for number, modelled_ms in enumerate(
        ({}, dict.fromkeys(("applicable_limit", "assess_weather", "interpret_sign"), 17.5))
    ):
        spec, seen = msgspec.structs.replace(SPOKEN, modelled_ms=modelled_ms), list[Advisory]()
        drive(spec, tmp_path / str(number), lambda node, seen=seen: hears(node, seen))  # type: ignore[misc]
        first.append(next(each.event_to_advice_ms for each in seen if each.event_to_advice_ms))
    assert first == [4.0, 17.5]
    assert run_key(SPEC) != run_key(msgspec.structs.replace(SPEC, modelled_ms={"retrieve": 12.0}))


def hears(node: Node, into: list[Advisory]) -> None:
    node.subscribe(topics.ADVISORY, lambda message, _: into.append(message))
