"""`drivemcp report DRIVE`: the page of a drive."""

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path

from app.replay.again import AtHand
from app.replay.command import add_profile
from drivemcp.commands import Subparsers
from drivemcp.errors import UserError
from drivemcp.files.modes import others_denied
from services.logger.writing.log_folder import named


def register(subparsers: Subparsers) -> None:
    """Add `drivemcp report`."""
    parser = subparsers.add_parser(
        "report",
        help="write a drive's report: one page to read, with pictures, law and verification",
        description="Writes one self-contained HTML page: every message with its picture, the law that was cited, the numbers and what "
        "would have changed the decision; what was late or missing; settings; and whether the log verifies.",
    )
    parser.add_argument(
        "drive", metavar="DRIVE", nargs="+", help="a drive's folder, its logs' folder, or log files in order"
    )
    parser.add_argument(
        "--out", metavar="FILE", type=Path, help="the page; report.html in the drive's folder otherwise"
    )
    add_profile(parser)
    parser.set_defaults(run=command)


def command(flags: argparse.Namespace) -> int:
    """Write the page, and say where it is."""
    with others_denied():  # it holds pictures
        sys.stdout.write(f"{write_report(named(flags.drive), flags.out, AtHand(flags.profile))}\n")
    return 0


def write_report(files: list[Path], out: Path | None, at_hand: AtHand) -> Path:
    """The path of the page that was written. Raises UserError."""
    try:
        from app.report.drive_log import read_drive
        from app.report.page import page
    except ModuleNotFoundError as error:
        raise UserError(f"the report needs {error.name}: pip install 'drivemcp[report]'") from None
    log = read_drive(files)
    if not log.ticks:
        raise UserError(f"{files[0]} holds no trace of a drive: nothing to report")
    target = out or default_file(files)
    try:
        target.write_text(page(log, at_hand), encoding="utf-8")
    except OSError as error:
        raise UserError(f"{target} cannot be written: {error.strerror}") from None
    return target


def default_file(files: Sequence[Path]) -> Path:
    """`report.html` in the folder of the drive: beside `logs`, where the files lie in such a folder."""
    folder = files[0].resolve().parent
    return (folder.parent if folder.name == "logs" else folder) / "report.html"
