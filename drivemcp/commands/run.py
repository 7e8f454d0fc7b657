"""`drivemcp run SERVICE`: one service as a process."""

import argparse

from drivemcp.commands import Subparsers
from drivemcp.registry import load_service, service_rows
from drivemcp.service import run as run_service


def register(subparsers: Subparsers) -> None:
    """Add the command."""
    parser = subparsers.add_parser(
        "run", help="run one service", description=f"Services: {', '.join(service_rows())}", add_help=True
    )
    parser.add_argument("service", metavar="SERVICE")
    parser.add_argument(
        "rest", nargs=argparse.REMAINDER, metavar="...", help="the service's own flags; see: run SERVICE --help"
    )
    parser.set_defaults(run=command)


def command(flags: argparse.Namespace) -> int:
    """Load the service and live until it is ended."""
    return run_service(load_service(flags.service), flags.rest)
