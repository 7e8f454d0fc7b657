"""`drivemcp audit verify FILE...`: whether logs are as they were written."""

import argparse
import itertools
import re
import sqlite3
import sys
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TypeVar

import msgspec

from drivemcp.commands import Subparsers
from drivemcp.errors import UserError
from services.logger.format import chain, signing
from services.logger.memory import kept_files, kept_head
from services.logger.verification.report import UNSEALED, Report
from services.logger.verification.verifier import verify
from services.logger.writing import log_folder

T = TypeVar("T")
_HEX = re.compile(r"[0-9a-fA-F]{64}")
"""A public key, or a head."""


def register(subparsers: Subparsers) -> None:
    """Add `drivemcp audit`."""
    parser = subparsers.add_parser("audit", help="check that a log is as it was written")
    kinds = parser.add_subparsers(metavar="COMMAND", required=True)
    check = kinds.add_parser(
        "verify",
        help="verify log files; names the first changed, dropped, inserted or reordered record",
        description="Several files are also checked to continue each other, in the order given; "
        "of a folder also that no file is gone that the drive's memory knows. "
        "Exit status: 0 all as written (an unclosed file: as far as it goes, and said so), 1 not, or nothing verifies, "
        "2 cannot be read.",
    )
    check.add_argument("files", metavar="FILE", nargs="+", help="a log, a folder of logs, or a drive's folder")
    check.add_argument("--expect-head", metavar="HEX", help="a head that the last file must reach")
    check.add_argument("--key", metavar="HEX|FILE", help="the public key that must have signed")
    check.add_argument(
        "--memory", metavar="FILE", help="the drive's memory.sqlite, whose signed heads settle a lost tail; "
        "found by itself where it lies beside the folder of logs",
    )  # fmt: skip
    check.add_argument("--closed", action="store_true", help="an unclosed file is not good enough")
    check.add_argument("--json", action="store_true")
    check.set_defaults(run=_verify)


def _verify(flags: argparse.Namespace) -> int:
    key, last_head = _public_key(flags.key), _head(flags.expect_head)
    reports = list[Report]()
    paths = log_folder.named(flags.files)
    for path in paths:
        expected = last_head if path == paths[-1] else ""
        reports.append(_verified(path, expected or _kept_head(path, flags.memory), key))
    broken = [*broken_links(reports), *gone_files(flags.files, flags.memory)]
    if flags.json:
        sys.stdout.write(msgspec.json.encode({"files": reports, "continuity": broken}).decode() + "\n")
    else:
        sys.stdout.write("\n".join([*(line for report in reports for line in lines(report)), *broken]) + "\n")
    unclosed = flags.closed and not all(report.closed for report in reports)
    return int(bool(broken) or unclosed or not all(report.intact for report in reports))


def _verified(path: Path, expected_head: str, key: str) -> Report:
    try:
        return verify(path, expected_head=expected_head, public_key=key)
    except OSError as error:
        raise UserError(f"{path} cannot be read: {error.strerror}") from None


def lines(report: Report) -> list[str]:
    """A report in words."""
    counts = f"{report.messages} messages, {report.chained} chain records"
    if report.first_bad == UNSEALED:
        return [f"{report.file}: NOTHING VERIFIES: {report.size} bytes and no chain record"]
    if report.first_bad is not None:
        return [f"{report.file}: NOT AS WRITTEN: {report.first_bad}", f"  before that: {counts} verify"]
    if report.expected_head_missing:
        return [f"{report.file}: TAIL LOST: {counts} verify, but the expected head is not among theirs"]
    state = "verified" if report.closed else "UNCLOSED, verified as far as it goes"
    found = [f"{report.file}: {state}: {counts}", f"  head {report.head}, signed by key {report.key_id or '(none)'}"]
    if report.tail_bytes:
        found.append(f"  {report.tail_bytes} bytes behind the last chain record are a flush that was cut")
    return found


def broken_links(reports: Sequence[Report]) -> list[str]:
    """Where a file does not go on from the one before it."""
    broken = []
    for before, after in itertools.pairwise(reports):
        start = after.origin.previous_head if after.origin else chain.ZERO
        if start != before.head:
            broken.append(
                f"{after.file} does not go on from the head of {before.file}: files or a tail are missing between"
            )
    return broken


def gone_files(names: Sequence[str], memory: str | None = None) -> list[str]:
    """The logs that memory keeps a head of and that are not in their folder any more; of the folders that were named."""
    there = {path.name for path in log_folder.named(names)}
    folders = dict.fromkeys(path.parent for one in names if Path(one).is_dir() for path in log_folder.named([one]))
    return [
        f"{folder / name} is gone: memory keeps a head of it"
        for folder in folders
        for name in sorted(_ask_memory(folder, memory, kept_files, frozenset[str]()) - there)
        if not (folder / name).exists()  # else it began just now
    ]


def _public_key(given: str | None) -> str:
    """The key as hex, from itself or from a file; empty where none was given."""
    if given is None:
        return ""
    key = given if _HEX.fullmatch(given) else _file_text(Path(given))
    if not _HEX.fullmatch(key):
        raise UserError(f"--key takes 64 hex digits or a file with them, such as secrets/{signing.PUBLIC_NAME}")
    return key.lower()


def _file_text(path: Path) -> str:
    """What stands in a file; empty where it is none, or no text."""
    try:
        return path.read_text(encoding="ascii").strip() if path.is_file() else ""
    except ValueError:
        return ""
    except OSError as error:
        raise UserError(f"{path} cannot be read: {error.strerror}") from None


def _head(given: str | None) -> str:
    """The head as the log writes it; empty where none was given."""
    if given is not None and not _HEX.fullmatch(given):
        raise UserError("--expect-head takes the 64 hex digits of a head")
    return (given or "").lower()


def _kept_head(path: Path, memory: str | None) -> str:
    """The newest head that memory keeps of a file; empty where there is no memory."""
    return _ask_memory(path.resolve().parent, memory, lambda database: kept_head(database, path.name), "")


def _ask_memory(folder: Path, memory: str | None, question: Callable[[Path], T], otherwise: T) -> T:
    """What the memory that was named, or that lies beside a folder of logs, answers. Raises UserError for one that was named."""
    database = Path(memory) if memory else folder.resolve().parent / "memory.sqlite"
    if not database.is_file():
        if memory:
            raise UserError(f"no such file: {memory}")
        return otherwise
    try:
        return question(database)
    except sqlite3.Error as error:
        if memory:
            raise UserError(f"{database} cannot be read: {error}") from None
        return otherwise
