"""`python -m studies soak`: memory of each process of a stack by time, over a long drive; 1 where one grows by more than the goal."""

import argparse
import shutil
import statistics
import sys
import threading
import time
from collections import defaultdict
from collections.abc import Sequence
from pathlib import Path

import msgspec
import psutil

from app.drive.stack import Stack, StackPlan, folder_for
from drivemcp.errors import DriveMcpError
from drivemcp.numbers import number
from evaluation.tables.columns import Column
from proto import topics
from studies.output import Sheet, add_json, show

GOAL_MB_PER_HOUR = 5.0
SETTLES_MIN = 10.0
"""Caches and pools fill until then; of a shorter drive a third counts as this."""


PARTS = 6
LAP_S = 240.0
"""After so long the scenario begins again: its road ends."""


class Sample(msgspec.Struct, frozen=True, kw_only=True):
    """Memory of one process, with those that it started."""

    at_s: float
    own_mb: float
    """What would be free if it ended (USS)."""
    resident_mb: float


class Growth(msgspec.Struct, frozen=True, kw_only=True):
    """How the memory of one process went."""

    process: str
    settled_mb: float
    end_mb: float
    most_mb: float
    mb_per_hour: float
    """Of the straight line through the least that it owned in each sixth of the time, once it had settled."""
    resident_mb: float
    samples: tuple[Sample, ...]


def settles_s(seconds: float) -> float:
    """When growth begins to count."""
    return min(SETTLES_MIN * 60.0, seconds / 3.0)


def growth(process: str, samples: Sequence[Sample], from_s: float) -> Growth | None:
    """What came of one process; None where it was not seen often enough."""
    counted = [each for each in samples if each.at_s >= from_s]
    if len(counted) < 3:
        return None
    least = _least(counted)
    slope, _ = statistics.linear_regression([each.at_s for each in least], [each.own_mb for each in least])
    return Growth(
        process=process, settled_mb=counted[0].own_mb, end_mb=counted[-1].own_mb,
        most_mb=max(each.own_mb for each in samples), mb_per_hour=slope * 3600.0,
        resident_mb=counted[-1].resident_mb, samples=tuple(samples),
    )  # fmt: skip


def _least(samples: Sequence[Sample]) -> list[Sample]:
    """The least of each part of the time: what is taken for a while and given back is no growth."""
    size = -(-len(samples) // PARTS)
    return [min(samples[at : at + size], key=lambda each: each.own_mb) for at in range(0, len(samples), size)]


def sampled(pid: int, at_s: float) -> Sample:
    """The process and its children now. Raises psutil.Error where it has ended."""
    first = psutil.Process(pid)
    found = [each.memory_full_info() for each in (first, *first.children(recursive=True))]
    return Sample(
        at_s=at_s, own_mb=sum(each.uss for each in found) / 1e6, resident_mb=sum(each.rss for each in found) / 1e6
    )  # fmt: skip


def soak(folder: Path, seconds: float, every_s: float) -> dict[str, list[Sample]]:
    """Drive for so long; samples by process. Raises DriveMcpError where the stack does not start or a process was restarted."""
    drive = {"scenario": "urb-rain", "seed": 1, "seconds": LAP_S, "autostart": True}
    plan = StackPlan(folder=str(folder), settings={"simulator": drive})
    found: dict[str, list[Sample]] = defaultdict(list)
    pause = threading.Event()
    with Stack(plan, lambda text: None) as stack:
        node = stack.start()
        node.subscribe(topics.SCENARIO)
        stack.wait_for_source()
        begun_s = time.monotonic()
        while (at_s := time.monotonic() - begun_s) < seconds:
            if (state := node.latest(topics.SCENARIO)) is not None and state.message.finished:
                node.call("start_scenario", {}, deadline_ms=5000.0)
            for child in stack.supervisor.children:
                if (pid := child.pid) is not None:
                    try:
                        found[child.name].append(sampled(pid, at_s))
                    except psutil.Error:
                        continue
            pause.wait(every_s)
        if restarts := stack.restarts():
            raise DriveMcpError(f"restarted meanwhile, so that their memory says nothing: {restarts}")
    return found


def main(arguments: list[str] | None = None) -> int:
    """Drive and show; 1 where the goal is missed or the drive broke."""
    parser = argparse.ArgumentParser(prog="python -m studies soak", description=__doc__)
    parser.add_argument("--minutes", type=number(0.5, 1440.0), default=30.0, help="of the drive (30)")
    parser.add_argument("--every", type=number(1.0, 600.0), default=10.0, metavar="S", help="between samples (10)")
    parser.add_argument(
        "--out", default="out", metavar="FOLDER", help="where the drive goes; its log is deleted at the end"
    )
    add_json(parser)
    flags = parser.parse_args(arguments)
    folder, seconds = Path(folder_for("soak", flags.out)), flags.minutes * 60.0
    try:
        found = soak(folder, seconds, flags.every)
    except DriveMcpError as error:
        sys.stderr.write(f"{error}\n")
        return 1
    finally:
        shutil.rmtree(folder / "logs", ignore_errors=True)
    grown = [each for name, samples in found.items() if (each := growth(name, samples, settles_s(seconds))) is not None]
    show([sheet(grown, settles_s(seconds))], as_json=flags.json, figures=grown)
    return int(any(each.mb_per_hour > GOAL_MB_PER_HOUR for each in grown))


def sheet(grown: Sequence[Growth], from_s: float) -> Sheet:
    """The table, the fastest growth first."""
    ordered = sorted(grown, key=lambda each: -each.mb_per_hour)
    head = f"after {from_s / 60.0:.0f} min"
    titles = (head, "at the end", "most", "resident")
    columns: list[str | Column] = ["process", *(Column(title=title, unit="MB", places=1) for title in titles)]
    columns.append(Column(title="growth", unit="MB/h", places=1))
    rows = [(g.process, g.settled_mb, g.end_mb, g.most_mb, g.resident_mb, g.mb_per_hour) for g in ordered]
    note = f"Goal: at most {GOAL_MB_PER_HOUR:.0f} MB/h {head}, of the memory that a process and its children own."
    return Sheet(columns, rows, [note])


if __name__ == "__main__":
    sys.exit(main())
