"""Tools: what each takes and gives, from the services that offer them."""

import ast
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import msgspec

from drivemcp.bus.session import open_bus
from drivemcp.config import BusConfig
from drivemcp.node import Node
from drivemcp.registry import load_service
from proto.services import SERVICES
from proto.tools import ToolEntry
from scripts.reference.markdown import code, page, table
from scripts.syntax import parsed

ROOT = Path(__file__).parents[2]


def tools() -> str:
    """The page. Builds every service that offers a tool, and opens none."""
    with open_bus(BusConfig(mode="peer")) as bus, tempfile.TemporaryDirectory() as folder:
        parts = [_server(row.name, _entries(bus, row.name, folder)) for row in SERVICES if row.tools]
    return page(
        "Tools",
        "Each tool of the bus. `drivemcp tools call NAME 'ARGUMENTS'` calls one with arguments in JSON; `drivemcp mcp` offers them to any "
        "MCP client. A call is refused if an argument is unknown, missing, of another type or outside its range. The refusal names the "
        "field and what to do: `PROBLEM [field: FIELD] [do: ...]`. A call past its deadline is late: its answer counts as missing. "
        "An *actuation* tool needs a grant (`drivemcp grant`) and the confirmation of that very call.",
        *parts,
    )


def _entries(bus: Any, name: str, folder: str) -> list[ToolEntry]:
    service: Any = load_service(name)
    config = msgspec.convert({"out_dir": folder, **_unlike_default(name, Path(folder))}, service.config)
    node = Node(bus, name, config)
    try:
        service.build(config, node)
        return sorted((tool.entry for tool in node.tools.tools), key=lambda entry: entry.name)
    finally:
        node.close()


def _unlike_default(name: str, folder: Path) -> dict[str, Any]:
    """Settings with which a service offers all its tools, and does nothing else."""
    if name == "simulator":
        return {"autostart": False}
    if name == "can":  # `step_recording` is for a recording that is stepped
        (recording := folder / "can.log").write_text("(1.0) can0 123#00\n", encoding="ascii")
        return {"buses": [{"recording": str(recording), "step_frames": 1}]}
    return {}


def _server(name: str, entries: list[ToolEntry]) -> str:
    refusals = "\n".join(f"- {each}" for each in sorted(set(_refusals(ROOT / "services" / name))))
    why = [f"### Refusals of {name}", refusals] if refusals else []
    return "\n\n".join([f"## {name}", *(_tool(entry) for entry in entries), *why])


def _tool(entry: ToolEntry) -> str:
    meta, answer = entry.meta, entry.outputSchema
    facts = [
        f"Answers within {meta.deadline_ms:g} ms with {_answer(answer)}.",
        "It changes something outside (*actuation*)." if meta.capability == "actuation" else "",
        f"Only {code(meta.callers)} may call it." if meta.callers else "",
    ]
    rows = list(_arguments(entry.inputSchema, ""))
    arguments = table(("argument", "type", "default", "what it is", "example"), rows) if rows else "No arguments."
    return "\n\n".join([f"### {entry.name}", entry.description, " ".join(fact for fact in facts if fact), arguments])


def _answer(schema: dict[str, Any]) -> str:
    fields = code(schema.get("properties", {}))
    return f"{fields}" if fields else "an object"


def _arguments(schema: dict[str, Any], before: str) -> Iterator[tuple[str, ...]]:
    required = schema.get("required", ())
    for name, each in schema.get("properties", {}).items():
        told = "required" if name in required else f"`{_json(each['default'])}`" if "default" in each else "unset"
        example = next((f"`{_json(value)}`" for value in each.get("examples", ())), "")
        about = each.get("description", "").split("\n\n")[0]
        yield f"`{before}{name}`", _type(each), told, about, example
        inner = (each.get("items") or {}) if each.get("type") == "array" else each
        if "properties" in inner:
            yield from _arguments(inner, f"{before}{name}{'[]' if inner is not each else ''}.")


def _json(value: Any) -> str:
    return msgspec.json.encode(value).decode()


def _type(schema: dict[str, Any]) -> str:
    if "enum" in schema:
        return " or ".join(f"`{value}`" if value != "" else "empty" for value in schema["enum"])
    if "anyOf" in schema:
        return " or ".join(_type(each) for each in schema["anyOf"])
    kind = str(schema.get("type", "any"))
    if kind == "array":
        items = schema.get("prefixItems") or [schema.get("items") or {}]
        kind = f"array of {' and '.join(_type(each) for each in items)}"
    bounds = [
        f"{sign} {schema[key]:g}"
        for key, sign in (("minimum", "≥"), ("maximum", "≤"), ("exclusiveMinimum", ">"))
        if key in schema
    ]
    return ", ".join([kind, *bounds])


def _refusals(folder: Path) -> Iterator[str]:
    """What the code of a service words as ToolFailed; `…` stands for what differs from call to call."""
    for file in sorted(folder.rglob("*.py")):
        for node in ast.walk(parsed(file.read_text(encoding="utf-8"))):
            if isinstance(node, ast.Call) and node.args and ast.unparse(node.func) == "ToolFailed":
                yield from filter(None, [_words(node.args[0])])


def _words(node: ast.expr) -> str:
    if isinstance(node, ast.Constant):
        return str(node.value)
    if isinstance(node, ast.JoinedStr):
        text = "".join(str(each.value) if isinstance(each, ast.Constant) else "…" for each in node.values)
        return text if text.strip("… ") else ""
    return ""
