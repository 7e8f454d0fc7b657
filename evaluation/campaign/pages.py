"""A table that is one page: JSON, CSV, Markdown and HTML beside each other."""

import argparse
import csv
import io
from collections.abc import Iterable, Mapping, Sequence
from functools import cache
from pathlib import Path
from typing import Any

import jinja2
import msgspec

from evaluation.campaign.machine import commit, machine
from evaluation.campaign.replacing import write_whole


def csv_text(rows: Iterable[Mapping[str, Any]], names: Sequence[str] = ()) -> str:
    """The rows with a head; `names`: the columns, where not those of the rows."""
    rows = list(rows)
    text = io.StringIO(newline="")
    writer = csv.DictWriter(
        text, names or list(dict.fromkeys(name for row in rows for name in row)), lineterminator="\n"
    )
    writer.writeheader()
    writer.writerows(rows)
    return text.getvalue()


@cache
def _templates(folder: Path) -> jinja2.Environment:
    return jinja2.Environment(
        loader=jinja2.FileSystemLoader(folder),
        undefined=jinja2.StrictUndefined,
        autoescape=lambda name: name is not None and name.endswith(".html.jinja"),
        keep_trailing_newline=False,
    )


def write_pages(
    folder: Path, name: str, command: str, flags: argparse.Namespace, data: Mapping[str, Any], table: str, *,
    templates: Path, **values: Any,
) -> None:  # fmt: skip
    """NAME.json with `data`, NAME.csv with `table`, NAME.md and NAME.html of NAME.md.jinja and NAME.html.jinja in `templates` with
    `values`; the Markdown goes where `--docs` says, too. Raises OSError.
    """
    about = {"command": command, "sensors": flags.sensors, "commit": commit(), "machine": machine()}
    markdown, html = (
        (_templates(templates).get_template(f"{name}.{kind}.jinja").render(about=about, **values) + "\n").encode()
        for kind in ("md", "html")
    )
    write_whole(folder / f"{name}.json", msgspec.json.format(msgspec.json.encode({**about, **data})))
    write_whole(folder / f"{name}.csv", table.encode())
    write_whole(folder / f"{name}.md", markdown)
    write_whole(folder / f"{name}.html", html)
    if flags.docs:
        write_whole(Path(flags.docs), markdown)
