"""`tools/list` for a language model: the catalogue's entries, short enough to be read whole, or the part that was asked for."""

from collections.abc import Iterable, Mapping
from types import MappingProxyType
from typing import Any

from mcp import types

from drivemcp.choices import nearest
from drivemcp.errors import ConfigError
from proto.services import SERVICES
from proto.tools import ToolEntry

META = "drivemcp/tool"
GROUPS: Mapping[str, tuple[str, ...]] = MappingProxyType(
    {
        "rules": ("rules", "retrieval"),
        "weather": ("weather",),
        "can": ("can",),
        "scene": ("perception", "drivelm"),
        "decisions": ("arbiter", "orchestrator"),
        "memory": ("logger",),
        "scenario": ("simulator", "player"),
    }
)
"""The services whose tools a group holds. A service that no row names, an expert of one's own, is a group by its own name."""
_OURS = frozenset(row.name for row in SERVICES)


def checked_groups(names: Iterable[str], known: Iterable[str] = ()) -> frozenset[str]:
    """The names of groups. `known`: services that there are, of which experts are groups too. Raises ConfigError on any other."""
    wanted, there_are = frozenset(names), sorted({*GROUPS, *(set(known) - _OURS)})
    for name in sorted(wanted - set(there_are)):
        near = nearest(name, there_are)
        raise ConfigError(
            f"no group of tools {name[:40]!r}{f': {near}' if near else ''}; there are {', '.join(there_are)}"
        )
    return wanted


def offered(catalogue: Mapping[str, ToolEntry], groups: frozenset[str] = frozenset()) -> dict[str, ToolEntry]:
    """What a client may call: nothing that is for services alone, and of groups, where any are named, theirs."""
    servers = {server for group in groups for server in GROUPS.get(group, (group,))}
    return {
        name: entry
        for name, entry in catalogue.items()
        if not entry.meta.callers and (not groups or entry.meta.server in servers)
    }


def as_tool(entry: ToolEntry) -> types.Tool:
    """A catalogue entry under its bare name; its capability in `_meta` where that is more than reading.

    What results look like is left out: the whole schemas stand in the catalogue (`drivemcp tools list --json`).
    """
    more = {} if entry.meta.capability == "context" else {"capability": entry.meta.capability}
    return types.Tool(
        name=entry.name,
        description=" ".join(entry.description.split()),
        input_schema=_open(entry.inputSchema),
        annotations=types.ToolAnnotations.model_validate(_hints(entry.annotations)),
        _meta={META: more} if more else None,
    )


def _hints(annotations: Mapping[str, bool]) -> dict[str, bool]:
    """Of a tool that only reads nothing else needs to be said of what it changes."""
    meaningless = ("destructiveHint", "idempotentHint") if annotations.get("readOnlyHint") else ()
    return {name: hint for name, hint in annotations.items() if name not in meaningless}


def _open(schema: Any) -> Any:
    """The schema without what a reader can do without: defaults that are empty, line breaks, and `additionalProperties: false`,
    since the tool's server refuses such a field and names the nearest.
    """
    if isinstance(schema, list):
        return [_open(each) for each in schema]
    if isinstance(schema, str):
        return " ".join(schema.split())
    if not isinstance(schema, dict):
        return schema
    return {
        key: _open(each)
        for key, each in schema.items()
        if not (key == "additionalProperties" and each is False) and not (key == "default" and each in ("", []))
    }
