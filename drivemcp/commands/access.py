"""`drivemcp access FOLDER`: access control, credentials and certificates for a router, made at set-up and never committed."""

import argparse
import secrets
import sys
from datetime import timedelta
from pathlib import Path

import msgspec

from drivemcp.bus.access import access_control, dictionary, make_credentials
from drivemcp.bus.tls import OWN
from drivemcp.commands import Subparsers
from drivemcp.errors import UserError
from drivemcp.files.modes import write_private
from drivemcp.numbers import number
from drivemcp.paths import own_state
from drivemcp.registry import service_rows


def register(subparsers: Subparsers) -> None:
    """Add the command."""
    parser = subparsers.add_parser(
        "access",
        help="make a router's access control, every service's credentials, and certificates for links between hosts",
    )
    parser.add_argument("folder", help="where to write router/access.json, router/users.txt and <service>/password")
    parser.add_argument("--vehicle", default="*", help="name of the vehicle; any by default")
    parser.add_argument("--evaluation", action="store_true", help="a user that may read the simulator's truth, too")
    parser.add_argument(
        "--token", action="store_true", help="tokens for gateway and cockpit, too: gateway/token, cockpit/token"
    )
    parser.add_argument(
        "--tls", action="append", default=[], metavar="NAME",
        help="certificates, too (<service>/tls.pem, ca.pem); NAME: host name or address at which the router is reached. "
        "Once made, they are renewed by each later run, from half their life on",
    )  # fmt: skip
    parser.add_argument(
        "--ca", default="", metavar="FOLDER", help="keys of the authority; in the user's state folder by default"
    )
    parser.add_argument("--days", type=number(1.0, 397.0), default=30.0, help="life of a new certificate (30)")
    parser.add_argument(
        "--renew", action="store_true", help="new certificates for all, whatever is left of the old ones"
    )
    parser.set_defaults(run=command)


def command(flags: argparse.Namespace) -> int:
    """Write the files; existing credentials are kept, so that running services stay in."""
    folder = Path(flags.folder)
    rows = list(service_rows().values())
    try:
        made = _certificates(flags, folder)
        write_access(folder, flags.vehicle, evaluation=flags.evaluation, certificates=bool(made))
        for token in (folder / service / "token" for service in ("gateway", "cockpit") if flags.token):
            if not token.exists():
                write_private(token, secrets.token_urlsafe(24) + "\n")
    except OSError as error:
        raise UserError(f"cannot write {folder}: {error.strerror}") from None
    sys.stdout.write(f"access control for {len(rows)} services in {folder}\n")
    sys.stdout.writelines(f"{line}\n" for line in made)
    return 0


def _certificates(flags: argparse.Namespace, folder: Path) -> list[str]:
    """Makes or renews them where there are to be any; a line for each."""
    if not flags.tls and not (folder / "router" / OWN).exists():
        if flags.renew:
            raise UserError(f"{folder} holds no certificates to renew; --tls NAME makes them")
        return []
    try:
        from drivemcp.bus.certificates import ROUTER, write_certificates
    except ImportError:
        raise UserError("certificates take cryptography: pip install 'drivemcp[access]'") from None
    members = [ROUTER, *make_credentials(service_rows().values(), evaluation=flags.evaluation)]
    made = write_certificates(
        folder, Path(flags.ca) if flags.ca else own_state("bus-authority"), members, tuple(flags.tls),
        life=timedelta(days=flags.days), renew=flags.renew,
    )  # fmt: skip
    return [
        f"{one.name}: certificate until {one.ends:%Y-%m-%d %H:%M} UTC{', new' if one.renewed else ''}" for one in made
    ]


def write_access(folder: Path, vehicle: str = "*", *, evaluation: bool = False, certificates: bool = False) -> None:
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
            write_private(file, credentials[name] + "\n")
    write_private(folder / "router" / "users.txt", dictionary(credentials))
    rules = access_control(rows, vehicle, evaluation=evaluation, certificates=certificates)
    write_private(folder / "router" / "access.json", msgspec.json.format(msgspec.json.encode(rules)).decode())
