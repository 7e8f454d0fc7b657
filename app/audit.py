"""`drivemcp audit verify FILE...`: whether logs are as they were written, and by whose key."""

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
from drivemcp.paths import own_state
from services.logger.format import chain, signing, time_stamp
from services.logger.memory import KeptHead, kept_files, kept_head
from services.logger.verification import trust
from services.logger.verification.report import UNSEALED, Report
from services.logger.verification.verifier import verify
from services.logger.writing import anchor, log_folder

T = TypeVar("T")
_HEX = re.compile(r"[0-9a-fA-F]{64}")
"""A public key, or a head."""
TSA_ROOTS = "trusted-tsa-roots.pem"


def register(subparsers: Subparsers) -> None:
    """Add `drivemcp audit`."""
    parser = subparsers.add_parser("audit", help="check that a log is as it was written, and by whose key")
    kinds = parser.add_subparsers(metavar="COMMAND", required=True)
    check = kinds.add_parser(
        "verify",
        help="verify log files; names the first changed, dropped, inserted or reordered record, and whose key signed",
        description="Several files are also checked to continue each other, in the order given; "
        "of a folder also that no file is gone that the drive's memory knows. "
        "Exit status: 0 all as written by a known key (an unclosed file: as far as it goes, and said so), 1 not as written, "
        "or nothing verifies, 2 cannot be read, 3 as written, by an unknown key, "
        "4 as written, by another key than the trust file names for that vehicle, "
        "5 a genuine time stamp is of a head that the log does not have.",
    )
    check.add_argument("files", metavar="FILE", nargs="+", help="a log, a folder of logs, or a drive's folder")
    check.add_argument("--expect-head", metavar="HEX", help="a head that the last file must reach")
    check.add_argument(
        "--key", metavar="HEX|FILE", help="the public key that must have signed; no trust file is asked then"
    )
    _add_trust(check)
    check.add_argument(
        "--anchors", metavar="FILE", help="heads that the logger appended elsewhere (anchor_file): each must be there"
    )
    check.add_argument(
        "--memory", metavar="FILE", help="the drive's memory.sqlite, whose signed heads settle a lost tail; "
        "found by itself where it lies beside the folder of logs",
    )  # fmt: skip
    check.add_argument(
        "--tsa-root", metavar="FILE", help="root certificates (PEM) of the authorities whose time stamps count; "
        f"drivemcp/{TSA_ROOTS} in your state folder otherwise",
    )  # fmt: skip
    check.add_argument(
        "--stamped", action="store_true", help="a log whose last head has no such stamp is not good enough"
    )
    check.add_argument("--closed", action="store_true", help="an unclosed file is not good enough")
    check.add_argument("--json", action="store_true")
    check.set_defaults(run=_verify)
    trusting = kinds.add_parser("trust", help="add a logger's public key to the trust file")
    trusting.add_argument("key", metavar="HEX|FILE", help=f"64 hex digits, or a file with them ({signing.PUBLIC_NAME})")
    trusting.add_argument("--vehicle", default=trust.ANY, metavar="NAME", help="for logs of this vehicle alone")
    trusting.add_argument("--note", default="", help="a few words for the reader of the file")
    _add_trust(trusting)
    trusting.set_defaults(run=_trust)


def _add_trust(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--trust", metavar="FILE", help="the trust file; drivemcp/trusted-log-keys in your state folder otherwise"
    )


