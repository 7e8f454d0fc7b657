"""What a release's tables cost and tell: yardsticks first, rounds until the hours are over, sittings that go on, thirty lines."""

import argparse
import time
from pathlib import Path
from typing import Any

import pytest

from drivemcp.cli import run
from evaluation.campaign.kept_outcomes import kept as kept_outcome
from evaluation.evaluate import held, whole
from evaluation.evaluate.held import Goal
from evaluation.evaluate.release import Spent
from evaluation.guard import guard
from evaluation.isa import isa
from evaluation.isa.table import Row, judged
from evaluation.report import page, report
from tests.unit.evaluation.evaluate.made import kept, table

ROUND_S = 1800.0


@pytest.fixture
def driven(monkeypatch: pytest.MonkeyPatch) -> list[tuple[str, int | None, str]]:
    """Table, runs and page of each call; a new round of all tables takes half an hour, all else no time."""
    calls: list[tuple[str, int | None, str]] = []
    clock, rounds = [0.0], {0}

    def tables(flags: argparse.Namespace, beside: Any = ()) -> int:
        calls.append((flags.table, flags.runs, flags.docs))
        clock[0] += 0.0 if flags.runs in rounds else ROUND_S
        rounds.add(flags.runs)
        return 0

    def yardstick(found: Any) -> Any:
        def drive(flags: argparse.Namespace) -> Any:
            calls.append((flags.table, flags.runs, flags.docs))
            return found

        return drive

    monkeypatch.setattr(whole, "evaluate", tables)
    monkeypatch.setattr(isa, "driven", yardstick((0, [])))
    monkeypatch.setattr(guard, "driven", yardstick([]))
    monkeypatch.setattr(time, "monotonic", lambda: clock[0])
    return calls


def rounds(calls: list[tuple[str, int | None, str]]) -> list[int | None]:
    return [runs for name, runs, docs in calls if name == "all" and not docs]


def test_the_yardsticks_come_first_and_rounds_follow_while_the_hours_last(
    driven: list[tuple[str, int | None, str]], tmp_path: Path
) -> None:
    assert run(["evaluate", "release", "--hours", "2", "--out", str(tmp_path)]) == 0
    assert [name for name, _, _ in driven][:3] == ["isa", "guard", "all"]
    assert rounds(driven) == [1, 2, 3, 4]
    assert driven[-1] == ("all", 4, str(tmp_path / "results.md"))


def test_another_sitting_goes_on_where_the_last_one_ended(
    driven: list[tuple[str, int | None, str]], tmp_path: Path
) -> None:
    for hours in ("1", "1", "2"):
        driven.clear()
        assert run(["evaluate", "release", "--hours", hours, "--out", str(tmp_path)]) == 0
    assert rounds(driven) == [3, 4]


