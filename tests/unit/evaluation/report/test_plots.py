"""What a plot shows: the row's number, its interval and the paper's number, each where it belongs."""

import math
from typing import TYPE_CHECKING, Any

import pytest

from evaluation.campaign.names import TableName
from evaluation.campaign.plan import Row
from evaluation.campaign.store import Kept
from evaluation.report import plots
from evaluation.tables.tables import Table, TableRow, Value
from tests.unit.evaluation.evaluate.made import kept, table

if TYPE_CHECKING:
    from matplotlib.figure import Figure

pytest.importorskip("matplotlib")

DIFFERENT = ("infractions_total", "interventions", "collisions")


def made(row: Row, number: int) -> Kept:
    """Rows with numbers of their own, whose runs differ, but for what nobody measured."""
    own = sum(map(ord, row.key)) % 7 + number
    return kept(
        **dict.fromkeys(DIFFERENT, own),
        false_interventions=0,
        event_f1=0.9 - 0.02 * own,
        ttc_escalation_s=(2.0 + own,) if own else (),
    )


@pytest.fixture
def drawn(monkeypatch: pytest.MonkeyPatch) -> list["Figure"]:
    """The figures of all plots that are made, in order."""
    figures: list[Figure] = []

    def kept_figure(figure: "Figure") -> str:
        figures.append(figure)
        return "<svg/>"

    monkeypatch.setattr(plots, "svg_of", kept_figure)
    return figures


def values_of(of: Table, rows: list[TableRow], title: str) -> list[Value]:
    """The numbers of the column that an axis is of."""
    (at,) = (at for at, column in enumerate(of.columns) if f"{column.title}, {column.unit}" == title)
    return [row.values[at] for row in rows]


def whiskers(axis: Any) -> list[list[float]]:
    """The lines of intervals, each x, y of one end, then of the other; none where there is no interval."""
    (bars,) = (each for each in axis.containers if hasattr(each, "has_xerr"))
    (lines,) = bars[2]
    return [
        [float(each) for end in ends for each in end]
        for ends in lines.get_segments()
        if len(ends) and not math.isnan(sum(x + y for x, y in ends))
    ]


def widths(axis: Any) -> list[float]:
    return [float(bar.get_width()) for bar in axis.patches]


def points(line: Any) -> list[tuple[float, float]]:
    return [(float(x), float(y)) for x, y in zip(*line.get_data(), strict=True)]


def diamonds(axis: Any) -> set[tuple[float, float]]:
    return {point for line in axis.lines if line.get_marker() == "D" for point in points(line)}


def intervals_and_papers(axis: Any, places: list[float], values: list[Value], *, upright: bool) -> tuple[int, int]:
    """How many of both an axis shows, each where it belongs: the numbers go up where `upright`, else to the right."""

    def at(number: float, place: float) -> tuple[float, float]:
        return (place, number) if upright else (number, place)

    pairs = list(zip(places, values, strict=True))
    between = [
        [*at(value.low, place), *at(value.high, place)]
        for place, value in pairs
        if value.value is not None and value.low is not None and value.high is not None
    ]
    printed = {at(value.paper, place) for place, value in pairs if value.paper is not None}
    assert whiskers(axis) == [pytest.approx(ends) for ends in between]
    assert diamonds(axis) == printed
    return len(between), len(printed)


@pytest.mark.parametrize("name", ["results", "ablation", "can-fault"])
def test_a_bar_ends_at_the_number_its_line_is_the_interval_and_the_diamond_the_papers(
    name: TableName, drawn: list["Figure"]
) -> None:
    of = table(name, made)
    plots.plots_of(of)
    shown = list[tuple[int, int]]()
    for figure, rows in zip(drawn, of.groups.values(), strict=True):
        labels = [each.get_text() for each in figure.axes[0].get_yticklabels()]
        assert labels == [row.row.label for row in rows]
        places = [float(place) for place in figure.axes[0].get_yticks()]
        assert places == sorted(places, reverse=True), "the first row is on top"
        for axis in figure.axes:
            values = values_of(of, rows, axis.get_title())
            assert widths(axis) == [value.value or 0.0 for value in values]
            shown.append(intervals_and_papers(axis, places, values, upright=False))
    intervals, papers = map(sum, zip(*shown, strict=True))
    assert intervals
    assert papers


@pytest.mark.parametrize("name", ["corruption", "delta"])
def test_a_curve_goes_through_the_numbers_with_their_intervals_and_diamonds(
    name: TableName, drawn: list["Figure"]
) -> None:
    of = table(name, made)
    plots.plots_of(of)
    shown = list[tuple[int, int]]()
    for figure, rows in zip(drawn, of.groups.values(), strict=True):
        places = [row.row.at for row in rows if row.row.at is not None]
        if not places:
            continue  # bars
        for axis in figure.axes:
            values = values_of(of, rows, axis.get_title())
            (curve,) = (line for line in axis.lines if line.get_marker() == "o")
            pairs = zip(places, values, strict=True)
            assert points(curve) == [(at, value.value) for at, value in pairs if value.value is not None]
            shown.append(intervals_and_papers(axis, places, values, upright=True))
    intervals, papers = map(sum, zip(*shown, strict=True))
    assert intervals
    assert bool(papers) == (name == "delta"), "the paper's rates of corruption are bars"


def test_a_single_run_has_no_line_and_what_is_not_measured_says_so(drawn: list["Figure"]) -> None:
    of = table("results", lambda row, number: kept(ttc_escalation_s=()), runs=1)
    plots.plots_of(of)
    (axis,) = (axis for axis in drawn[0].axes if axis.get_title().startswith("TTC"))
    assert not whiskers(axis)
    assert [text.get_text().strip() for text in axis.texts] == ["not measured"] * len(next(iter(of.groups.values())))
