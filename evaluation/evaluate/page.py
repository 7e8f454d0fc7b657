"""docs/results.md, made from the tables: what was driven, the numbers beside the paper's, what holds and what does not."""

from collections.abc import Iterator, Sequence

from evaluation.evaluate.columns import COLUMNS, Column
from evaluation.evaluate.compare import orders
from evaluation.evaluate.goals import judged, told
from evaluation.evaluate.reading import contradictions
from evaluation.evaluate.report import About
from evaluation.evaluate.tables import Table, TableRow, Value


def page(tables: Sequence[Table], about: About) -> str:
    """The page as Markdown."""
    return (
        "\n".join([*_head(about), *(line for table in tables for line in _table(table)), *_goals(tables), *_paper()])
        + "\n"
    )


def _head(about: About) -> Iterator[str]:
    yield "# Results\n"
    yield "Made by the command below with `--docs`; do not edit. What each number is: [evaluation.md](evaluation.md).\n"
    yield f"```\n{about.command}\n```\n"
    if about.quick:
        yield "**This is a quick run: it shows that everything works; its numbers prove nothing, and the intervals say so.**\n"
    yield (
        f"{about.runs} runs, {about.km:.2f} km, {about.driven_s / 60:.1f} minutes driven in {about.wall_s / 60:.1f} minutes "
        f"of wall time (all slots together); {about.missing} runs are missing. "
        f"{about.machine}. Sensors: {about.sensors}. DriveLM backend: {about.backend}. Latencies: {about.latencies}.\n"
    )
    if about.published:
        yield f"{about.published}\n"
    yield (
        "Each cell: value [95 % interval] / the paper's. Rates have the exact Poisson interval of all runs together, shares the exact "
        "binomial one, other numbers Student's for the mean over runs. The paper drove in CARLA: orderings and ratios can be "
        "compared, absolute numbers only stand side by side.\n"
    )


def _table(table: Table) -> Iterator[str]:
    at = [number for number, column in enumerate(table.columns) if column in COLUMNS[table.name]]
    heads = [f"{table.columns[each].title}, {table.columns[each].unit}" for each in at]
    yield f"## {table.name}, {table.sensors} sensors\n"
    yield "| " + " | ".join(["", "runs, km", *heads]) + " |"
    yield "|" + "---|" * (len(heads) + 2)
    yield from (_row(row, [(row.values[each], table.columns[each]) for each in at]) for row in table.rows)
    yield ""
    if table.pairs:
        yield "Faulty less sound, pairs with the same scene: " + "; ".join(
            f"{pair.label.partition(':')[0]}, {pair.column}: {told(pair.value, Column(title=''))} {pair.unit}" for pair in table.pairs
        ) + ".\n"  # fmt: skip
    found = [one.verdict for one in orders(table)]
    if found:
        counts = ", ".join(f"{found.count(verdict)} {verdict}" for verdict in dict.fromkeys(found))
        yield f"Of {len(found)} pairs that the paper puts in an order: {counts}.\n"


def _row(row: TableRow, cells: Sequence[tuple[Value, Column]]) -> str:
    numbers = [
        f"{told(value, column)}{'' if value.paper is None else f' / {value.paper:g}'}" for value, column in cells
    ]
    return (
        "| "
        + " | ".join([f"{row.row.group}: {row.row.label}", f"{len(row.runs) - row.missing}, {row.km:.2f}", *numbers])
        + " |"
    )


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
