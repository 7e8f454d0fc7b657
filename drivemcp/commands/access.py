"""`drivemcp access FOLDER`: access control and credentials for a router, made at set-up and never committed."""

import argparse
import os
import sys
from pathlib import Path

import msgspec

from drivemcp.access import access_control, dictionary, make_credentials
from drivemcp.errors import UserError
from drivemcp.registry import service_rows


def register(subparsers: "argparse._SubParsersAction[argparse.ArgumentParser]") -> None:
    """Add the command."""
    parser = subparsers.add_parser("access", help="make a router's access control and every service's credentials")
    parser.add_argument("folder", help="where to write access.json, users.txt and one password file per service")
    parser.add_argument("--vehicle", default="*", help="name of the vehicle; any by default")
    parser.add_argument("--evaluation", action="store_true", help="a user that may read the simulator's truth, too")
    parser.add_argument("--owner", type=int, default=None, metavar="UID", help="user id that shall own the files")
    parser.set_defaults(run=command)


def command(flags: argparse.Namespace) -> int:
    """Write the files; existing credentials are kept, so that running services stay in."""
    folder = Path(flags.folder)
    rows = list(service_rows().values())
    try:
        write_access(folder, flags.vehicle, evaluation=flags.evaluation, owner=flags.owner)
    except OSError as error:
        raise UserError(f"cannot write {folder}: {error.strerror}") from None
    sys.stdout.write(f"access control for {len(rows)} services in {folder}\n")
    return 0


def write_access(folder: Path, vehicle: str = "*", *, evaluation: bool = False, owner: int | None = None) -> None:
    """`access.json`, `users.txt`, and `<service>.password` for each service, readable by their owner alone."""
    rows = list(service_rows().values())
    folder.mkdir(parents=True, exist_ok=True, mode=0o700)
    credentials = make_credentials(rows, evaluation=evaluation)
    for name in credentials:
        file = folder / f"{name}.password"
        if file.exists():
            credentials[name] = file.read_text(encoding="ascii").strip()
        else:
            _write(file, credentials[name] + "\n", owner)
    _write(folder / "users.txt", dictionary(credentials), owner)
    rules = access_control(rows, vehicle, evaluation=evaluation)
    _write(folder / "access.json", msgspec.json.format(msgspec.json.encode(rules)).decode(), owner)
    if owner is not None:
        os.chown(folder, owner, owner)


def _write(path: Path, text: str, owner: int | None) -> None:
    descriptor = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_TRUNC, 0o600)
    with os.fdopen(descriptor, "w", encoding="ascii") as file:
        file.write(text)
    if owner is not None:
        os.chown(path, owner, owner)
