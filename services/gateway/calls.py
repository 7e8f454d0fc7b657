"""A client's call on its way over the bus: its progress, its end before its time, and the trace that it belongs to."""

import re
import time
from collections.abc import Mapping
from functools import partial
from typing import Any

import anyio
import anyio.to_thread
from mcp.server import ServerRequestContext

from drivemcp.node import Node
from drivemcp.tools.pending import Cancellation
from proto.tools import Outcome

PROGRESS_S = 0.5
"""From one notice of progress to the next, where a client asked for them; the first comes after as long."""
_TRACEPARENT = re.compile(r"[0-9a-f]{2}-[0-9a-f]{32}-[0-9a-f]{16}-[0-9a-f]{2}")


async def call(
    node: Node, ctx: ServerRequestContext[Any], tool: str, arguments: Mapping[str, Any], limit_ms: float
) -> Outcome:
    """The outcome. A client that gives up ends the call here, and its server is told."""
    async with anyio.create_task_group() as group:
        if ctx.meta and ctx.meta.get("progress_token") is not None:
            group.start_soon(_tell_progress, ctx, tool, limit_ms / 1000.0)
        cancellation = Cancellation()
        run = partial(
            node.call,
            tool,
            arguments,
            deadline_ms=limit_ms,
            traceparent=traceparent_of(ctx.meta or {}),
            cancellation=cancellation,
        )
        try:
            outcome = await anyio.to_thread.run_sync(run, abandon_on_cancel=True)
        finally:
            cancellation.cancel()  # of a call that has ended it ends nothing
        group.cancel_scope.cancel()
    return outcome


def traceparent_of(meta: Mapping[str, Any]) -> str:
    """What the client sent, if it has the form of W3C Trace Context; else nothing."""
    given = meta.get("traceparent")
    return given if isinstance(given, str) and _TRACEPARENT.fullmatch(given) else ""


async def _tell_progress(ctx: ServerRequestContext[Any], tool: str, limit_s: float) -> None:
    begun_s = time.monotonic()
    while True:
        await anyio.sleep(PROGRESS_S)
        elapsed_s = round(time.monotonic() - begun_s, 1)
        await ctx.session.report_progress(elapsed_s, limit_s, f"{tool} runs; it ends after {limit_s:g} s at the latest")
