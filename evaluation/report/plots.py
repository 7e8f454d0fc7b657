"""Plots as SVG text: bars with intervals for rows, curves over a rate or Delta; the paper's numbers as diamonds."""

import io
import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from drivemcp.errors import UserError
from evaluation.tables.columns import COLUMNS, Column
from evaluation.tables.tables import Table, TableRow, Value

if TYPE_CHECKING:
    from matplotlib.figure import Figure

OURS, PAPER, FAINT = "#1f5fa8", "#d1780f", "#9aa5b1"


def plots_of(table: Table) -> list[tuple[str, str]]:
    """(title, SVG) of a table, by group: curves where its rows lie on one, else bars."""
    columns = [(at, column) for at, column in enumerate(table.columns) if column in COLUMNS[table.name]]
    return [(f"{table.name}: {group}", svg_of(_plot(group, rows, columns))) for group, rows in table.groups.items()]


def _plot(group: str, rows: Sequence[TableRow], columns: Sequence[tuple[int, Column]]) -> "Figure":
    if any(row.row.at is None for row in rows):
        return _bars(rows, columns)
    return _curves(group, rows, columns)


def _curves(name: str, rows: Sequence[TableRow], columns: Sequence[tuple[int, Column]]) -> "Figure":
    figure, axes = _axes(len(columns), 2.6)
    for axis, (at, column) in zip(axes, columns, strict=True):
        told = [(row.row.at, row.values[at]) for row in rows if row.values[at].value is not None]
        places = [place for place, _ in told]
        axis.errorbar(
            places,
            [v.value for _, v in told],
            yerr=_errors([v for _, v in told]),
            color=OURS,
            marker="o",
            capsize=3,
            markersize=4,
        )
        printed = [(row.row.at, row.values[at].paper) for row in rows if row.values[at].paper is not None]
        axis.plot(*(zip(*printed, strict=True) if printed else ((), ())), "D", color=PAPER, markersize=5)
        axis.set_title(_title(column), fontsize=9)
        axis.set_xlabel(name, fontsize=8)
        axis.set_ylim(bottom=0)
    return figure


def _bars(rows: Sequence[TableRow], columns: Sequence[tuple[int, Column]]) -> "Figure":
    figure, axes = _axes(len(columns), 0.7 + 0.3 * len(rows), share=True)
    places = list(range(len(rows)))[::-1]
    for axis, (at, column) in zip(axes, columns, strict=True):
        values = [row.values[at] for row in rows]
        axis.barh(places, [v.value or 0.0 for v in values], color=OURS, alpha=0.75, height=0.6)
        axis.errorbar(
            [v.value or 0.0 for v in values],
            places,
            xerr=_errors(values),
            fmt="none",
            ecolor="#222",
            capsize=2,
            linewidth=1,
        )
        for place, value in zip(places, values, strict=True):
            if value.value is None:
                axis.text(0, place, " not measured", va="center", fontsize=7, color=FAINT)
            if value.paper is not None:
                axis.plot([value.paper], [place], "D", color=PAPER, markersize=5)
        axis.set_title(_title(column), fontsize=9)
        axis.set_xlim(left=0)
    axes[0].set_yticks(places, [row.row.label for row in rows], fontsize=8)
    return figure


def _errors(values: Sequence[Value]) -> list[list[float]]:
    """Down and up; no number where there is no interval, so that none is drawn: a single run is not a sure one."""
    down = [max(0.0, v.value - v.low) if v.value is not None and v.low is not None else math.nan for v in values]
    up = [max(0.0, v.high - v.value) if v.value is not None and v.high is not None else math.nan for v in values]
    return [down, up]


def _title(column: Column) -> str:
    return f"{column.title}, {column.unit}"


def _axes(count: int, height: float, *, share: bool = False) -> tuple["Figure", Sequence[Any]]:
    figure, axes = figure_of((1, count), (2.3 * count + 1.2, max(height, 1.6)), share=share)
    for axis in axes:
        axis.grid(alpha=0.25)
    return figure, axes


def figure_of(
    shape: tuple[int, int], size: tuple[float, float], *, share: bool = False, ratios: Sequence[float] | None = None
) -> tuple["Figure", Sequence[Any]]:
    """A figure of (rows, columns) and its axes, row by row; `size` is (width, height) in inches, `ratios` the rows' heights."""
    try:
        from matplotlib.figure import Figure
    except ImportError as error:
        raise UserError("matplotlib is missing; install the extra: pip install 'drivemcp[tables]'") from error
    figure = Figure(figsize=size, layout="constrained")
    axes = list(figure.subplots(*shape, squeeze=False, sharey=share, height_ratios=ratios).flat)
    for axis in axes:
        axis.tick_params(labelsize=7)
        axis.spines[["top", "right"]].set_visible(False)
    return figure, axes


def svg_of(figure: "Figure") -> str:
    """The picture as an element for a page, its letters as text, the same for the same numbers."""
    from matplotlib import rc_context

    out = io.StringIO()
    with rc_context({"svg.fonttype": "none", "svg.hashsalt": "drivemcp"}):
        figure.savefig(out, format="svg", metadata={"Date": None})
    text = out.getvalue()
    return text[text.index("<svg") :]
