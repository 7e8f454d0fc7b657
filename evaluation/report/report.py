"""The report: one HTML file that needs no network. Each number links to its runs, each run to its log and its replay."""

import base64
import os
import shlex
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from html import escape
from pathlib import Path
from typing import NamedTuple

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
from evaluation.tables.columns import COLUMNS, Column
from evaluation.tables.compare import HOW_AGAINST, Difference, Order, comparisons, lines_of, orders, summary, told_of
from evaluation.tables.goals import judged, papers, told
from evaluation.tables.tables import INTERVALS, Ran, Table, TableRow, Value

_STYLE = (Path(__file__).parent / "report.css").read_text(encoding="utf-8")
_TITLES = {
    "results": "Results by family and method",
    "corruption": "Corruption",
    "delta": "The margin Delta",
    "ablation": "Ablations",
    "can-fault": "Faults of the car",
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


def about(tables: Sequence[Table], command: str, *, quick: bool, latencies: str, published: str = "") -> About:
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
    )  # fmt: skip


def _machines(kept: Sequence[Kept]) -> str:
    on = Counter(each.machine or "a machine that nobody noted" for each in kept)
    if len(on) == 1:
        return next(iter(on))
    told = [f"{count} {'run' if count == 1 else 'runs'} on {machine}" for machine, count in on.most_common()]
    return "; ".join(told) or "nothing was driven"


def html(tables: Sequence[Table], told_of: About, runs: Path, folder: Path) -> str:
    """The whole report, to be written in `folder`; links to `runs` are relative to it."""
    again = f"{told_of.command} {shlex.join(['--out', str(folder)])} --again"
    behind = Behind(runs, os.path.relpath(runs, folder), again)
    parts = (
        _head(tables, told_of), _goals(tables), *(_table(table, behind) for table in tables), _moments(tables, behind),
        _reading(), _missing(tables), "</main></body></html>\n",
    )  # fmt: skip
    return "".join(parts)


def _head(tables: Sequence[Table], about: About) -> str:
    speed = f"{about.driven_s / about.wall_s:.2f} times real time a slot" if about.wall_s else "nothing driven"
    driven = f"{about.runs} runs, {about.km:.2f} km, {about.driven_s / 60:.1f} min; {about.wall_s / 60:.1f} min of wall time in all slots"
    small = (
        "<p class=warn>A quick run: it shows that everything works. Its numbers prove nothing; the intervals say so.</p>"
        if about.quick
        else ""
    )
    facts = (
        ("command", f"<code>{escape(about.command)}</code>"), ("commit", escape(about.commit)), ("driven on", escape(about.machine)),
        ("sensors", escape(about.sensors)), ("DriveLM backend", escape(about.backend)),
        ("latencies", escape(about.latencies)),
        ("driven", f"{driven}, {speed}"),
        *((("published", escape(about.published)),) if about.published else ()),
        ("missing", f"{about.missing} runs" if about.missing else "none"),
    )  # fmt: skip
    rows = "".join(f"<tr><th>{name}</th><td>{value}</td></tr>" for name, value in facts)
    return (
        f'<!doctype html><html lang="en"><head><meta charset="utf-8"><title>DriveMCP: the tables, measured</title><style>{_STYLE}</style>'
        f"</head><body><main><h1>The paper's tables, measured</h1>{small}<table class=facts>{rows}</table>"
        f"<p>Each number: value, 95&nbsp;% interval below it, and the paper's in <b class=paper>orange</b>. {INTERVALS}. The paper drove "
        "in CARLA; orderings and ratios can be compared, absolute numbers only stand side by side. "
        f"{about_latencies(tables, '<i>assumed</i>')} "
        "A number links to its runs; paths and <code>drivemcp replay</code> go from this file's folder, <code>drivemcp evaluate</code> "
        "from where the command above was run.</p>"
    )


def _goals(tables: Sequence[Table]) -> str:
    rows = "".join(
        f"<tr class='{'open' if 'not' in one.verdict else one.verdict}'><td>{escape(one.what)}</td><td>{escape(one.bound)}</td>"
        f"<td>{escape(one.found)}</td><td>{escape(one.verdict)}</td><td class=small>{escape(one.distance)}</td></tr>"
        for one in judged(tables)
    )
    head = "<tr><th>what</th><th>wanted</th><th>found</th><th></th><th>what the distance allows</th></tr>"
    return f"<h2>What we want to read</h2><table>{head}{rows}</table>" if rows else ""


def _table(table: Table, behind: Behind) -> str:
    paper = [at for at, column in enumerate(table.columns) if column in COLUMNS[table.name]]
    ours = [at for at in range(len(table.columns)) if at not in paper]
    plots = "".join(f"<figure>{svg}<figcaption>{escape(name)}</figcaption></figure>" for name, svg in plots_of(table))
    return (
        f"<h2 id='{table.name}'>{_TITLES[table.name]}</h2><p>Made with {escape(table.sensors)} sensors, DriveLM backend "
        f"{escape(table.backend)}.</p>{_cells(table, paper)}{_notes(table)}{plots}"
        f"<details><summary>What we measure beside</summary>{_cells(table, ours)}</details>"
        f"{''.join(_place_by_place(title, found) for title, found in comparisons(table))}"
        f"{_orders(orders(table))}{_runs(table, behind)}"
    )


