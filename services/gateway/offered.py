"""Which tools of the bus a client is offered: those that any caller may call, of services that have not left."""

from drivemcp.node import Node
from proto.tools import ToolEntry
from services.gateway.tool_list import offered


def callable_tools(node: Node, groups: frozenset[str] = frozenset()) -> dict[str, ToolEntry]:
    """The catalogue without what only services may call; of groups, where any are named, theirs."""
    return offered(node.catalogue(), groups)


class Offered:
    """Follows which services came and went; `look` is called on one thread, `tools` on any."""

    def __init__(self, node: Node, groups: frozenset[str] = frozenset()) -> None:
        self._node, self._groups = node, groups
        self._came: frozenset[str] = frozenset()
        self._gone: frozenset[str] = frozenset()
        self._listed: frozenset[str] = frozenset()

    def tools(self) -> tuple[ToolEntry, ...]:
        """In the order of their names. A service that was never seen alive counts as there: its token may be on its way."""
        gone, found = self._gone, callable_tools(self._node, self._groups)
        return tuple(found[name] for name in sorted(found) if found[name].meta.server not in gone)

    def look(self) -> bool:
        """Whether the list is another one than at the last look."""
        alive = frozenset(self._node.alive_services())
        self._came |= alive
        self._gone = self._came - alive
        listed = frozenset(entry.name for entry in self.tools())
        changed, self._listed = listed != self._listed, listed
        return changed
