"""Whether a client's call may be made: finite numbers alone, a person's word where it changes something, a grant for actuation."""

import re
from pathlib import Path
from typing import Any, NamedTuple

from mcp import types
from mcp.server import ServerRequestContext

from drivemcp.node import Node
from drivemcp.runtime.grants import GrantRefused, read_grant
from drivemcp.tools.refusal import impossible, refusal
from proto.tools import Outcome, ToolEntry
from services.gateway.asked_about import needs_answer
from services.gateway.confirming import Confirming, as_call

_CONFIRMATION = re.compile(r"confirmation must be '([^']*)'")


class Permit(NamedTuple):
    """A call that may be made, as it was shown where a person was asked."""

    tool: str
    arguments: dict[str, Any]
    grant: str = ""

    def make(self, node: Node, limit_ms: float) -> Outcome:
        """Call the tool. Under a grant the server asks for the confirmation of exactly this command, which a person has given."""
        asks = [(self.tool, self.arguments, limit_ms)]
        outcome = node.client.call_all(asks, grant=self.grant)[0]
        asked = _CONFIRMATION.search(outcome.error) if self.grant else None
        return outcome if asked is None else node.client.call_all(asks, grant=self.grant, confirmation=asked[1])[0]


class Gate:
    """Judges the calls of clients."""

    def __init__(self, confirming: Confirming | None = None, grant_file: str = "") -> None:
        self._confirming, self._grant_file = confirming or Confirming(), grant_file

    async def judge(
        self, context: ServerRequestContext[Any], params: types.CallToolRequestParams, entry: ToolEntry
    ) -> Permit | types.InputRequiredResult | Outcome:
        """The permit; else the question that goes out first, or the refusal."""
        arguments = params.arguments or {}
        if path := impossible(arguments):
            problem = f"arguments of {entry.name}: no finite number"
            return _refused(entry, refusal(problem, field=path, do="give a finite number, or leave the field out"))
        if not needs_answer(entry, arguments):
            return Permit(entry.name, arguments)
        grant, told = "", ""
        if entry.meta.capability == "actuation":
            try:
                grant, told = self._grant(entry.name)
            except GrantRefused as error:
                do = "let a person sign one (drivemcp grant) and name its file (grant_file, drivemcp mcp --grant)"
                return _refused(entry, refusal(f"{entry.name} is refused: {error}", do=do))
        call = as_call(entry.name, arguments)
        why = await self._confirming.why_not(context, params, entry, call, told)
        if isinstance(why, types.InputRequiredResult):
            return why
        return _refused(entry, why) if why else Permit(entry.name, call.arguments, grant)

    def _grant(self, tool: str) -> tuple[str, str]:
        """The grant's text, and how a person is told of it. The tool's server judges it. Raises GrantRefused."""
        if not self._grant_file:
            raise GrantRefused("actuation takes a grant, and the gateway holds none")
        try:
            text = Path(self._grant_file).read_text(encoding="utf-8")
        except (OSError, UnicodeDecodeError) as error:
            raise GrantRefused(f"the gateway's grant cannot be read: {error}") from None
        grant = read_grant(text.encode())
        if grant.capability != f"tool:{tool}":
            raise GrantRefused(f"the gateway's grant is for {grant.capability!r}")
        return text, f"{grant.grant_id!r}, until {grant.expires_at!r}"


def _refused(entry: ToolEntry, why: str) -> Outcome:
    return Outcome(tool=entry.name, status="tool_error", error=why)
