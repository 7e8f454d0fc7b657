"""`drivemcp mcp`: the running stack as an MCP server over stdio, for clients that start their servers themselves."""

import argparse
from pathlib import Path

from drivemcp.client import join, read_stack
from drivemcp.commands import Subparsers
from drivemcp.node import Node


def register(subparsers: Subparsers) -> None:
    """Add the command."""
    parser = subparsers.add_parser("mcp", help="speak MCP over stdio for the running stack")
    parser.add_argument("--connect", metavar="ENDPOINT")
    parser.add_argument("--vehicle", metavar="NAME")
    parser.add_argument(
        "--tools",
        metavar="GROUP,...",
        default="",
        help="offer a part: rules, weather, can, scene, decisions, memory, scenario",
    )
    parser.add_argument(
        "--grant", metavar="FILE", default="", help="grant for one actuation tool, used after a person's yes"
    )
    parser.set_defaults(run=command)


def command(flags: argparse.Namespace) -> int:
    """Serve until standard input ends."""
    import anyio  # here, as every `drivemcp` command loads this module, and the SDK takes longer than all the rest

    from services.gateway.tool_list import checked_groups

    with join(flags.connect, flags.vehicle, name="gateway-stdio") as node:
        node.watch_services()
        servers = {entry.meta.server for entry in node.client.discover().values()}
        groups = checked_groups((name for name in flags.tools.split(",") if name), servers)
        anyio.run(_serve, node, _drives(flags.connect), groups, flags.grant)
    return 0


def _drives(connect: str | None) -> Path | None:
    """Where the running stack keeps its drives; None: it runs elsewhere."""
    stack = read_stack()
    here = stack is not None and connect in (None, stack.endpoint)
    return Path(stack.folder).parent if stack is not None and here else None


async def _serve(node: Node, drives: Path | None, groups: frozenset[str], grant_file: str) -> None:
    from mcp.server.stdio import stdio_server

    from services.gateway.changes import Changes
    from services.gateway.drives import Drives
    from services.gateway.permitting import Gate
    from services.gateway.server import make_server

    server = make_server(node, Changes(), Drives(drives), groups=groups, gate=Gate(grant_file=grant_file))
    async with stdio_server() as (read, write):
        await server.run(read, write, server.create_initialization_options())
