"""The report: one HTML file that needs no network. Each number links to its runs, each run to its log and its replay."""

import base64
import os
import shlex
from collections import Counter
from collections.abc import Mapping, Sequence
from functools import partial
from html import escape
from pathlib import Path
from typing import NamedTuple

import jinja2
import msgspec

from drivemcp.errors import UserError
from evaluation.campaign.machine import commit
from evaluation.campaign.moments import KINDS, Moment, shown
from evaluation.campaign.plan import OURS
from evaluation.campaign.store import LOG, METRICS, Kept
from evaluation.metrics import from_log
from evaluation.metrics.record import DAMAGED
from evaluation.report.above import seen_from_above
from evaluation.report.plots import plots_of
from evaluation.report.reading import contradictions
from evaluation.run.methods import noted
from evaluation.tables.assumed import about_latencies, assumed
from evaluation.tables.columns import COLUMNS
from evaluation.tables.compare import HOW_AGAINST, Difference, comparisons, lines_of, orders, summary, told_of
from evaluation.tables.goals import judged, papers, told
from evaluation.tables.tables import INTERVALS, Ran, Table, TableRow

_STYLE = (Path(__file__).parent / "report.css").read_text(encoding="utf-8")
_TITLES = {
    "results": "Results by family and method",
    "corruption": "Corruption",
    "delta": "The margin Delta",
    "ablation": "Ablations",
    "can-fault": "Faults of the car",
    "proposer": "A language model as proposer",
}


class About(msgspec.Struct, frozen=True, kw_only=True):
    """What the report says of itself."""

    command: str
    commit: str
    """The code that made the tables."""
    machine: str
    """On what the runs were driven, and how many on each."""
    wall_s: float
    """Of all runs together, each on its core."""
    driven_s: float
    km: float
    runs: int
    missing: int
    quick: bool
    backend: str
    sensors: str
    latencies: str
    """Which modelled latencies calls took: fixed ones, or measured where."""
    published: str = ""
    """Which runs were taken from a file of published ones; empty: none was named."""
    cassette: str = ""
    """Name, digest and behaviour of the recorded answers that drove the runs; empty: no cassette. The page then names no machine."""


GONE = "its log is gone; to drive it again delete its folder"
PUBLISHED = "published, its log is not here"


class Behind(NamedTuple):
    """Where a table's runs lie, seen from the report, and what drives a published one again."""

    runs: Path
    base: str
    again: str
    """The command, but for the key."""

    def why_no_log(self, key: str) -> str:
        """Why the run's log cannot be linked to; empty where it can."""
        if (self.runs / key / LOG).exists():
            return ""
        return GONE if (self.runs / key / METRICS).exists() else PUBLISHED

    def to_see(self, run: Ran) -> str:
        """The command that shows a run; of a published one, the command that drives it here; of one without a log, what comes before."""
        why = self.why_no_log(run.key)
        if not why:
            return f"drivemcp replay {self.base}/{run.key}/{LOG}"
        return f"rm -r {self.base}/{run.key}" if why == GONE else f"{self.again} {run.key}"

    def picture(self, run: Ran, moment: Moment) -> str:
        """As HTML: the camera's; without one what truth has, seen from above; nothing of a run that is not here."""
        folder = self.runs / run.key
        # A published moment's picture is a name from outside: only a file of the run itself is shown
        if moment.picture == Path(moment.picture).name and (folder / moment.picture).is_file():
            data = base64.b64encode((folder / moment.picture).read_bytes()).decode("ascii")
            return f"<img alt='{escape(moment.kind)}' src='data:image/jpeg;base64,{data}'>"
        if not (folder / LOG).is_file():
            return ""
        try:
            return seen_from_above(from_log(folder / LOG), moment)
        except (UserError, *DAMAGED) as error:
            return f"<p>No picture: {escape(str(folder / LOG))}: {escape(str(error))}</p>"


def about(
    tables: Sequence[Table], command: str, *, quick: bool, latencies: str, published: str = "", cassette: str = ""
) -> About:
    """Sums over all runs, each counted once."""
    runs = {
        run.key or (table.name, row.row.key, run.number): run  # a row that adapts has no keys yet where it has not come to
        for table in tables for row in table.rows for run in row.runs
    }  # fmt: skip
    kept = [run.kept for run in runs.values() if run.kept is not None]
    return About(
        command=command, commit=commit(), machine=_machines(kept), quick=quick, runs=len(kept), missing=len(runs) - len(kept),
        wall_s=sum(each.wall_s for each in kept), driven_s=sum(each.metrics.get("seconds") or 0.0 for each in kept),
        km=sum(each.metrics.get("distance_m") or 0.0 for each in kept) / 1000,
        backend=", ".join(dict.fromkeys(row.backend for table in tables for row in table.rows)),
        sensors=", ".join(dict.fromkeys(table.sensors for table in tables)), latencies=latencies, published=published,
        cassette=cassette,
    )  # fmt: skip


