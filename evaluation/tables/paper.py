"""The paper's tables, as numbers: evaluation/paper.json, row by row under the names that our rows have."""

from collections.abc import Mapping
from functools import cache
from pathlib import Path
from typing import Any

import msgspec

from evaluation.campaign.names import PROPOSER, TableName

FILE = Path(__file__).parent.parent / "paper.json"
Numbers = Mapping[str, float]


@cache
def paper() -> dict[str, Any]:
    """The whole file."""
    loaded: dict[str, Any] = msgspec.json.decode(FILE.read_bytes())
    return loaded


@cache
def paper_rows(table: TableName) -> Mapping[str, Numbers]:
    """Row -> column -> number. A language model's rows stand beside the results."""
    whole: dict[str, Any] = paper()["results" if table == PROPOSER else table.replace("-", "_")]
    columns = whole["columns"]
    return {name: dict(zip(columns, values, strict=True)) for name, values in _flat(whole)}


def _flat(whole: dict[str, Any]) -> list[tuple[str, list[float]]]:
    rows = [(f"{row[0]:g}", row) for row in whole.get("rows", ())]
    for name, value in whole.items():
        if isinstance(value, dict):
            rows += [(f"{name}/{inner}", numbers) for inner, numbers in value.items()]
        elif name not in ("columns", "rows", "scenario"):
            rows.append((name, value))
    return rows
