"""`drivemcp ask "…"`: a driver's question to the running stack."""

import argparse
import sys
from typing import get_args

import msgspec

from drivemcp.client import join
from drivemcp.commands import Subparsers
from drivemcp.errors import UserError
from proto.decision import Language


def register(subparsers: Subparsers) -> None:
    """Add the command."""
    parser = subparsers.add_parser("ask", help="ask the running assistant a question")
    parser.add_argument("question")
    parser.add_argument("--connect", metavar="ENDPOINT")
    parser.add_argument("--vehicle", metavar="NAME")
    parser.add_argument("--language", choices=get_args(Language), help="of the answer (default: the driver's)")
    parser.add_argument("--json", action="store_true", help="the whole answer as JSON")
    parser.set_defaults(run=command)


def command(flags: argparse.Namespace) -> int:
    """Ask, and print the answer with its citations."""
    with join(flags.connect, flags.vehicle) as node:
        node.client.discover()
        outcome = node.call("ask", {"question": flags.question, "language": flags.language}, deadline_ms=5000)
    if not outcome.ok or outcome.result is None:
        raise UserError(f"no answer: {outcome.status} ({outcome.error})")
    if flags.json:
        sys.stdout.write(msgspec.json.encode(outcome.result).decode() + "\n")
        return 0
    sys.stdout.write(str(outcome.result["text"]) + "\n")
    for citation in outcome.result.get("citations", ()):
        sys.stdout.write(f"  [{citation['section']}] {citation['document']} {citation['start']}-{citation['end']}\n")
    return 0
