"""`drivemcp evaluate release`: the field's yardsticks whole, then as many runs a row as the hours give, in several sittings."""

import argparse
import time
from collections.abc import Callable
from pathlib import Path

import msgspec

from app.drive.screen import Screen
from evaluation.campaign.kept_outcomes import kept
from evaluation.campaign.names import TABLES
from evaluation.campaign.replacing import write_whole
from evaluation.evaluate import held, whole
from evaluation.guard import guard
from evaluation.isa import isa

HOURS = 12.0


class Spent(msgspec.Struct, kw_only=True):
    """What all sittings together took, s, and how far they came."""

    yardsticks_s: float = 0.0
    tables_s: float = 0.0
    rounds: int = 0
    """Runs that each row of each table has."""

    def lasts(self, hours: float) -> bool:
        """Whether the hours last for one more round, as long as the rounds before; the first is always driven."""
        spent_s = self.yardsticks_s + self.tables_s
        return self.rounds == 0 or spent_s + self.tables_s / self.rounds <= hours * 3600.0


def evaluate_release(flags: argparse.Namespace) -> int:
    """Drive, measure, write; the exit status. What was driven in sittings before is not driven again."""
    folder = Path(flags.out)
    page = Path(flags.docs) if flags.docs else folder / "results.md"
    page.parent.mkdir(parents=True, exist_ok=True)
    hours = HOURS if flags.hours is None else flags.hours
    spent = kept(folder, "spent", Spent) or Spent()

    def measured(name: str, work: Callable[[], int]) -> int:
        began_s, before_s = time.monotonic(), getattr(spent, name)
        try:
            return work()
        finally:
            setattr(spent, name, before_s + time.monotonic() - began_s)
            write_whole(folder / "spent.json", msgspec.json.encode(spent))

    status = measured("yardsticks_s", lambda: _yardsticks(flags, page.parent))
    while spent.lasts(hours):
        status |= measured("tables_s", lambda: whole.evaluate(_of_tables(flags, spent.rounds + 1)))
        spent.rounds += 1
    status |= measured("tables_s", lambda: _write(flags, page, spent.rounds))
    total_h = (spent.yardsticks_s + spent.tables_s) / 3600.0
    Screen().say(f"{spent.rounds} runs a row in {total_h:.1f} of {hours:g} h; {page}")
    return status


def _yardsticks(flags: argparse.Namespace, folder: Path) -> int:
    status, _ = isa.driven(_of(flags, "isa", docs=str(folder / "isa.md")))
    cells = guard.driven(_of(flags, "guard", docs=str(folder / "guard.md")))
    _beside(Path(flags.out), folder, "isa/isa", "guard/guard")
    return status | int(any(cell.missing for cell in cells))


def _write(flags: argparse.Namespace, page: Path, rounds: int) -> int:
    """The page, once all is driven: tables are measured once more, from what is there."""
    _, rows = isa.driven(_of(flags, "isa", docs=""))
    cells = guard.driven(_of(flags, "guard", docs=""))
    beside = (("Speed assistance", [*held.of_isa(rows)]), ("The guard alone", [*held.of_guard(cells)]))
    status = whole.evaluate(_of_tables(flags, rounds, docs=str(page)), beside)
    _beside(Path(flags.out), page.parent, "report", "runs", *TABLES)
    return status


def _of(flags: argparse.Namespace, table: str, **others: object) -> argparse.Namespace:
    return argparse.Namespace(**{**vars(flags), "table": table, **others})


def _of_tables(flags: argparse.Namespace, runs: int, docs: str = "") -> argparse.Namespace:
    return _of(flags, "all", runs=runs, docs=docs)


def _beside(out: Path, folder: Path, *names: str) -> None:
    """Copy CSV and HTML of these tables beside the page; a site makes `isa.html` of `isa.md`, so that of the table has another name."""
    for name in names:
        for file in (out / f"{name}.csv", out / f"{name}.html"):
            if file.exists() and file.parent != folder:
                paged = file.suffix == ".html" and (folder / f"{file.stem}.md").exists()
                write_whole(folder / (f"{file.stem}-table.html" if paged else file.name), file.read_bytes())
