"""What the official suite asks a server to have: its tools, resources and prompts, put beside those of the real gateway."""

import base64
import hashlib
import hmac
import struct
import zlib
from collections.abc import Awaitable, Callable, Mapping
from typing import Any

import anyio
from mcp import types
from mcp.server import ServerRequestContext
from mcp.server.subscriptions import PromptsListChanged, ToolsListChanged
from mcp.shared.exceptions import MCPError

from services.gateway.changes import Changes
from services.gateway.server import GatewayServer

Context = ServerRequestContext[Any, Any]
Handler = Callable[[Context, Any], Awaitable[Any]]
KEY = b"of the fixture alone"
MISSING_CAPABILITY = -32021


def _png() -> str:
    def chunk(kind: bytes, data: bytes) -> bytes:
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    head, pixel = struct.pack(">IIBBBBB", 1, 1, 8, 2, 0, 0, 0), zlib.compress(b"\0\xff\0\0")
    return base64.b64encode(
        b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", head) + chunk(b"IDAT", pixel) + chunk(b"IEND", b"")
    ).decode()


PNG = _png()
WAV = base64.b64encode(
    b"RIFF$\0\0\0WAVEfmt \x10\0\0\0\x01\0\x01\0\x40\x1f\0\0\x80\x3e\0\0\x02\0\x10\0data\0\0\0\0"
).decode()


def text(words: str) -> types.TextContent:
    return types.TextContent(text=words)


def embedded(uri: str, mime: str, words: str) -> types.EmbeddedResource:
    return types.EmbeddedResource(resource=types.TextResourceContents(uri=uri, mime_type=mime, text=words))


IMAGE = types.ImageContent(data=PNG, mime_type="image/png")
STATIC: Mapping[str, list[Any]] = {
    "test_simple_text": [text("This is a simple text response for testing.")],
    "test_image_content": [IMAGE],
    "test_audio_content": [types.AudioContent(data=WAV, mime_type="audio/wav")],
    "test_embedded_resource": [
        embedded("test://embedded-resource", "text/plain", "This is an embedded resource content.")
    ],
    "test_multiple_content_types": [
        text("Multiple content types test:"), IMAGE,
        embedded("test://mixed-content-resource", "application/json", '{"test":"data","value":123}'),
    ],
}  # fmt: skip
RICH_SCHEMA: dict[str, Any] = {
    "$schema": "https://json-schema.org/draft/2020-12/schema",
    "type": "object",
    "$defs": {
        "address": {
            "$anchor": "addressDef", "type": "object", "properties": {"street": {"type": "string"}, "city": {"type": "string"}}
        }
    },
    "properties": {
        "name": {"type": "string"}, "address": {"$ref": "#/$defs/address"},
        "contactMethod": {"type": "string", "enum": ["phone", "email"]}, "phone": {"type": "string"}, "email": {"type": "string"},
    },
    "allOf": [{"anyOf": [{"required": ["phone"]}, {"required": ["email"]}]}],
    "if": {"properties": {"contactMethod": {"const": "phone"}}, "required": ["contactMethod"]},
    "then": {"required": ["phone"]},
    "else": {"required": ["email"]},
    "additionalProperties": False,
}  # fmt: skip
SCHEMAS: Mapping[str, dict[str, Any]] = {
    "json_schema_2020_12_tool": RICH_SCHEMA,
    "test_elicitation": {"type": "object", "properties": {"message": {"type": "string"}}, "required": ["message"]},
    "test_headers": {"type": "object", "properties": {"region": {"type": "string", "x-mcp-header": "Region"}}},
}


def _object(**properties: Any) -> dict[str, Any]:
    return {"type": "object", "properties": properties, "required": list(properties)}