def _verify(flags: argparse.Namespace) -> int:
    key, last_head = _public_key(flags.key), _head(flags.expect_head)
    trusted, anchors = () if key else _trusted(flags.trust), _anchored(flags.anchors)
    roots = _roots(flags.tsa_root)
    reports, stamps, kept = list[Report](), list[tuple[time_stamp.Stamp, ...]](), list[KeptHead]()
    paths = log_folder.named(flags.files)
    for path in paths:
        known = known_head(path, flags.memory)
        expected = (last_head if path == paths[-1] else "") or known.head
        heads = anchors.heads.get(path.name, frozenset())
        tokens = _tokens(path)
        sought = frozenset(map(time_stamp.imprint_of, tokens.values()))
        report = _verified(path, expected, key, heads, sought)
        reports.append(report)
        kept.append(known)
        stamps.append(tuple(time_stamp.judge(name, token, report.stamped, roots) for name, token in tokens.items()))
    signers = [_signed_by(report, key, trusted) for report in reports]
    broken = [
        *broken_links(reports),
        *gone_files(flags.files, flags.memory),
        *_gone_anchored(flags.files, anchors, reports),
    ]
    if flags.json:
        told = {"files": reports, "signers": signers, "stamps": stamps, "continuity": broken}
        sys.stdout.write(msgspec.json.encode(told).decode() + "\n")
    else:
        told_lines = [
            line
            for path, report, signer, stamped, known in zip(paths, reports, signers, stamps, kept, strict=True)
            for line in (*lines(report, signer, known), *stamp_lines(path, report, stamped))
        ]
        sys.stdout.write("\n".join([*told_lines, *broken]) + "\n")
    unclosed = flags.closed and not all(report.closed for report in reports)
    unstamped = flags.stamped and not all(map(_is_stamped, reports, stamps))
    if broken or unclosed or unstamped or not all(report.intact for report in reports):
        return 1
    if any(stamp.contradicts for stamped in stamps for stamp in stamped):
        return CONTRADICTED
    return max(STATUS[signer.standing] for signer in signers)


CONTRADICTED = 5
STATUS: dict[trust.Standing, int] = {"known": 0, "unknown": 3, "changed since": 4}


def _trust(flags: argparse.Namespace) -> int:
    path, key = _trust_file(flags.trust), _public_key(flags.key, "HEX|FILE")
    try:
        trust.add(path, trust.Trusted(public_key=key, vehicle=flags.vehicle, note=flags.note))
    except ValueError as error:
        raise UserError(f"--vehicle: {error}") from None
    except OSError as error:
        raise UserError(f"{path} cannot be written: {error.strerror}") from None
    sys.stdout.write(f"{path}: key {signing.key_id(key)} is trusted for {flags.vehicle}\n")
    return 0


def _trust_file(given: str | None) -> Path:
    return Path(given) if given else trust.own_file()


def _trusted(given: str | None) -> tuple[trust.Trusted, ...]:
    """The lines of the trust file; none where this user has none yet. Raises UserError for one that was named."""
    path = _trust_file(given)
    if not given and not path.exists():
        return ()
    try:
        return trust.read(path)
    except OSError as error:
        raise UserError(f"{path} cannot be read: {error.strerror}") from None
    except ValueError as error:
        raise UserError(f"{path} is no trust file: {error}") from None


def _signed_by(report: Report, key: str, trusted: Sequence[trust.Trusted]) -> trust.Judgement:
    """Whose key signed a log; one that fits `--key` is known."""
    if key or report.origin is None:
        return trust.Judgement(standing="known" if key else "unknown")
    return trust.judge(trusted, report.origin.vehicle, report.origin.public_key)


def _anchored(given: str | None) -> anchor.Anchored:
    if given is None:
        return anchor.Anchored(heads={}, retirements=())
    try:
        return anchor.read(Path(given))
    except OSError as error:
        raise UserError(f"{given} cannot be read: {error.strerror}") from None
    except ValueError as error:
        raise UserError(f"{given} is no file of anchored heads: {error}") from None


def _gone_anchored(names: Sequence[str], anchors: anchor.Anchored, reports: Sequence[Report]) -> list[str]:
    """The logs that anchored heads speak of and that are not among those of a folder that was named."""
    if not any(Path(one).is_dir() for one in names):
        return []
    there = {Path(report.file).name for report in reports}
    keys = [report.origin.public_key for report in reports if report.origin]
    return [
        f"{name} is gone: a head of it is anchored"
        for name in sorted(anchors.heads.keys() - there)
        if not anchors.is_retired(name, keys)
    ]


def _roots(given: str | None) -> bytes:
    """The root certificates; none where this user has none. Raises UserError for a file that holds none."""
    path = Path(given) if given else own_state(TSA_ROOTS)
    if not given and not path.exists():
        return b""
    try:
        return time_stamp.checked_roots(path.read_bytes())
    except OSError as error:
        raise UserError(f"{path} cannot be read: {error.strerror}") from None
    except ValueError:
        raise UserError(f"{path} holds no certificates in PEM") from None


