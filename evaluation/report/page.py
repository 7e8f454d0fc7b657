"""A page of the docs, made from the tables: what was driven, the numbers beside the paper's, plots, what holds and what does not.

What somebody has written about the numbers stands between two marks, and stays when the page is made anew.
"""

import re
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path

from drivemcp.errors import UserError
from evaluation.campaign.names import TableName
from evaluation.campaign.replacing import write_whole
from evaluation.report.plots import plots_of
from evaluation.report.reading import contradictions
from evaluation.report.report import About
from evaluation.tables.assumed import about_latencies, assumed
from evaluation.tables.columns import COLUMNS, Column
from evaluation.tables.compare import HOW_AGAINST, Difference, comparisons, lines_of, orders, summary, told_of
from evaluation.tables.goals import judged, papers, told
from evaluation.tables.tables import INTERVALS, Table, TableRow, Value

BEGIN, END = "<!-- reading: from here ... -->", "<!-- ... to here stays when the page is made anew -->"


def write(file: Path, tables: Sequence[Table], about: About) -> None:
    """Write the page, and its plots into the folder beside it that has its name. Raises UserError as `reading_of` does, OSError."""
    reading = reading_of(file)
    folder = file.with_suffix("")
    folder.mkdir(parents=True, exist_ok=True)
    pictures: dict[TableName, list[tuple[str, str]]] = {}
    for table in tables:
        for title, svg in plots_of(table):
            picture = folder / f"{re.sub('[^a-z0-9]+', '-', title.lower()).strip('-')}.svg"
            write_whole(picture, svg.encode())
            pictures.setdefault(table.name, []).append((title, f"{folder.name}/{picture.name}"))
    write_whole(file, page(tables, about, reading, pictures).encode())


def reading_of(file: Path) -> str:
    """What stands between the marks of a page that is there. Raises UserError where a page has not both of them."""
    try:
        text = file.read_text(encoding="utf-8")
    except FileNotFoundError:
        return ""
    except (OSError, UnicodeDecodeError) as error:
        raise UserError(f"--docs {file}: {error}") from None
    _, begun, rest = text.partition(BEGIN)
    reading, ended, _ = rest.partition(END)
    if not (begun and ended):
        raise UserError(
            f"--docs {file}: the page has no lines {BEGIN!r} and {END!r}, so what was written into it would be lost; put them about it, or "
            "name another file"
        )
    return reading.strip("\n")


def page(
    tables: Sequence[Table],
    about: About,
    reading: str = "",
    pictures: Mapping[TableName, Sequence[tuple[str, str]]] = {},
) -> str:
    """The page as Markdown; `pictures` are (title, path) of each table's plots."""
    lines = [
        line
        for table in tables
        for line in (*_table(table), *_compared(table), *_pictures(pictures.get(table.name, ())), *_beside(table))
    ]
    return "\n".join([*_head(tables, about, reading), *lines, *_goals(tables), *_paper()]) + "\n"


def _head(tables: Sequence[Table], about: About, reading: str) -> Iterator[str]:
    yield "# Results in rendered pictures\n" if about.sensors == "rendered" else "# Results\n"
    yield (
        "Made by the command below with `--docs`; only what stands between its two marks is written by hand, and stays. What each "
        "number is: [metrics.md](metrics.md); what the rows are, the same questions open loop, and what one would have without all this: "
        "[methods.md](methods.md); how the constants were fitted: [calibration.md](calibration.md); latencies as they are measured live, "
        "and beside LangGraph with MCP: [benchmarks.md](benchmarks.md).\n"
    )
    yield f"```\n{about.command}\n```\n"
    yield f"{BEGIN}\n{reading}\n{END}\n"
    if about.quick:
        yield "**This is a quick run: it shows that everything works; its numbers prove nothing, and the intervals say so.**\n"
    yield (
        f"{about.runs} runs, {about.km:.2f} km, {about.driven_s / 60:.1f} minutes driven in {about.wall_s / 60:.1f} minutes "
        f"of wall time (all slots together); {about.missing} runs are missing. "
        f"Made at {about.commit}; driven on {about.machine}. "
        f"Sensors: {about.sensors}. DriveLM backend: {about.backend}. Latencies: {about.latencies}.\n"
    )
    if about.published:
        yield f"{about.published}\n"
    yield (
        f"Each cell: value [95 % interval] / the paper's. {INTERVALS}; after ± stands the standard deviation over runs, "
        "of the paper's numbers in the ablation table half of its 95 % interval. "
        "The paper drove in CARLA: orderings and ratios can be compared, absolute numbers only stand side by side. "
        f"In the plots diamonds are the paper's. {about_latencies(tables, '*assumed*', ' ([measured](evaluation.md#latencies))')}\n"
    )