def test_an_interrupted_round_is_driven_again_and_its_time_counts(
    driven: list[tuple[str, int | None, str]], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    evaluate = whole.evaluate

    def interrupted(flags: argparse.Namespace, beside: Any = ()) -> int:
        evaluate(flags)
        raise KeyboardInterrupt

    monkeypatch.setattr(whole, "evaluate", interrupted)
    assert run(["evaluate", "release", "--out", str(tmp_path)]) == 130
    assert kept_outcome(tmp_path, "spent", Spent) == Spent(tables_s=ROUND_S)
    monkeypatch.setattr(whole, "evaluate", evaluate)
    driven.clear()
    assert run(["evaluate", "release", "--hours", "0.1", "--out", str(tmp_path)]) == 0
    assert rounds(driven) == [1]


@pytest.mark.parametrize("asked", [("release", "--runs", "3"), ("release", "--km", "3"), ("all", "--hours", "3")])
def test_amounts_beside_the_hours_are_refused(
    asked: tuple[str, ...], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run(["evaluate", *asked, "--out", str(tmp_path)]) == 2
    assert "hours" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("row", "verdict"),
    [
        (("right limit shown, by distance, all, 9.6 km", "99.2 %", "99 (rule: 90)"), "holds"),
        (("right limit shown, by distance, dark, 4.5 km", "79.9 %", "rule: 80"), "missed"),
        (("right limit shown, by distance, dark, 4.5 km", "79.9 %", ""), ""),
        (("delay after a change, median, s", "0.2", "2.0"), "holds"),
        (("delay after a change, median, s", "2.1", "2.0"), "missed"),
        (("delay after a change, median, s", "-", "2.0"), ""),
        (("warning tests passed", "5 of 5", "all"), "holds"),
        (("warning tests passed", "4 of 5", "all"), "missed"),
        (("warning tests passed", "0 of 0", "all"), ""),
        (("messages an hour", "121", "at most 120"), "missed"),
        (("messages on foreign, 1: true, needed", "70.0 %, 0.0 %", "at least 70 true"), "holds"),
        (("messages on foreign, 1: true, needed", "not judged", "at least 70 true"), ""),
        (("understood: rain", "no", "yes"), "missed"),
        (("Euro NCAP, advanced limits, of 3 points", "1.6", "3"), "missed"),
    ],
)
def test_a_row_of_speed_assistance_is_judged_by_its_goal(row: Row, verdict: str) -> None:
    assert judged(row) == verdict


def goals(holds: int, misses: int) -> list[Goal]:
    return [Goal(f"goal {number}", "1", "1", "holds") for number in range(holds)] + [
        Goal(f"goal {number}", "1", "0", "missed") for number in range(misses)
    ]


def test_each_table_has_its_share_of_thirty_lines() -> None:
    told = held.lines([("One", goals(2, 3)), ("Other", goals(0, 60))])
    assert len(told) == 30
    assert told[:2] == ["- **One**: 2 of 5 goals hold; 3 missed.", "- **Other**: 0 of 60 goals hold; 60 missed."]
    assert [line.split(",")[0] for line in told[2:-1]] == ["- One"] * 3 + ["- Other"] * 24
    assert told[-1] == "- and 36 more, below."
    assert [line.split(",")[0] for line in held.lines([("One", goals(0, 20)), ("Other", goals(0, 20))], 8)] == [
        "- **One**: 0 of 20 goals hold; 20 missed.", "- **Other**: 0 of 20 goals hold; 20 missed.", *["- One"] * 3, *["- Other"] * 2,
        "- and 35 more",
    ]  # fmt: skip


def test_a_goal_that_is_not_measured_or_not_proven_is_counted_alone() -> None:
    found = [Goal("a", "1", "-", "not measured"), Goal("b", "1", "1", "holds in the mean, not proven")]
    (line,) = held.lines([("One", found)])
    assert line == "- **One**: 0 of 2 goals hold; 1 not measured; 1 holds in the mean, not proven."


def test_all_that_is_missed_is_named_where_there_is_room() -> None:
    told = held.lines([("One", goals(2, 3))])
    assert told[1:] == [f"- One, missed: goal {number}; wanted 1, found 0." for number in range(3)]


def test_a_cell_that_was_not_driven_is_not_measured() -> None:
    specs = {guard.key_of(spec): spec for spec in guard.specs_of(("standing car", 40, "dry"), 1, "model")}
    (cell,) = guard.cells_of(specs, Path("nowhere"))
    assert [goal.verdict for goal in held.of_guard([cell])] == ["not measured"]


def test_the_page_begins_with_what_holds(tmp_path: Path) -> None:
    tables = [table("delta", lambda row, number: kept())]
    about = report.about(tables, "drivemcp evaluate delta", quick=False, latencies="fixed")
    page.write(tmp_path / "results.md", tables, about, ["- **One**: 1 of 1 goals hold."])
    text = (tmp_path / "results.md").read_text(encoding="utf-8")
    assert text.index("## What holds and what does not\n\n- **One**: 1 of 1 goals hold.\n\n") < text.index(
        "The command below"
    )
    page.write(tmp_path / "other.md", tables, about)
    assert "What holds" not in (tmp_path / "other.md").read_text(encoding="utf-8")


def test_a_table_beside_a_page_of_its_name_has_another_name(
    driven: list[tuple[str, int | None, str]], tmp_path: Path
) -> None:
    """A site makes `isa.html` of `isa.md`."""
    out, docs = tmp_path / "out", tmp_path / "docs"
    (out / "isa").mkdir(parents=True)
    docs.mkdir()
    (docs / "isa.md").write_text("# A page\n")
    for suffix in ("csv", "html"):
        (out / "isa" / f"isa.{suffix}").write_text("a table")
    page = str(docs / "results.md")
    assert run(["evaluate", "release", "--hours", "1", "--out", str(out), "--docs", page]) == 0
    assert {file.name for file in docs.iterdir()} >= {"isa.md", "isa.csv", "isa-table.html"}
    assert not (docs / "isa.html").exists()