_TITLED = [{"const": f"value{n}", "title": f"{word} Choice"} for n, word in enumerate(("First", "Second", "Third"), 1)]
_PLAIN = ["option1", "option2", "option3"]
FORMS: Mapping[str, dict[str, Any]] = {
    "test_elicitation": _object(
        username={"type": "string", "description": "User's response"},
        email={"type": "string", "description": "User's email address"},
    ),
    "test_elicitation_sep1034_defaults": {
        "type": "object",
        "properties": {
            "name": {"type": "string", "default": "John Doe"}, "age": {"type": "integer", "default": 30},
            "score": {"type": "number", "default": 95.5}, "verified": {"type": "boolean", "default": True},
            "status": {"type": "string", "enum": ["active", "inactive", "pending"], "default": "active"},
        },
    },
    "test_elicitation_sep1330_enums": {
        "type": "object",
        "properties": {
            "untitledSingle": {"type": "string", "enum": _PLAIN}, "titledSingle": {"type": "string", "oneOf": _TITLED},
            "legacyEnum": {"type": "string", "enum": ["opt1", "opt2"], "enumNames": ["Option One", "Option Two"]},
            "untitledMulti": {"type": "array", "items": {"type": "string", "enum": _PLAIN}},
            "titledMulti": {"type": "array", "items": {"anyOf": _TITLED}},
        },
    },
}  # fmt: skip


def elicit(message: str, **properties: Any) -> types.ElicitRequest:
    return types.ElicitRequest(
        params=types.ElicitRequestFormParams(message=message, requested_schema=_object(**properties))
    )


def sample(words: str) -> types.CreateMessageRequest:
    asked = types.SamplingMessage(role="user", content=text(words))
    return types.CreateMessageRequest(params=types.CreateMessageRequestParams(messages=[asked], max_tokens=100))


NAME = {"type": "string"}
ASKS: Mapping[str, Mapping[str, Any]] = {
    "test_input_required_result_elicitation": {"user_name": elicit("What is your name?", name=NAME)},
    "test_input_required_result_sampling": {"capital_question": sample("What is the capital of France?")},
    "test_input_required_result_list_roots": {"client_roots": types.ListRootsRequest()},
    "test_input_required_result_request_state": {"confirm": elicit("Please confirm", ok={"type": "boolean"})},
    "test_input_required_result_tampered_state": {"confirm": elicit("Please confirm", ok={"type": "boolean"})},
    "test_input_required_result_multiple_inputs": {
        "user_name": elicit("What is your name?", name=NAME), "greeting": sample("Generate a greeting"),
        "client_roots": types.ListRootsRequest(),
    },
    "test_streaming_elicitation": {"user_name": elicit("What is your name?", name=NAME)},
}  # fmt: skip
STATEFUL = ("request_state", "tampered_state", "multiple_inputs")
STEPS = (
    {"step1": elicit("Step 1: What is your name?", name=NAME)},
    {"step2": elicit("Step 2: What is your favorite color?", color=NAME)},
)


def signed(state: str) -> str:
    return f"{state}.{hmac.new(KEY, state.encode(), hashlib.sha256).hexdigest()}"


def opened(given: str | None) -> str:
    """The state that was signed. Raises MCPError on any other."""
    state = (given or "").rpartition(".")[0]
    if given != signed(state):
        raise MCPError(-32602, "the state is not one of this server's")
    return state


def _whole(asks: Mapping[str, Any], given: Mapping[str, Any] | None) -> bool:
    return all(isinstance(given, Mapping) and name in given for name in asks)


async def _ask(name: str, params: Any) -> Any:
    asks = ASKS[name]
    stateful = name.endswith(STATEFUL)
    if params.request_state is not None and stateful:
        opened(params.request_state)
    if not _whole(asks, params.input_responses):
        return types.InputRequiredResult(input_requests=dict(asks), request_state=signed("asked") if stateful else None)
    said = {key: str(value) for key, value in params.input_responses.items() if key in asks}
    return types.CallToolResult(content=[text(f"state-ok {said}")])


async def _rounds(params: Any) -> Any:
    at = int(opened(params.request_state)) if params.request_state is not None else 0
    if at < len(STEPS) and (at == 0 or _whole(STEPS[at - 1], params.input_responses)):
        return types.InputRequiredResult(input_requests=dict(STEPS[at]), request_state=signed(str(at + 1)))
    return types.CallToolResult(content=[text("all steps are done")])


