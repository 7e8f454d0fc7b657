"""What a browser gets: the page, the stream of events, and the four tools that a driver may call."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import anyio.to_thread
import msgspec
from starlette.applications import Starlette
from starlette.requests import Request
from starlette.responses import FileResponse, Response, StreamingResponse
from starlette.routing import Mount, Route
from starlette.staticfiles import StaticFiles

from drivemcp.http.limits import App, Receive, Scope, Send
from proto.tools import Outcome
from services.cockpit.events import Stream

PAGE = Path(__file__).parent / "page"
TOOLS = frozenset({"ask", "feedback", "set_preferences", "acknowledge"})
HEADERS = (
    (
        b"content-security-policy",
        b"default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self'; connect-src 'self'; "
        b"base-uri 'none'; form-action 'self'; frame-ancestors 'none'",
    ),
    (b"x-content-type-options", b"nosniff"),
    (b"referrer-policy", b"no-referrer"),
    (b"cross-origin-opener-policy", b"same-origin"),
    (b"cross-origin-resource-policy", b"same-origin"),
    (b"permissions-policy", b"camera=(), geolocation=(), microphone=(self)"),
    (b"cache-control", b"no-cache"),
)
Call = Callable[[str, dict[str, Any]], Outcome]


def make_app(stream: Stream, call: Call) -> App:
    """The app, whose every answer carries the strict headers."""

    async def index(_: Request) -> Response:
        return FileResponse(PAGE / "index.html")

    async def events(_: Request) -> Response:
        return StreamingResponse(stream.events(), media_type="text/event-stream")

    async def tool(request: Request) -> Response:
        name = request.path_params["name"]
        if name not in TOOLS:
            return Response(status_code=404)
        if request.headers.get("content-type", "").split(";")[0] != "application/json":
            return Response(status_code=415)
        try:
            arguments = msgspec.json.decode(await request.body(), type=dict[str, Any])
        except msgspec.DecodeError:
            return Response(status_code=400)
        outcome = await anyio.to_thread.run_sync(call, name, arguments)
        said = {"ok": outcome.ok, "result": outcome.result, "error": "" if outcome.ok else outcome.error}
        return Response(msgspec.json.encode(said), media_type="application/json")

    app = Starlette(
        routes=[
            Route("/", index),
            Route("/events", events),
            Route("/tool/{name}", tool, methods=["POST"]),
            Mount("/page", StaticFiles(directory=PAGE)),
        ]
    )
    return _with_headers(app)


def _with_headers(app: App) -> App:
    async def guarded(scope: Scope, receive: Receive, send: Send) -> None:
        async def strictly(message: Any) -> None:
            if message["type"] == "http.response.start":
                message = {**message, "headers": [*message.get("headers", []), *HEADERS]}
            await send(message)

        await app(scope, receive, strictly)

    return guarded