def _tokens(log: Path) -> dict[str, bytes]:
    """The time stamps beside a log, by name."""
    found = {}
    for path in time_stamp.beside(log):
        try:
            found[path.name] = path.read_bytes()
        except OSError as error:
            raise UserError(f"{path} cannot be read: {error.strerror}") from None
    return found


def _is_stamped(report: Report, stamps: Sequence[time_stamp.Stamp]) -> bool:
    return any(not stamp.problem and stamp.messages == report.messages for stamp in stamps)


def stamp_lines(path: Path, report: Report, stamps: Sequence[time_stamp.Stamp]) -> list[str]:
    """What time stamps say of a log, in words."""
    found = [] if _is_stamped(report, stamps) or not (why := time_stamp.refused(path)) else [f"  its head: {why}"]
    for stamp in stamps:
        whole = stamp.messages == report.messages
        what = "head" if whole else f"the first {stamp.messages} messages"
        found.append(f"  time stamp {stamp}" if stamp.problem else f"  {what} stamped at {stamp}")
    return found


def _verified(path: Path, expected_head: str, key: str, anchored: frozenset[str], sought: frozenset[str]) -> Report:
    try:
        return verify(path, expected_head=expected_head, public_key=key, anchored=anchored, sought=sought)
    except OSError as error:
        raise UserError(f"{path} cannot be read: {error.strerror}") from None


def checked_lines(paths: Sequence[Path]) -> tuple[bool, list[str]]:
    """Whether a drive's logs are as they were written, and what is to be said of each, by this user's trust file."""
    known = [known_head(path) for path in paths]
    reports = [
        _verified(path, head.head, "", frozenset(), frozenset()) for path, head in zip(paths, known, strict=True)
    ]
    trusted = _trusted(None)
    signers = [_signed_by(report, "", trusted) for report in reports]
    broken = [*broken_links(reports), *gone_files([str(path) for path in paths])]
    told = [line for row in zip(reports, signers, known, strict=True) for line in lines(*row)]
    return not broken and all(report.intact for report in reports), [*told, *broken]


def is_rewritten(report: Report, known: KeptHead) -> bool:
    """Whether a log verifies by another key than memory knows it by, without the head that memory knows."""
    return report.expected_head_missing and bool(known.key_id and report.key_id) and known.key_id != report.key_id


def lines(report: Report, signer: trust.Judgement, known: KeptHead) -> list[str]:
    """A report in words."""
    counts = f"{report.messages} messages, {report.chained} chain records"
    if report.first_bad == UNSEALED:
        return [f"{report.file}: NOTHING VERIFIES: {report.size} bytes and no chain record"]
    if report.first_bad is not None:
        return [f"{report.file}: NOT AS WRITTEN: {report.first_bad}", f"  before that: {counts} verify"]
    if is_rewritten(report, known):
        return [
            f"{report.file}: REWRITTEN: {counts} verify by key {report.key_id}, but memory knows this log by key {known.key_id}"
        ]
    if report.expected_head_missing:
        return [f"{report.file}: TAIL LOST: {counts} verify, but the expected head is not among theirs"]
    state = "verified" if report.closed else "UNCLOSED, verified as far as it goes"
    found = [
        f"{report.file}: {state}: {counts}",
        f"  head {report.head}, signed by key {report.key_id or '(none)'}: {signer}",
    ]
    if report.lost:
        found.append(f"  {report.lost} messages never came into it: {report.lost_why}")
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


def _public_key(given: str | None, argument: str = "--key") -> str:
    """The key as hex, from itself or from a file; empty where none was given."""
    if given is None:
        return ""
    key = given if _HEX.fullmatch(given) else _file_text(Path(given))
    if not _HEX.fullmatch(key):
        raise UserError(f"{argument} takes 64 hex digits or a file with them, such as {signing.PUBLIC_NAME}")
    return key.lower()


def _file_text(path: Path) -> str:
    """The text of a file; empty where the path is not a file, or the content is not ASCII text."""
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


def known_head(path: Path, memory: str | None = None) -> KeptHead:
    """The newest head that memory keeps of a file: the memory that was named, or the one beside the folder of logs."""
    return _ask_memory(path.resolve().parent, memory, lambda database: kept_head(database, path.name), KeptHead())


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
