"""What each study tells: tables in Markdown and lines beneath them, or with `--json` the same as one JSON object."""

import argparse
import math
import sys
from collections.abc import Iterable, Sequence
from typing import Any

import msgspec

from evaluation.tables.columns import Column
from evaluation.tables.goals import told
from evaluation.tables.tables import Value

Cell = str | int | float | Value | None
"""As measured; its column says in which unit and with how many places it is shown. None and NaN: nothing to measure."""


class Sheet(msgspec.Struct, frozen=True):
    """A table. A column without unit and places is given by its title alone."""

    columns: Sequence[str | Column]
    rows: Sequence[Sequence[Cell]]
    notes: Sequence[str] = ()
    title: str = ""

    def markdown(self) -> str:
        """As the docs show it."""
        columns = [each if isinstance(each, Column) else Column(title=each) for each in self.columns]
        lines = [_line(map(_head, columns)), f"|{'---|' * len(columns)}"] if columns else []
        lines += [_line(map(shown, row, columns)) for row in self.rows]
        return "\n\n".join(each for each in (self.title, "\n".join(lines), "\n".join(self.notes)) if each)

    def plain(self) -> dict[str, Any]:
        """For JSON: each row by its heads, in the units of the columns."""
        heads = [_head(each) if isinstance(each, Column) else each for each in self.columns]
        scales = [each.scale if isinstance(each, Column) else 1.0 for each in self.columns]
        rows = [
            {head: _scaled(cell, scale) for head, cell, scale in zip(heads, row, scales, strict=True)}
            for row in self.rows
        ]
        return {"title": self.title, "rows": rows, "notes": list(self.notes)}


def percent(title: str, places: int = 1) -> Column:
    """A column of shares, shown in %."""
    return Column(title=title, unit="%", scale=100, places=places)


def shown(cell: Cell, column: Column) -> str:
    """A cell as text."""
    if isinstance(cell, Value):
        return told(cell, column)
    if cell is None or (isinstance(cell, float) and math.isnan(cell)):
        return "-"
    return f"{cell * column.scale:.{column.places}f}" if isinstance(cell, float) else str(cell)


def add_json(parser: argparse.ArgumentParser) -> None:
    """Add `--json`."""
    parser.add_argument("--json", action="store_true", help="one JSON object in place of the tables")


def show(sheets: Iterable[Sheet], *, as_json: bool = False, figures: Any = None) -> None:
    """Write them. `figures`: what JSON gets beside the tables, where a study measures more than they show."""
    if as_json:
        object_ = {"tables": [each.plain() for each in sheets], "figures": figures}
        text = msgspec.json.format(msgspec.json.encode(object_)).decode()
    else:
        text = "\n\n".join(each.markdown() for each in sheets)
    sys.stdout.write(f"{text}\n")
    sys.stdout.flush()


def _head(column: Column) -> str:
    return f"{column.title}, {column.unit}" if column.unit else column.title


def _line(cells: Iterable[str]) -> str:
    return f"| {' | '.join(cells)} |"


def _scaled(cell: Cell, scale: float) -> Cell:
    return cell * scale if isinstance(cell, float) else cell
