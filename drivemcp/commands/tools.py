"""`drivemcp tools list|call|new`: what the running stack offers, one call, and a new expert of one's own."""

import argparse
import sys
from pathlib import Path

import msgspec

from drivemcp.client import join
from drivemcp.commands import Subparsers
from drivemcp.commands.scaffold import write_expert
from drivemcp.errors import UserError
from drivemcp.numbers import number
from drivemcp.tools.client import LOCKSTEP_BOUND_MS


def register(subparsers: Subparsers) -> None:
    """Add the command."""
    parser = subparsers.add_parser("tools", help="list the running tools, call one, or begin a new one")
    actions = parser.add_subparsers(metavar="list|call|new", required=True)
    listing = actions.add_parser("list", help="every tool on the bus")
    listing.add_argument("--json", action="store_true", help="the catalogue entries as JSON")
    listing.set_defaults(run=list_tools)
    call = actions.add_parser("call", help="call one tool and print its result")
    call.add_argument("tool")
    call.add_argument("arguments", nargs="?", default="{}", help="JSON object, for example '{\"duration_s\": 1}'")
    call.add_argument("--deadline-ms", type=number(1.0, LOCKSTEP_BOUND_MS), default=5000.0)
    call.set_defaults(run=call_tool)
    for sub in (listing, call):
        sub.add_argument("--connect", metavar="ENDPOINT")
        sub.add_argument("--vehicle", metavar="NAME")
    new = actions.add_parser("new", help="write a working expert with its test")
    new.add_argument("name", help="lower-case name, for example roadworks")
    new.add_argument("--into", default=".", metavar="FOLDER")
    new.set_defaults(run=new_tool)


def list_tools(flags: argparse.Namespace) -> int:
    """Print the catalogue."""
    with join(flags.connect, flags.vehicle) as node:
        entries = sorted(node.client.discover().values(), key=lambda entry: (entry.meta.server, entry.name))
    if flags.json:
        sys.stdout.write(msgspec.json.encode(entries).decode() + "\n")
        return 0
    for entry in entries:
        summary = _first_sentence(entry.description)
        sys.stdout.write(f"{entry.meta.server:13} {entry.name:24} {entry.meta.capability:11} {summary}\n")
    if not entries:
        sys.stderr.write("no tools on the bus\n")
    return 0 if entries else 1


def _first_sentence(text: str) -> str:
    paragraph = " ".join(text.split("\n\n")[0].split())
    return paragraph.partition(". ")[0].rstrip(".") + "."


def call_tool(flags: argparse.Namespace) -> int:
    """Call one tool."""
    try:
        arguments = msgspec.json.decode(flags.arguments, type=dict)
    except msgspec.MsgspecError as error:
        raise UserError(f"the arguments are no JSON object: {error}") from None
    with join(flags.connect, flags.vehicle) as node:
        known = node.client.discover()
        if flags.tool not in known:
            raise UserError(f"no tool {flags.tool!r} on the bus; see: drivemcp tools list")
        outcome = node.call(flags.tool, arguments, deadline_ms=flags.deadline_ms)
    if not outcome.ok:
        sys.stderr.write(f"{outcome.status}: {outcome.error}\n")
        return 1
    sys.stdout.write(msgspec.json.format(msgspec.json.encode(outcome.result)).decode() + "\n")
    return 0


def new_tool(flags: argparse.Namespace) -> int:
    """Write a new expert's folder."""
    folder = write_expert(flags.name, Path(flags.into))
    sys.stdout.write(
        f"{folder} is written. Try it:\n"
        f"  pip install -e {folder}\n"
        f"  pytest {folder}/tests\n"
        f"  drivemcp up --with {flags.name}\n"
        "How it joins routing and fusion: docs/tutorial/your-first-tool.md\n"
    )
    return 0
