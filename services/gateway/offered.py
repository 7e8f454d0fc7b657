"""Which tools of the bus a client is offered: those that any caller may call, of services that have not left."""

from drivemcp.node import Node
from proto.tools import ToolEntry


def callable_tools(node: Node) -> dict[str, ToolEntry]:
    """The catalogue without what only services may call."""
    return {name: entry for name, entry in node.catalogue().items() if not entry.meta.callers}


class Offered:
    """Follows which services came and went; `look` is called on one thread, `tools` on any."""

    def __init__(self, node: Node) -> None:
        self._node = node
        self._came: frozenset[str] = frozenset()
        self._gone: frozenset[str] = frozenset()
        self._listed: frozenset[str] = frozenset()

    def tools(self) -> tuple[ToolEntry, ...]:
        """In the order of their names. A service that was never seen alive counts as there: its token may be on its way."""
        gone, found = self._gone, callable_tools(self._node)
        return tuple(found[name] for name in sorted(found) if found[name].meta.server not in gone)

    def look(self) -> bool:
        """Whether the list is another one than at the last look."""
        alive = frozenset(self._node.alive_services())
        self._came |= alive
        self._gone = self._came - alive
        listed = frozenset(entry.name for entry in self.tools())
        changed, self._listed = listed != self._listed, listed
        return changed