def _machines(kept: Sequence[Kept]) -> str:
    on = Counter(each.machine or "a machine that was not noted" for each in kept)
    if len(on) == 1:
        return next(iter(on))
    told = [f"{count} {'run' if count == 1 else 'runs'} on {machine}" for machine, count in on.most_common()]
    return "; ".join(told) or "nothing was driven"


def html(tables: Sequence[Table], told_of: About, runs: Path, folder: Path) -> str:
    """The whole report, to be written in `folder`; links to `runs` are relative to it."""
    again = f"{told_of.command} {shlex.join(['--out', str(folder)])} --again"
    return TEMPLATES.get_template("report.html.jinja").render(
        tables=tables, about=told_of, behind=Behind(runs, os.path.relpath(runs, folder), again), facts=_facts(told_of),
        goals=judged(tables), worst=worst(tables), missing=_missing(tables), contradictions=contradictions(),
        about_latencies=about_latencies(tables, "<i>assumed</i>"),
    )  # fmt: skip


def _facts(about: About) -> tuple[tuple[str, str], ...]:
    speed = f"{about.driven_s / about.wall_s:.2f} times real time a slot" if about.wall_s else "nothing driven"
    driven = f"{about.runs} runs, {about.km:.2f} km, {about.driven_s / 60:.1f} min; {about.wall_s / 60:.1f} min of wall time in all slots"
    return (
        ("commit", about.commit), ("driven on", about.machine), ("sensors", about.sensors), ("DriveLM backend", about.backend),
        ("latencies", about.latencies), ("driven", f"{driven}, {speed}"),
        *((("published", about.published),) if about.published else ()),
        ("missing", f"{about.missing} runs" if about.missing else "none"),
    )  # fmt: skip


def worst(tables: Sequence[Table]) -> list[tuple[TableRow, Ran, Moment]]:
    """The worst, kind by kind, each run once of a kind; DriveMCP's own, and in place of those that it has not, others'."""
    found: Mapping[tuple[str, str], tuple[TableRow, Ran, Moment]] = {
        (run.key, moment.kind): (row, run, moment)
        for table in tables for row in table.rows for run in row.runs if run.kept is not None for moment in run.kept.moments
    }  # fmt: skip
    ranked = sorted(found.values(), key=lambda each: (each[0].row.spec.method != OURS, -each[2].badness))
    by_kind = ([each for each in ranked if each[2].kind == kind] for kind in KINDS)
    return [each for of_kind in shown(by_kind) for each in of_kind]


def _missing(tables: Sequence[Table]) -> list[tuple[Table, TableRow, Ran]]:
    """Runs that failed, each once."""
    found = {
        run.key: (table, row, run)
        for table in tables for row in table.rows for run in row.runs if run.problem and run.kept is None
    }  # fmt: skip
    return list(found.values())


def _columns(table: Table, *, papers: bool) -> list[int]:
    """The places of the paper's columns, or of ours beside them."""
    return [at for at, column in enumerate(table.columns) if (column in COLUMNS[table.name]) == papers]


def _notes(table: Table) -> list[tuple[str, str]]:
    """Label and meaning of each row that has a note, once."""
    pairs = ((table.label(row), noted(row.row.note, row.row.spec)) for row in table.rows if row.row.note)
    return list(dict.fromkeys(pairs))


def _heads(found: Sequence[Difference]) -> list[tuple[str, str]]:
    """Title and unit of each compared column, once."""
    return list(dict.fromkeys((one.column.title, one.column.unit) for one in found))


def _templates() -> jinja2.Environment:
    made = jinja2.Environment(
        loader=jinja2.FileSystemLoader(Path(__file__).parent), undefined=jinja2.StrictUndefined, trim_blocks=True,
        lstrip_blocks=True, keep_trailing_newline=True, autoescape=lambda name: name != "page.md.jinja",
    )  # fmt: skip
    made.filters.update(
        anchor=lambda text: "".join(letter if letter.isalnum() else "-" for letter in text),
        places=lambda number, places: f"{number:.{places}f}", papers_columns=partial(_columns, papers=True),
        our_columns=partial(_columns, papers=False), notes=_notes, heads=_heads,
    )  # fmt: skip
    made.globals.update(
        told=told, papers=papers, assumed=assumed, lines_of=lines_of, told_of=told_of, plots_of=lambda table: plots_of(table),
        comparisons=comparisons, orders=orders, summary=summary, how_against=HOW_AGAINST, intervals=INTERVALS, ours=OURS,
        log=LOG, titles=_TITLES, style=_STYLE, arrows={"less": " \N{DOWNWARDS ARROW}", "more": " \N{UPWARDS ARROW}", "": ""},
    )  # fmt: skip
    return made


TEMPLATES = _templates()
