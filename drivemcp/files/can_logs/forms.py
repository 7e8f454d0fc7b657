"""The kind of a text log, by its ending and its first lines."""

import itertools
import re
from pathlib import Path

from drivemcp.files.can_logs.table import LOOK_ROWS, Table, header_of
from drivemcp.files.can_logs.text import (
    CSV_HEADER,
    EVENT,
    HEADER_LINES,
    Asc,
    Candump,
    Csv,
    Form,
    Trc,
    open_text,
    suffix_of,
)


def form_of(path: Path) -> Form:
    """How to read it."""
    suffix = suffix_of(path)
    if suffix in (".log", ".trc"):
        return Candump() if suffix == ".log" else Trc()
    with open_text(path) as file:
        if suffix == ".asc":
            head = itertools.islice(file, HEADER_LINES)
            return Asc(list(itertools.takewhile(lambda line: not EVENT.match(line), head)))
        return _table_of(list(itertools.islice(file, LOOK_ROWS)))


def _table_of(head: list[str]) -> Form:
    first = next((line.strip() for line in head if line.strip()), "")
    header = None if first == CSV_HEADER else header_of(head)
    if header is not None:
        return Table(header, head)
    return Csv("" if first == CSV_HEADER or any(map(str.isdigit, re.split("[,;\t.]", first))) else first)