class Fixture:
    """Wraps the handlers of a gateway's server."""

    def __init__(self, server: GatewayServer, changes: Changes) -> None:
        self._changes, self._extra = changes, 0
        real_schema = server.get_tool_input_schema
        assert real_schema is not None
        server.get_tool_input_schema = lambda name: SCHEMAS[name] if name in SCHEMAS else real_schema(name)
        for method, wrapper in (
            ("tools/list", self.list_tools), ("tools/call", self.call_tool), ("resources/list", self.list_resources),
            ("resources/templates/list", self.list_templates), ("resources/read", self.read),
            ("prompts/list", self.list_prompts), ("prompts/get", self.get_prompt), ("completion/complete", self.complete),
        ):  # fmt: skip
            entry = server.get_request_handler(method)
            assert entry is not None
            server.add_request_handler(method, entry.params_type, self._with(wrapper, entry.handler))

    @staticmethod
    def _with(wrapper: Callable[[Handler, Context, Any], Awaitable[Any]], real: Handler) -> Handler:
        async def handle(ctx: Context, params: Any) -> Any:
            return await wrapper(real, ctx, params)

        return handle

    async def list_tools(self, real: Handler, ctx: Context, params: Any) -> Any:
        found = await real(ctx, params)
        names = [*STATIC, *FORMS, *ASKS, *SCHEMAS, *self._tools(), *(f"extra_{n}" for n in range(self._extra))]
        plain = {"type": "object", "properties": {}}
        found.tools += [
            types.Tool(name=name, description="Of the suite's fixture.", input_schema=SCHEMAS.get(name, plain))
            for name in dict.fromkeys(names)
        ]
        return found

    def _tools(self) -> Mapping[str, Callable[[Context, Any], Awaitable[Any]]]:
        return {
            "test_error_handling": self._fail, "test_tool_with_progress": self._progress, "test_reconnection": self._reconnect,
            "test_missing_capability": self._need_sampling, "test_trigger_tool_change": self._change_tools,
            "test_trigger_prompt_change": self._change_prompts, "test_logging_tool": self._quiet,
            "test_input_required_result_multi_round": lambda _, params: _rounds(params),
            "test_input_required_result_capabilities": self._capable,
        }  # fmt: skip

    async def call_tool(self, real: Handler, ctx: Context, params: Any) -> Any:
        if params.name in STATIC:
            return types.CallToolResult(content=STATIC[params.name])
        if params.name in FORMS:
            return await self._elicit(ctx, params)
        if params.name in ASKS:
            return await _ask(params.name, params)
        if params.name in SCHEMAS:
            return types.CallToolResult(content=[text("called")])
        own = self._tools().get(params.name)
        return await (own(ctx, params) if own is not None else real(ctx, params))

    async def _fail(self, _: Context, __: Any) -> Any:
        return types.CallToolResult(
            content=[text("This tool intentionally returns an error for testing")], is_error=True
        )

    async def _quiet(self, _: Context, __: Any) -> Any:
        return types.CallToolResult(content=[text("nothing is logged: the server declares no logging")])

    async def _progress(self, ctx: Context, _: Any) -> Any:
        for progress in (0.0, 50.0, 100.0):
            await ctx.session.report_progress(progress, 100.0)
            await anyio.sleep(0.05)
        return types.CallToolResult(content=[text("done")])

    async def _reconnect(self, _: Context, __: Any) -> Any:
        return types.CallToolResult(content=[text("not closed: without stored events no stream is taken up again")])

    async def _need_sampling(self, ctx: Context, _: Any) -> Any:
        capabilities = ctx.session.client_capabilities
        if capabilities is None or capabilities.sampling is None:
            raise MCPError(MISSING_CAPABILITY, "sampling is needed", {"requiredCapabilities": {"sampling": {}}})
        return types.CallToolResult(content=[text("the client can sample")])

    async def _change_tools(self, _: Context, __: Any) -> Any:
        self._extra += 1
        self._changes.tell(ToolsListChanged(), urgent=True)
        return types.CallToolResult(content=[text("changed")])

    async def _change_prompts(self, _: Context, __: Any) -> Any:
        self._changes.tell(PromptsListChanged(), urgent=True)
        return types.CallToolResult(content=[text("changed")])

    async def _capable(self, ctx: Context, params: Any) -> Any:
        capabilities = ctx.session.client_capabilities
        asks: dict[str, Any] = {}
        if capabilities is not None and capabilities.sampling is not None:
            asks["sampled"] = sample("Say something")
        if capabilities is not None and capabilities.elicitation is not None:
            asks["asked"] = elicit("What is your name?", name=NAME)
        if asks and not _whole(asks, params.input_responses):
            return types.InputRequiredResult(input_requests=asks)
        return types.CallToolResult(content=[text("nothing is needed")])

    async def _elicit(self, ctx: Context, params: Any) -> Any:
        message = (params.arguments or {}).get("message", "Please answer")
        found = await ctx.session.elicit_form(message, FORMS[params.name], related_request_id=ctx.request_id)
        return types.CallToolResult(content=[text(f"action={found.action}, content={found.content}")])

    async def list_resources(self, real: Handler, ctx: Context, params: Any) -> Any:
        found = await real(ctx, params)
        found.resources += [
            types.Resource(uri=uri, name=uri, description="Of the suite's fixture.", mime_type=mime)
            for uri, mime in (("test://static-text", "text/plain"), ("test://static-binary", "image/png"))
        ]
        return found

    async def list_templates(self, real: Handler, ctx: Context, params: Any) -> Any:
        found = await real(ctx, params)
        found.resource_templates.append(
            types.ResourceTemplate(
                uri_template="test://template/{id}/data", name="template", mime_type="application/json"
            )
        )
        return found

    async def read(self, real: Handler, ctx: Context, params: Any) -> Any:
        uri, number = params.uri, params.uri.removeprefix("test://template/").removesuffix("/data")
        content: types.TextResourceContents | types.BlobResourceContents
        if uri == "test://static-text":
            words = "This is the content of the static text resource."
            content = types.TextResourceContents(uri=uri, mime_type="text/plain", text=words)
        elif uri == "test://static-binary":
            content = types.BlobResourceContents(uri=uri, mime_type="image/png", blob=PNG)
        elif uri == f"test://template/{number}/data":
            words = f'{{"id":"{number}","templateTest":true,"data":"Data for ID: {number}"}}'
            content = types.TextResourceContents(uri=uri, mime_type="application/json", text=words)
        else:
            return await real(ctx, params)
        return types.ReadResourceResult(contents=[content], ttl_ms=0, cache_scope="private")

    async def list_prompts(self, real: Handler, ctx: Context, params: Any) -> Any:
        found = await real(ctx, params)
        names = (
            "test_simple_prompt", "test_prompt_with_arguments", "test_prompt_with_embedded_resource",
            "test_prompt_with_image", "test_input_required_result_prompt",
        )  # fmt: skip
        found.prompts += [types.Prompt(name=name, description="Of the suite's fixture.") for name in names]
        return found

    async def get_prompt(self, real: Handler, ctx: Context, params: Any) -> Any:
        given = params.arguments or {}
        asks = {"user_context": elicit("What context should the prompt use?", context=NAME)}
        if params.name == "test_input_required_result_prompt" and not _whole(asks, params.input_responses):
            return types.InputRequiredResult(input_requests=dict(asks))
        contents: Mapping[str, list[Any]] = {
            "test_simple_prompt": [text("This is a simple prompt for testing.")],
            "test_prompt_with_arguments": [
                text(f"Prompt with arguments: arg1='{given.get('arg1')}', arg2='{given.get('arg2')}'")
            ],
            "test_prompt_with_embedded_resource": [
                embedded(str(given.get("resourceUri")), "text/plain", "Embedded resource content for testing."),
                text("Please process the embedded resource above."),
            ],
            "test_prompt_with_image": [IMAGE, text("Please analyze the image above.")],
            "test_input_required_result_prompt": [text(f"With {params.input_responses}")],
        }
        if params.name not in contents:
            return await real(ctx, params)
        messages = [types.PromptMessage(role="user", content=each) for each in contents[params.name]]
        return types.GetPromptResult(messages=messages)

    async def complete(self, real: Handler, ctx: Context, params: Any) -> Any:
        if isinstance(params.ref, types.PromptReference) and params.ref.name.startswith("test_"):
            return types.CompleteResult(completion=types.Completion(values=["paris", "park"], total=2, has_more=False))
        return await real(ctx, params)
