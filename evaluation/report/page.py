"""A page of the docs, made from the tables: what was driven, the numbers beside the paper's, plots, what holds and what does not.

The page begins with the field's yardsticks, taken from the pages of the tables isa and guard that lie beside it. What a
person has written about the numbers stands between two marks, and stays when the page is made anew.
"""

import re
from collections.abc import Mapping, Sequence
from itertools import dropwhile, takewhile
from pathlib import Path

from drivemcp.errors import UserError
from evaluation.campaign.names import TableName
from evaluation.campaign.replacing import write_whole
from evaluation.report.plots import plots_of
from evaluation.report.reading import contradictions
from evaluation.report.report import TEMPLATES, About
from evaluation.tables.assumed import about_latencies
from evaluation.tables.goals import judged
from evaluation.tables.tables import Table

BEGIN, END = "<!-- reading: from here ... -->", "<!-- ... to here stays when the page is made anew -->"


YARDSTICKS = (("Speed assistance", "isa.md"), ("The guard alone", "guard.md"), ("Real pictures", "real.md"))
"""Title, and the page beside this one: `drivemcp evaluate isa --docs` and `drivemcp evaluate guard --docs` make the first two; the third is
written by hand from `python -m studies real`, since no photograph is part of the repository.
"""


def yardsticks(folder: Path) -> str:
    """The first table of each such page that is there, with a link to it. Raises UserError where one cannot be read."""
    return "\n\n".join(
        f"## {title}\n\nMethod, routes and further tables: [{name}]({name}).\n\n{table}"
        for title, name in YARDSTICKS
        if (table := _first_table(folder / name))
    )


def _first_table(file: Path) -> str:
    try:
        lines = file.read_text(encoding="utf-8").splitlines()
    except FileNotFoundError:
        return ""
    except (OSError, UnicodeDecodeError) as error:
        raise UserError(f"{file}: {error}") from None
    from_table = dropwhile(lambda line: not line.startswith("|"), lines)
    return "\n".join(takewhile(lambda line: line.startswith("|"), from_table))


def write(file: Path, tables: Sequence[Table], about: About, held: Sequence[str] = ()) -> None:
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
    write_whole(
        file, page(tables, about, reading, pictures, "" if about.cassette else yardsticks(file.parent), held).encode()
    )


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
    yardsticks: str = "",
    held: Sequence[str] = (),
) -> str:
    """The page as Markdown; `pictures` are (title, path) of each table's plots, `yardsticks` and `held` (Markdown) what it begins with."""
    return TEMPLATES.get_template("page.md.jinja").render(
        tables=tables, about=about, reading=reading, pictures=pictures, begin=BEGIN, end=END, goals=judged(tables),
        contradictions=contradictions(), yardsticks=yardsticks, held=held,
        about_latencies=about_latencies(tables, "*assumed*", " ([measured](../../how-to/evaluation.md#latencies))"),
    )  # fmt: skip
