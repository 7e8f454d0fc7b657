"""Completes arguments of prompts and templates from what is there: ticks, packs, documents, offsets, drives, languages."""

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import anyio.to_thread
from mcp import types
from mcp.server import ServerRequestContext
from mcp.shared.exceptions import MCPError

from domain.languages import LANGUAGES
from proto.tools import INVALID_PARAMS
from services.gateway.addresses import CITATION, DECISION, REPORT
from services.gateway.drives import Drives
from services.gateway.prompts import PROMPTS
from services.gateway.resources import Resources
from services.gateway.seen import Seen

MOST_VALUES = 100
"""The protocol's own bound."""
MOST_TYPED = 200
RECENT_TICKS = 600
"""So many decisions the arbiter keeps (a minute)."""
Known = Mapping[str, str]
_ARGUMENTS: Mapping[str, tuple[str, ...]] = {
    DECISION: ("tick",),
    REPORT: ("id",),
    CITATION: ("pack", "document", "offset"),
    **{name: tuple(argument for argument, _, _ in row.arguments) for name, row in PROMPTS.items()},
}


class Completion:
    """Answers `completion/complete`."""

    def __init__(self, seen: Seen, resources: Resources, drives: Drives) -> None:
        self._seen, self._resources = seen, resources
        self._of: Mapping[str, Callable[[Known], Sequence[str]]] = {
            "tick": self._ticks,
            "id": lambda _: drives.names(),
            "drive": lambda _: drives.names(),
            "language": lambda _: LANGUAGES,
            "pack": lambda _: resources.places(""),
            "document": lambda known: resources.places(known["pack"]) if known.get("pack") else (),
            "offset": self._offsets,
        }

    async def complete(
        self, _: ServerRequestContext[Any, Any], params: types.CompleteRequestParams
    ) -> types.CompleteResult:
        """Values that begin with what was typed; the newest or first come first. Raises MCPError on an unknown argument."""
        of = params.ref.name if isinstance(params.ref, types.PromptReference) else params.ref.uri
        name, typed = params.argument.name, params.argument.value
        if name not in _ARGUMENTS.get(of, ()):
            raise MCPError(INVALID_PARAMS, f"{of[:120]!r} has no argument {name[:80]!r}")
        known = (params.context.arguments if params.context else None) or {}
        if len(typed) > MOST_TYPED or name not in self._of:
            return types.CompleteResult(completion=types.Completion(values=[], total=0, has_more=False))
        values = await anyio.to_thread.run_sync(self._of[name], known)
        fitting = [value for value in values if value.casefold().startswith(typed.casefold())]
        return types.CompleteResult(
            completion=types.Completion(
                values=fitting[:MOST_VALUES], total=len(fitting), has_more=len(fitting) > MOST_VALUES
            )
        )

    def _ticks(self, _: Known) -> tuple[str, ...]:
        """Those of messages to the driver, then the newest."""
        told = [each.message.tick for each in self._seen.messages()]
        newest = self._seen.tick()
        recent = range(newest, max(-1, newest - RECENT_TICKS), -1) if newest is not None else ()
        return tuple(str(tick) for tick in dict.fromkeys((*told, *recent)))

    def _offsets(self, known: Known) -> Sequence[str]:
        where = known.get("pack", ""), known.get("document", "")
        return self._resources.places("/".join(where)) if all(where) else ()
