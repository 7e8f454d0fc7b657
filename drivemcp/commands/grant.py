"""`drivemcp grant`: permission to actuate, made out of band, signed, bounded and short-lived."""

import argparse
import os
import secrets
import sys
from contextlib import suppress
from datetime import UTC, datetime, timedelta
from pathlib import Path

import msgspec

from drivemcp.commands import Subparsers
from drivemcp.errors import UserError
from drivemcp.numbers import number
from proto.decision import Envelope, Grant
from proto.topics import BRAKE

BOUNDS: dict[Envelope, tuple[float, float]] = {"soft": (4.0, 2.0), "emergency": (6.5, 20.0)}
"""Deceleration (m/s2) and duration (s) that a grant names unless told otherwise."""


def register(subparsers: Subparsers) -> None:
    """Add the command."""
    parser = subparsers.add_parser(
        "grant",
        help="make a signing key, or sign a grant to brake",
        description="First: drivemcp grant --make-key KEYFILE. Then: drivemcp grant --key KEYFILE --vehicle NAME --out GRANT. "
        "A stack brakes only with: drivemcp up --vehicle NAME --grant GRANT --trust PUBLICKEY",
    )
    parser.add_argument(
        "--make-key", metavar="FILE", help="write a new private key (mode 600) and print the public one"
    )
    parser.add_argument("--key", metavar="FILE", help="private key to sign with")
    parser.add_argument("--vehicle", default="ego")
    parser.add_argument(
        "--capability", default=BRAKE.name, help="`actuation/brake`, or `tool:NAME` for one actuation tool"
    )
    parser.add_argument(
        "--envelope",
        choices=tuple(BOUNDS),
        default="soft",
        help="soft: bounded and short; emergency: harder, to standstill and held there, where nothing else avoids an impact",
    )
    parser.add_argument("--max-deceleration", type=float, metavar="M_PER_S2", help="4 soft, 6.5 in an emergency")
    parser.add_argument(
        "--max-duration",
        type=float,
        metavar="S",
        help="of braking within a window of so long and 5 s: 2 soft, 20 in an emergency",
    )
    parser.add_argument("--valid", type=number(0.01, 24.0), default=8.0, metavar="HOURS", help="at most 24")
    parser.add_argument("--out", metavar="FILE", help="where the grant goes; standard output otherwise")
    parser.set_defaults(run=command)


def command(flags: argparse.Namespace) -> int:
    """Make a key or a grant."""
    from drivemcp.runtime.grants import make_key, sign_grant

    if flags.make_key:
        pair = make_key()
        _write_private(Path(flags.make_key), pair.private)
        sys.stdout.write(pair.public + "\n")
        return 0
    if not flags.key:
        raise UserError("a grant is signed: --key FILE (make one with --make-key FILE)")
    if flags.capability != BRAKE.name and not flags.capability.startswith("tool:"):
        raise UserError(f"a grant is for {BRAKE.name} or for tool:NAME, not for {flags.capability!r}")
    now = datetime.now(UTC)
    deceleration, duration = BOUNDS[flags.envelope]
    grant = Grant(
        grant_id=secrets.token_hex(8),
        vehicle=flags.vehicle,
        capability=flags.capability,
        max_deceleration_mps2=deceleration if flags.max_deceleration is None else flags.max_deceleration,
        max_duration_s=duration if flags.max_duration is None else flags.max_duration,
        envelope=flags.envelope,
        issued_at=now.isoformat(timespec="seconds"),
        expires_at=(now + timedelta(hours=flags.valid)).isoformat(timespec="seconds"),
        sequence=_next_sequence(Path(flags.key), int(now.timestamp() * 1000)),
    )
    try:
        private = Path(flags.key).read_text(encoding="ascii").strip()
    except OSError as error:
        raise UserError(f"cannot read the key {flags.key}: {error.strerror}") from None
    except UnicodeDecodeError:
        raise UserError(f"{flags.key} is no key: it is not text") from None
    text = msgspec.json.format(msgspec.json.encode(sign_grant(grant, private))).decode() + "\n"
    if flags.out:
        try:
            Path(flags.out).write_text(text, encoding="utf-8")
        except OSError as error:
            raise UserError(f"cannot write {flags.out}: {error.strerror}") from None
    else:
        sys.stdout.write(text)
    return 0


def _next_sequence(key: Path, now_ms: int) -> int:
    """Above every one before, whatever the clock says: the time in ms, or one more than what is kept beside the key."""
    kept = key.with_name(f"{key.name}.sequence")
    try:
        last = int(kept.read_text(encoding="ascii"))
    except (OSError, ValueError):
        last = 0
    following = max(now_ms, last + 1)
    with suppress(OSError):  # a key on a medium that takes no writes: the time alone counts up
        kept.write_text(f"{following}\n", encoding="ascii")
    return following


def _write_private(path: Path, private: str) -> None:
    try:
        descriptor = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600)
    except FileExistsError:
        raise UserError(f"{path} exists; a key is never overwritten") from None
    except OSError as error:
        raise UserError(f"cannot write {path}: {error.strerror}") from None
    with os.fdopen(descriptor, "w", encoding="ascii") as file:
        file.write(private + "\n")
