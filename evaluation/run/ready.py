"""Catalogues come asynchronously: before the first step every service that asks must know the tools of all that were started."""

import time
from collections.abc import Iterable, Mapping, Sequence

from drivemcp.bus.session import wait_settled
from drivemcp.errors import DriveMcpError
from drivemcp.node import Node
from proto.services import BY_NAME

TOOLS_WITHIN_S = 60.0
"""Wall time for all catalogues to arrive, however loaded the machine is."""
_ASK_AGAIN_S = 1.0
"""A service asks each server once for its catalogue, and gives up after a second; by then we ask again on its behalf."""


class RunError(DriveMcpError):
    """A run that did not come to its end."""


def wait_for_tools(nodes: Sequence[Node], within_s: float = TOOLS_WITHIN_S) -> None:
    """Until every service that calls others knows their tools. Raises RunError naming those that it lacks."""
    until_s = time.monotonic() + within_s
    for asker in nodes:
        wanted = _wanted(asker, nodes)
        while _lacks(asker, wanted):
            left_s = until_s - time.monotonic()
            if left_s <= 0.0:
                raise RunError(_told(asker.name, wanted, _lacks(asker, wanted), within_s))
            if not wait_settled(lambda: not _lacks(asker, wanted), min(_ASK_AGAIN_S, left_s)):  # noqa: B023
                asker.client.discover(min(_ASK_AGAIN_S, max(0.0, until_s - time.monotonic())))


def _wanted(asker: Node, nodes: Iterable[Node]) -> Mapping[str, str]:
    """Tool -> its server, of all that the asker may call."""
    row = BY_NAME.get(asker.name)
    calls = row.calls if row is not None else ()
    servers = [node for node in nodes if node is not asker and ("*" in calls or node.name in calls)]
    return {tool.entry.name: node.name for node in servers for tool in node.tools.tools}


def _lacks(asker: Node, wanted: Mapping[str, str]) -> list[str]:
    return sorted(set(wanted) - set(asker.catalogue()))


def _told(asker: str, wanted: Mapping[str, str], lacks: Iterable[str], within_s: float) -> str:
    missing = ", ".join(f"{tool} of {wanted[tool]}" for tool in lacks)
    return f"{asker} does not know these tools after {within_s:g} s: {missing}; is the machine overloaded?"
