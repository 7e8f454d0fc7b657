"""A client's call on its way over the bus: its progress, its end before its time, and the trace that it belongs to."""

import asyncio
import re
import time
from collections.abc import Mapping
from contextlib import suppress
from typing import Any

import anyio
from mcp.server import ServerRequestContext

from drivemcp.node import Node
from proto.tools import Outcome

PROGRESS_S = 0.5
"""From one notice of progress to the next, where a client asked for them; the first comes after as long."""
_TRACEPARENT = re.compile(r"[0-9a-f]{2}-[0-9a-f]{32}-[0-9a-f]{16}-[0-9a-f]{2}")


async def call(
    node: Node, ctx: ServerRequestContext[Any], tool: str, arguments: Mapping[str, Any], limit_ms: float
) -> Outcome:
    """The outcome; no thread waits for it. A client that gives up ends the call here, and its server is told."""
    if not ctx.meta or ctx.meta.get("progress_token") is None:
        return await _ended(node, tool, arguments, limit_ms, traceparent_of(ctx.meta or {}))
    async with anyio.create_task_group() as group:
        group.start_soon(_tell_progress, ctx, tool, limit_ms / 1000.0)
        outcome = await _ended(node, tool, arguments, limit_ms, traceparent_of(ctx.meta))
        group.cancel_scope.cancel()
    return outcome


async def _ended(node: Node, tool: str, arguments: Mapping[str, Any], limit_ms: float, traceparent: str) -> Outcome:
    loop, ended = asyncio.get_running_loop(), asyncio.Event()

    def wake() -> None:
        with suppress(RuntimeError):  # the loop has ended
            loop.call_soon_threadsafe(ended.set)

    begun = node.client.begin(tool, arguments, limit_ms, wake, traceparent=traceparent)
    if isinstance(begun, Outcome):
        return begun
    try:
        with anyio.move_on_after(limit_ms / 1000.0):
            await ended.wait()
    except anyio.get_cancelled_exc_class():
        node.client.cancel(begun)
        node.client.finish(begun)
        raise
    return node.client.finish(begun)


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