def _cells(table: Table, columns: Sequence[int]) -> str:
    arrows = {"less": " ↓", "more": " ↑", "": ""}
    head = "".join(
        f"<th>{escape(column.title)}<br>{escape(column.unit)}{arrows[column.better]}</th>"
        for column in (table.columns[at] for at in columns)
    )
    body = "".join(_groups(table, columns))
    return f"<table><tr><th></th><th>runs<br>km</th>{head}</tr>{body}</table>"


def _groups(table: Table, columns: Sequence[int]) -> Iterator[str]:
    group = ""
    for row in table.rows:
        if row.row.group != group:
            group = row.row.group
            yield f"<tr class=group><td colspan={len(columns) + 2}>{escape(group)}</td></tr>"
        cells = "".join(_cell(row.values[at], table.columns[at], row) for at in columns)
        missing = f" <span class=warn>({row.missing} missing)</span>" if row.missing else ""
        yield (
            f"<tr{' class=ours' if row.row.label == OURS else ''}><td>{escape(table.label(row))}</td>"
            f"<td class=small>{len(row.runs) - row.missing}{missing}<br>{row.km:.2f}</td>{cells}</tr>"
        )


def _cell(value: Value, column: Column, row: TableRow) -> str:
    printed = ""
    if value.paper is not None:
        printed = f"<br><b class=paper>{papers(value)}</b>"
    number, _, interval = told(value, column).partition(" ")
    deviation = f", sd {value.sd:.{column.places}f}" if value.sd is not None else ""
    title = escape(f"{value.of}{deviation}")
    mark = " <i>assumed</i>" if assumed(column, row.row.spec) else ""
    return f"<td><a href='#{_anchor(row)}' title='{title}'>{number}</a>{mark}<br><span class=small>{escape(interval)}</span>{printed}</td>"


def _anchor(row: TableRow) -> str:
    return "runs-" + "".join(letter if letter.isalnum() else "-" for letter in f"{row.row.table}-{row.row.key}")


def _notes(table: Table) -> str:
    notes = dict.fromkeys((table.label(row), noted(row.row.note, row.row.spec)) for row in table.rows if row.row.note)
    if not notes:
        return ""
    items = "".join(f"<li><b>{escape(label)}</b>: {escape(note)}</li>" for label, note in notes)
    return f"<details><summary>What the rows are</summary><ul>{items}</ul></details>"


def _place_by_place(title: str, found: Sequence[Difference]) -> str:
    lines = [
        f"<tr><td>{escape(group)}</td><td>{escape(which)}</td>{''.join(map(_apart, line))}</tr>"
        for group, which, line in lines_of(found)
    ]
    if not lines:
        return ""
    columns = dict.fromkeys(f"<th>{escape(one.column.title)}<br>{escape(one.column.unit)}</th>" for one in found)
    return (
        f"<details><summary>{escape(title)}</summary><p>{escape(HOW_AGAINST)}</p>"
        f"<table><tr><th></th><th></th>{''.join(columns)}</tr>{''.join(lines)}</table></details>"
    )


def _apart(found: Difference) -> str:
    return f"<td>{f'<b>{told_of(found)}</b>' if found.told_apart else told_of(found)}</td>"


def _orders(found: Sequence[Order]) -> str:
    if not found:
        return ""
    rows = "".join(
        f"<tr><td>{escape(one.group)}</td><td>{escape(one.column)}</td><td>{escape(one.first)} &gt; {escape(one.second)}</td>"
        f"<td>{_ratio(one.paper_ratio)}</td><td>{_ratio(one.our_ratio)}</td><td>{one.places}</td><td>{one.verdict}</td></tr>"
        for one in found
    )
    head = (
        "<tr><th></th><th></th><th>the paper's order</th><th>its ratio</th><th>ours</th><th>places</th><th></th></tr>"
    )
    return f"<details><summary>Orderings and ratios: {escape(summary(found))}</summary><table>{head}{rows}</table></details>"


def _ratio(number: float | None) -> str:
    return "-" if number is None else f"{number:.2f}"


def _runs(table: Table, behind: Behind) -> str:
    rows = "".join(
        f"<h4 id='{_anchor(row)}'>{escape(row.row.group)}: {escape(row.row.label)}</h4>{_run_list(row.runs, behind)}"
        for row in table.rows
    )
    return f"<details class=runs><summary>The runs behind the numbers</summary>{rows}</details>"


def _run_list(runs: Iterable[Ran], behind: Behind) -> str:
    return "<ul>" + "".join(f"<li>{_run(run, behind)}</li>" for run in runs) + "</ul>"


