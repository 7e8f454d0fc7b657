"""The folder of logs: names, the head to go on from, retention."""

import mmap
import time
from collections.abc import Callable, Iterable
from pathlib import Path

import msgspec

from drivemcp.errors import UserError
from services.logger.format import chain
from services.logger.format.signing import Signer, signature_holds

SUFFIX = ".mcap"


class Previous(msgspec.Struct, frozen=True, kw_only=True):
    """Where the next file's chain goes on from."""

    file: str = ""
    head: str = chain.ZERO


class Retention(msgspec.Struct, frozen=True, kw_only=True):
    """How much is kept. 0: no bound."""

    max_total_mb: float = 0.0
    max_age_days: float = 0.0


def logs(directory: Path) -> list[Path]:
    """The log files, oldest first; names begin with the time, so their order is theirs."""
    return sorted(directory.glob(f"*{SUFFIX}"))


def named(names: Iterable[str]) -> list[Path]:
    """The files that a command was given; a folder stands for the logs in it, oldest first.

    The folder of a drive stands for its `logs`. Raises UserError.
    """
    found: list[Path] = []
    for one in map(Path, names):
        if not one.exists():
            raise UserError(f"no such file: {one}")
        inside = logs(one) or logs(one / "logs") if one.is_dir() else [one]
        if not inside:
            raise UserError(f"no logs (*{SUFFIX}) in {one}")
        found += inside
    return found


def name(started_ns: int, index: int) -> str:
    """The name of a drive's `index`-th file."""
    stamp = time.strftime("%Y%m%dT%H%M%S", time.gmtime(started_ns // 1_000_000_000))
    return f"{stamp}.{started_ns // 1_000_000 % 1000:03d}Z-{index:03d}{SUFFIX}"


def previous(directory: Path, signer: Signer) -> Previous:
    """The newest file with a chain record signed by this key, and its last head. Raises OSError."""
    for path in reversed(logs(directory)):
        head = last_head(path, signer.public_hex)
        if head:
            return Previous(file=path.name, head=head)
    return Previous()


def last_head(path: Path, public_key: str) -> str:
    """The last head in a file, found from its end and accepted by its signature only; empty without one."""
    if path.stat().st_size == 0:
        return ""
    with path.open("rb") as file, mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ) as mapped:
        end = len(mapped)
        while (start := mapped.rfind(b'{"body":{"n":', 0, end)) >= 0:
            closing = mapped.find(b'"}', mapped.find(b'"signature":"', start, len(mapped)), len(mapped))
            head = _signed_head(mapped[start : closing + 2], public_key) if closing > 0 else ""
            if head:
                return head
            end = start
    return ""


def _signed_head(stored: bytes, public_key: str) -> str:
    try:
        record, _ = chain.decode(stored)
    except ValueError:
        return ""
    holds = signature_holds(public_key, chain.signed_text(record.head), record.signature)
    return record.head if holds else ""


def retire(directory: Path, keep: Retention, *, now_s: float, spare: str, going: Callable[[Path], None]) -> None:
    """Deletes the oldest files beyond what is to be kept, never `spare`; tells of each before. Raises OSError."""
    found = [path for path in logs(directory) if path.name != spare]
    total = sum(path.stat().st_size for path in logs(directory))
    for path in found:
        status = path.stat()
        old = keep.max_age_days > 0 and now_s - status.st_mtime > keep.max_age_days * 86400
        if not old and not (keep.max_total_mb > 0 and total > keep.max_total_mb * 1e6):
            continue
        total -= status.st_size
        going(path)  # before: a file that memory knows and that is not there counts as taken away
        path.unlink()
