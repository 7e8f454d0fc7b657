"""Sections of a report, one of which fails."""

import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

from benchmarks import __main__ as bench

Sections = dict[str, Callable[[], str]]


@pytest.fixture
def run(monkeypatch: pytest.MonkeyPatch) -> Callable[..., int]:
    """`python -m benchmarks` with sections in place of its own."""

    def with_sections(sections: Sections, *arguments: str, make_peers: Callable[[], object] = lambda: None) -> int:
        monkeypatch.setattr(bench, "SECTIONS", sections)
        monkeypatch.setattr(bench, "make_peers", make_peers)
        monkeypatch.setattr(sys, "argv", ["benchmarks", *arguments])
        return bench.main()

    return with_sections


def raising(error: BaseException) -> Callable[[], str]:
    def section() -> str:
        raise error

    return section


@pytest.mark.parametrize(
    ("error", "why"),
    [
        (subprocess.CalledProcessError(1, ["pip", "install"]), "exit status 1; a package index has to be in reach"),
        (subprocess.TimeoutExpired(["python", "-m", "ours"], 240), "240 seconds; try it on an idle machine"),
        (RuntimeError("ours failed:\n\nTraceback\nOSError: no bus\n"), "ours failed: ... OSError: no bus"),
        (ZeroDivisionError(), "**: ZeroDivisionError; mend that"),
    ],
)
def test_a_section_that_fails_is_told_in_one_line_and_takes_no_other_with_it(
    run: Callable[..., int], tmp_path: Path, capsys: pytest.CaptureFixture[str], error: Exception, why: str
) -> None:
    sections = {"call": lambda: "## Calls", "neighbours": raising(error), "can": lambda: "## Buses"}
    assert run(sections, "--out", str(tmp_path / "new" / "report.md")) == 1
    told = capsys.readouterr().out
    assert (tmp_path / "new" / "report.md").read_text() == told
    (line,) = (line for line in told.splitlines() if "failed" in line)
    assert line.startswith("**neighbours failed**: ")
    assert why in line
    assert line.endswith(", then `python -m benchmarks neighbours`")
    assert told.startswith("# Benchmarks")
    assert told.index("## Calls") < told.index(line) < told.index("## Buses")


def test_what_has_ended_is_printed_and_kept_when_the_rest_is_interrupted(
    run: Callable[..., int], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(KeyboardInterrupt):
        run({"call": lambda: "## Calls", "can": raising(KeyboardInterrupt())}, "--out", str(tmp_path / "report.md"))
    assert "## Calls" in capsys.readouterr().out
    assert "## Calls" in (tmp_path / "report.md").read_text()


def test_peers_that_cannot_be_made_fail_the_sections_that_need_them(
    run: Callable[..., int], capsys: pytest.CaptureFixture[str]
) -> None:
    pip = subprocess.CalledProcessError(1, ["pip"])
    assert run({"call": lambda: "## Calls", "can": lambda: "## Buses"}, make_peers=raising(pip)) == 1
    told = capsys.readouterr().out
    assert "**call failed**" in told
    assert "## Buses" in told


def test_a_file_that_cannot_be_written_is_told_before_anything_runs(
    run: Callable[..., int], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run({"call": raising(AssertionError("it ran"))}, "--out", str(tmp_path)) == 2
    assert f"--out {tmp_path}: " in capsys.readouterr().err


def test_all_went_well(run: Callable[..., int], capsys: pytest.CaptureFixture[str]) -> None:
    assert run({"call": lambda: "## Calls", "can": lambda: "## Buses"}, "can") == 0
    told = capsys.readouterr().out
    assert "## Buses" in told
    assert "## Calls" not in told