def _run(run: Ran, behind: Behind) -> str:
    if run.kept is None:
        why = escape((run.problem.strip().splitlines() or ["not driven yet"])[-1])
        return f"run {run.number}, seed {run.seed}: <span class=warn>{why}</span>"
    path, metrics = f"{behind.base}/{run.key}", run.kept.metrics
    ticks = ", ".join(
        f"tick {moment.tick} ({escape(moment.what)})" for moment in run.kept.moments if moment.tick is not None
    )
    files = behind.why_no_log(run.key) or (
        f"<a href='{path}/{LOG}'>log</a>, <a href='{path}/metrics.json'>metrics</a>, <a href='{path}/spec.json'>spec</a>"
    )
    return (
        f"run {run.number}, seed {run.seed}: {files}; {(metrics.get('distance_m') or 0.0) / 1000:.2f} km, "
        f"{metrics.get('ticks') or 0:d} ticks{'; ' + ticks if ticks else ''}<br><code>{_to_see(run, behind)}</code>"
    )


def _to_see(run: Ran, behind: Behind) -> str:
    """The command that shows a run; of a published one, the command that drives it here; of one without a log, what comes before."""
    why = behind.why_no_log(run.key)
    if not why:
        return f"drivemcp replay {behind.base}/{run.key}/{LOG}"
    if why == GONE:
        return f"rm -r {behind.base}/{run.key}"
    return escape(f"{behind.again} {run.key}")


def _moments(tables: Sequence[Table], behind: Behind) -> str:
    shown = "".join(_moment(row, run, moment, behind) for row, run, moment in worst(tables))
    driven = any(run.kept for table in tables for row in table.rows for run in row.runs)
    none = (
        "None: nothing struck, run, missed narrowly or left unanswered, no overspeed."
        if driven
        else "Nothing was driven."
    )
    return f"<h2>The worst moments</h2>{f'<div class=moments>{shown}</div>' if shown else f'<p>{none}</p>'}"


def worst(tables: Sequence[Table]) -> list[tuple[TableRow, Ran, Moment]]:
    """The worst, kind by kind, each run once of a kind; DriveMCP's own, and in place of those that it has not, others'."""
    found: Mapping[tuple[str, str], tuple[TableRow, Ran, Moment]] = {
        (run.key, moment.kind): (row, run, moment)
        for table in tables for row in table.rows for run in row.runs if run.kept is not None for moment in run.kept.moments
    }  # fmt: skip
    ranked = sorted(found.values(), key=lambda each: (each[0].row.spec.method != OURS, -each[2].badness))
    by_kind = ([each for each in ranked if each[2].kind == kind] for kind in KINDS)
    return [each for of_kind in shown(by_kind) for each in of_kind]


def _moment(row: TableRow, run: Ran, moment: Moment, behind: Behind) -> str:
    picture = _picture(behind.runs / run.key, moment)
    why = behind.why_no_log(run.key)
    log = f"{why.capitalize()}:" if why else f"<a href='{behind.base}/{run.key}/{LOG}'>log</a>"
    return (
        f"<figure>{picture}<figcaption><b>{escape(moment.kind)}</b>: {escape(moment.what)}, at {moment.time_s:.1f} s, tick {moment.tick}. "
        f"{escape(row.row.table)}, {escape(row.row.group)}: {escape(row.row.label)}, run {run.number}. {log} "
        f"<code>{_to_see(run, behind)}</code></figcaption></figure>"
    )


def _picture(run: Path, moment: Moment) -> str:
    """The camera's; without one what truth has, seen from above; nothing of a run that is not here."""
    # A published moment's picture is a name from outside: only a file of the run itself is shown
    if moment.picture == Path(moment.picture).name and (run / moment.picture).is_file():
        data = base64.b64encode((run / moment.picture).read_bytes()).decode("ascii")
        return f"<img alt='{escape(moment.kind)}' src='data:image/jpeg;base64,{data}'>"
    if not (run / LOG).is_file():
        return ""
    try:
        return seen_from_above(from_log(run / LOG), moment)
    except (UserError, *DAMAGED) as error:
        return f"<p>No picture: {escape(str(run / LOG))}: {escape(str(error))}</p>"


def _reading() -> str:
    items = "".join(f"<li>{escape(text)}</li>" for text in contradictions())
    return f"<h2>Where the paper's tables cannot follow from its own definitions</h2><ul>{items}</ul>"


def _missing(tables: Sequence[Table]) -> str:
    rows = {
        run.key: f"<li>{escape(table.name)}, {escape(row.row.label)}, run {run.number}<pre>{escape(run.problem[-2000:])}</pre></li>"
        for table in tables for row in table.rows for run in row.runs if run.problem and run.kept is None
    }  # fmt: skip
    return f"<h2>Runs that failed</h2><ul>{''.join(rows.values())}</ul>" if rows else ""
