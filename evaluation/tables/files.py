"""CSV and JSON of runs and tables."""

from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

import msgspec

from evaluation.campaign.pages import csv_text
from evaluation.campaign.replacing import write_whole
from evaluation.tables.compare import against, orders, with_and_without_faults
from evaluation.tables.tables import Ran, Table, TableRow

RUN_COLUMNS = ("table", "row", "family", "number", "seed", "run", "problem", "wall_s", "cpu_s")


def write(folder: Path, tables: Sequence[Table]) -> list[Path]:
    """TABLE.csv, TABLE.json and runs.csv; the paths."""
    folder.mkdir(parents=True, exist_ok=True)
    paths = [folder / "runs.csv"]
    _write_csv(paths[0], [_run(table, row, ran) for table in tables for row in table.rows for ran in row.runs])
    for table in tables:
        paths += [folder / f"{table.name}.csv", folder / f"{table.name}.json"]
        _write_csv(paths[-2], [_row(table, row) for row in table.rows])
        told = {
            "table": table, "against": against(table), "with_and_without_faults": with_and_without_faults(table),
            "orders": orders(table),
        }  # fmt: skip
        write_whole(paths[-1], msgspec.json.format(msgspec.json.encode(told)))
    return paths


def _run(table: Table, row: TableRow, ran: Ran) -> dict[str, Any]:
    kept = ran.kept
    told = (
        table.name, row.row.key, row.row.family, ran.number, ran.seed, ran.key, _last_line(ran.problem),
        kept.wall_s if kept else None, kept.cpu_s if kept else None,
    )  # fmt: skip
    return {**dict(zip(RUN_COLUMNS, told, strict=True)), **flat(kept.metrics if kept else {})}


def _last_line(text: str) -> str:
    return (text.strip().splitlines() or [""])[-1]


def flat(metrics: Mapping[str, Any]) -> dict[str, Any]:
    """Nested fields by dotted names; lists joined by blanks."""
    out: dict[str, Any] = {}
    for name, value in metrics.items():
        if isinstance(value, dict):
            out |= {f"{name}.{inner}": each for inner, each in flat(value).items()}
        else:
            out[name] = " ".join(f"{each:g}" for each in value) if isinstance(value, list | tuple) else value
    return out


def _row(table: Table, row: TableRow) -> dict[str, Any]:
    cells: dict[str, Any] = {
        "group": row.row.group, "row": row.row.label, "family": row.row.family, "sensors": table.sensors,
        "backend": row.backend, "runs": len(row.runs) - row.missing, "missing": row.missing, "km": round(row.km, 3),
    }  # fmt: skip
    for column, value in zip(table.columns, row.values, strict=True):
        name = f"{column.title} [{column.unit}]"
        cells |= {name: value.value, f"{name} sd": value.sd, f"{name} low": value.low, f"{name} high": value.high}
        cells |= {f"{name} of": value.of} | ({f"{name} paper": value.paper} if column.paper else {})
    return cells


def _write_csv(path: Path, rows: Iterable[Mapping[str, Any]]) -> None:
    write_whole(path, csv_text(rows).encode())
