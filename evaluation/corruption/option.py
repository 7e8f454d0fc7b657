"""`--corrupt` of `drivemcp up` and `drivemcp play`."""

import argparse
from collections.abc import Callable, Mapping
from pathlib import Path

from drivemcp.node import Node
from evaluation.corruption.hosted import hosts
from evaluation.corruption.record import CorruptionLog
from evaluation.corruption.spec import CLEAN, read_spec


class CorruptOption:
    """Corrupts what services publish (an `app.drive.options.DriveOption`)."""

    def add_flag(self, parser: argparse.ArgumentParser) -> None:
        """Add `--corrupt`."""
        parser.add_argument(
            "--corrupt",
            default=CLEAN,
            metavar="SPEC|FILE.toml",
            help="miss signs, lose actors, ...: sign_miss=0.2,seed=3",
        )

    def hosts(self, flags: argparse.Namespace) -> Mapping[str, tuple[str, ...]]:
        """The services whose publications are corrupted. Raises UserError for a specification that cannot be read."""
        return hosts(read_spec(flags.corrupt))

    def follow(self, node: Node, folder: Path) -> Callable[[], str]:
        """Write `corruption.jsonl` in the drive's folder; the last line counts."""
        log = CorruptionLog(folder)
        log.follow(node)
        return log.line
