"""`drivemcp access FOLDER`: access control and credentials for a router, made at set-up and never committed."""

import argparse
import os
import secrets
import sys
from pathlib import Path

import msgspec

from drivemcp.bus.access import access_control, dictionary, make_credentials
from drivemcp.commands import Subparsers
from drivemcp.errors import UserError
from drivemcp.registry import service_rows


def register(subparsers: Subparsers) -> None:
    """Add the command."""
    parser = subparsers.add_parser("access", help="make a router's access control and every service's credentials")
    parser.add_argument("folder", help="where to write router/access.json, router/users.txt and <service>/password")
    parser.add_argument("--vehicle", default="*", help="name of the vehicle; any by default")
    parser.add_argument("--evaluation", action="store_true", help="a user that may read the simulator's truth, too")
    parser.add_argument("--token", action="store_true", help="a token for the gateway, too: gateway/token")
    parser.set_defaults(run=command)


def command(flags: argparse.Namespace) -> int:
    """Write the files; existing credentials are kept, so that running services stay in."""
    folder = Path(flags.folder)
    rows = list(service_rows().values())
    try:
        write_access(folder, flags.vehicle, evaluation=flags.evaluation)
        if flags.token and not (folder / "gateway" / "token").exists():
            _write(folder / "gateway" / "token", secrets.token_urlsafe(24) + "\n")
    except OSError as error:
        raise UserError(f"cannot write {folder}: {error.strerror}") from None
    sys.stdout.write(f"access control for {len(rows)} services in {folder}\n")
    return 0


def write_access(folder: Path, vehicle: str = "*", *, evaluation: bool = False) -> None:
    """`router/access.json`, `router/users.txt` and `<service>/password`: a folder each, so that each can be mounted alone."""
    rows = list(service_rows().values())
    credentials = make_credentials(rows, evaluation=evaluation)
    for name in credentials:
        file = folder / name / "password"
        if file.exists():
            try:
                credentials[name] = file.read_text(encoding="ascii").strip()
            except UnicodeDecodeError:
                raise UserError(f"{file} holds no password of ours; delete it for a new one") from None
        else:
            _write(file, credentials[name] + "\n")
    _write(folder / "router" / "users.txt", dictionary(credentials))
    rules = access_control(rows, vehicle, evaluation=evaluation)
    _write(folder / "router" / "access.json", msgspec.json.format(msgspec.json.encode(rules)).decode())


def _write(path: Path, text: str) -> None:
    path.parent.mkdir(parents=True, exist_ok=True, mode=0o700)
    descriptor = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_TRUNC, 0o600)
    with os.fdopen(descriptor, "w", encoding="ascii") as file:
        file.write(text)