def _pictures(pictures: Sequence[tuple[str, str]]) -> Iterator[str]:
    yield from (f"![{title}]({path})\n" for title, path in pictures)


def _table(table: Table) -> Iterator[str]:
    at = [number for number, column in enumerate(table.columns) if column in COLUMNS[table.name]]
    heads = [f"{table.columns[each].title}, {table.columns[each].unit}" for each in at]
    yield f"## {table.name}, {table.sensors} sensors\n"
    yield "| " + " | ".join(["", "runs, km", *heads]) + " |"
    yield "|" + "---|" * (len(heads) + 2)
    for row in table.rows:
        yield _row(table.label(row), row, [(row.values[each], table.columns[each]) for each in at])
    yield ""
    if found := orders(table):
        yield f"Of {len(found)} pairs that the paper puts in an order, compared place by place: {summary(found)}.\n"


def _compared(table: Table) -> Iterator[str]:
    for title, found in comparisons(table):
        yield from _place_by_place(table, title, found)


def _place_by_place(table: Table, title: str, found: Sequence[Difference]) -> Iterator[str]:
    lines = list(lines_of(found))
    if not lines:
        return
    yield f"<details><summary>{title}</summary>\n"
    yield f"{HOW_AGAINST.replace('bold', '**bold**')}\n"
    columns = [column for column in table.columns if column in COLUMNS[table.name]]
    yield "| " + " | ".join(["", *(f"{column.title}, {column.unit}" for column in columns)]) + " |"
    yield "|" + "---|" * (len(columns) + 1)
    for group, which, line in lines:
        yield "| " + " | ".join([f"{group}: {which}", *map(_apart, line)]) + " |"
    yield "\n</details>\n"


def _apart(found: Difference) -> str:
    return f"**{told_of(found)}**" if found.told_apart else told_of(found)


def _row(label: str, row: TableRow, cells: Sequence[tuple[Value, Column]]) -> str:
    numbers = [
        f"{_number(value, column, row)}{f' / {papers(value)}' if value.paper is not None else ''}"
        for value, column in cells
    ]
    return (
        "| "
        + " | ".join([f"{row.row.group}: {label}", f"{len(row.runs) - row.missing}, {row.km:.2f}", *numbers])
        + " |"
    )


def _number(value: Value, column: Column, row: TableRow) -> str:
    number, _, interval = told(value, column).partition(" ")
    spread = f" ± {value.sd:.{column.places}f}" if value.sd is not None else ""
    return f"{number}{spread}{f' {interval}' if interval else ''}{_mark(column, row)}"


def _mark(column: Column, row: TableRow) -> str:
    return " *assumed*" if assumed(column, row.row.spec) else ""


def _beside(table: Table) -> Iterator[str]:
    """What we measure and the paper does not, of the results table: a line for each number, a column for each method."""
    if table.name != "results":
        return
    yield "<details><summary>What we measure beside</summary>\n"
    for group, rows in table.groups.items():
        yield f"| {group} | " + " | ".join(table.label(row) for row in rows) + " |"
        yield "|" + "---|" * (len(rows) + 1)
        for at, column in enumerate(table.columns):
            if column not in COLUMNS[table.name]:
                cells = " | ".join(f"{told(row.values[at], column)}{_mark(column, row)}" for row in rows)
                yield f"| {column.title}, {column.unit} | {cells} |"
        yield ""
    yield "</details>\n"


def _goals(tables: Sequence[Table]) -> Iterator[str]:
    found = judged(tables)
    if not found:
        return
    yield "## What we want to read\n"
    yield "| what | wanted | found | |\n|---|---|---|---|"
    yield from (f"| {one.what} | {one.bound} | {one.found} | {one.verdict} |" for one in found)
    yield ""
    for one in found:
        if one.distance:
            yield f"- {one.what}: {one.distance}."
    yield ""


def _paper() -> Iterator[str]:
    yield "## Where the paper's tables cannot follow from its own definitions\n"
    yield from (f"- {text}" for text in contradictions())
