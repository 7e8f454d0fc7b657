"""Medians, and tables in Markdown; the machine they were measured on."""

import os
import statistics
from collections.abc import Sequence

from evaluation.campaign.machine import machine


def median(values: Sequence[float]) -> float:
    """The median."""
    return statistics.median(values)


def table(head: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """A Markdown table, its columns aligned."""
    widths = [max(len(row[i]) for row in (head, *rows)) for i in range(len(head))]
    lines = [
        "| " + " | ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=True)) + " |"
        for row in (head, *rows)
    ]
    lines.insert(1, "|" + "|".join("-" * (width + 2) for width in widths) + "|")
    return "\n".join(lines)


def machine_now() -> str:
    """The machine, and how busy it is."""
    return f"{machine()}, load {os.getloadavg()[0]:.1f} at the start"
