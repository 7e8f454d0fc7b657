"""A tool is a typed function and its docstring: catalogue entry, argument struct and schemas are derived from them."""

import inspect
import types
import typing
from collections.abc import Callable
from typing import Any

import msgspec

from drivemcp.errors import ContractError
from drivemcp.tools.schema import argument_schema
from proto import PROTO_VERSION
from proto.keys import chunk
from proto.services import RESERVED
from proto.tools import Capability, Effect, ToolEntry, ToolMeta


class Tool(msgspec.Struct, frozen=True):
    """A function made callable over the bus."""

    entry: ToolEntry
    arguments: type[msgspec.Struct]
    function: Callable[..., Any]

    def run(self, arguments: msgspec.Struct) -> Any:
        """Call the function with validated arguments."""
        return self.function(**{name: getattr(arguments, name) for name in arguments.__struct_fields__})


def define(
    function: Callable[..., Any],
    *,
    server: str,
    deadline_ms: float,
    capability: Capability = "context",
    title: str = "",
    name: str = "",
    read_only: bool | None = None,
    destructive: bool | None = None,
    idempotent: bool = True,
    answers: tuple[str, ...] = (),
    effect: Effect | None = None,
) -> Tool:
    """Derive the tool. Raises ContractError where the function has no docstring or lacks types."""
    tool_name = chunk(name or function.__name__)
    description = inspect.getdoc(function)
    if not description:
        raise ContractError(f"tool {tool_name!r} has no docstring: it is the tool's description")
    arguments = _arguments(function, tool_name)
    hints = typing.get_type_hints(function, include_extras=True)
    if "return" not in hints:
        raise ContractError(f"tool {tool_name!r} has no return type: it is the tool's output schema")
    entry = ToolEntry(
        name=tool_name,
        title=title or tool_name.replace("_", " "),
        description=description,
        inputSchema=argument_schema(arguments),
        outputSchema=object_schema(hints["return"]),
        annotations={
            "readOnlyHint": capability == "context" if read_only is None else read_only,
            "destructiveHint": capability == "actuation" if destructive is None else destructive,
            "idempotentHint": idempotent,
            "openWorldHint": False,
        },
        meta=ToolMeta(
            server=server,
            capability=capability,
            deadline_ms=deadline_ms,
            answers=answers,
            effect=effect,
            callers=RESERVED.get(tool_name, ()),
            proto_major=PROTO_VERSION[0],
        ),
    )
    return Tool(entry, arguments, function)


def _arguments(function: Callable[..., Any], tool_name: str) -> type[msgspec.Struct]:
    hints = typing.get_type_hints(function, include_extras=True)
    fields: list[Any] = []
    for parameter in inspect.signature(function).parameters.values():
        if parameter.name not in hints:
            raise ContractError(f"tool {tool_name!r}: parameter {parameter.name!r} has no type")
        field = (parameter.name, hints[parameter.name])
        fields.append(field if parameter.default is parameter.empty else (*field, parameter.default))
    return msgspec.defstruct(
        "".join(part.capitalize() for part in tool_name.split("_")) + "Arguments",
        fields,
        frozen=True,
        kw_only=True,
        forbid_unknown_fields=True,
    )


def object_schema(kind: Any) -> dict[str, Any]:
    """The JSON Schema of a type as MCP wants it: an object at the top. What is no object stands under `result`."""
    if not _is_object(kind):
        kind = msgspec.defstruct("Result", [("result", kind)], frozen=True, kw_only=True)
    schema = msgspec.json.schema(kind)
    reference = schema.pop("$ref", None)
    if reference is None:
        return schema
    definitions = schema["$defs"]
    top = dict(definitions.pop(reference.rsplit("/", 1)[1]))
    if definitions:
        top["$defs"] = definitions
    return top


def _is_object(kind: Any) -> bool:
    origin = typing.get_origin(kind) or kind
    if origin in (typing.Union, types.UnionType, typing.Annotated):
        return False
    return isinstance(origin, type) and issubclass(origin, msgspec.Struct | dict)


def as_object(result: Any) -> Any:
    """A tool's result as it goes on the wire: structs and dicts as they are, all else under `result`."""
    return result if isinstance(result, msgspec.Struct | dict) else {"result": result}
