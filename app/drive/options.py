"""Flags of `drivemcp up` and `drivemcp play` that other distributions add."""

import argparse
from collections.abc import Callable, Mapping
from functools import cache
from importlib.metadata import entry_points
from pathlib import Path
from typing import Protocol

from drivemcp.node import Node

GROUP = "drivemcp.drive_options"


class DriveOption(Protocol):
    """One flag that runs some services of a drive inside a host of its own."""

    def add_flag(self, parser: argparse.ArgumentParser) -> None:
        """Add the flag."""

    def hosts(self, flags: argparse.Namespace) -> Mapping[str, tuple[str, ...]]:
        """By service: the module, and its first arguments, that hosts it. Empty without the flag. Raises UserError."""

    def follow(self, node: Node, folder: Path) -> Callable[[], str]:
        """Listen while it drives; what is returned gives the line that the end of the drive shows."""


@cache
def options() -> tuple[DriveOption, ...]:
    """All options that are installed, in the order of their names. One whose distribution is incomplete is left out."""
    found = []
    for point in sorted(entry_points(group=GROUP), key=lambda point: point.name):
        try:
            found.append(point.load()())
        except ModuleNotFoundError:
            continue
    return tuple(found)
