"""The JSON Schema of a tool's arguments, as a language model reads it: no references, no titles, nothing said twice."""

from typing import Any

import msgspec


def argument_schema(arguments: type[msgspec.Struct]) -> dict[str, Any]:
    """The schema of an argument struct. Each reference stands resolved in its place.

    Null is left out where null is the default: leaving the field out says the same.
    """
    schema = msgspec.json.schema(arguments)
    return _plain(schema, schema.get("$defs", {}))


def at(schema: dict[str, Any], steps: tuple[str, ...]) -> dict[str, Any]:
    """The schema of a field by its path; an empty step goes into an array. Empty where the path leads nowhere."""
    for step in steps:
        inner = schema.get("properties", {}).get(step) if step else schema.get("items")
        if not isinstance(inner, dict):
            return {}
        schema = inner
    return schema


def _plain(schema: dict[str, Any], known: dict[str, Any]) -> dict[str, Any]:
    if "$ref" in schema:
        name = schema["$ref"].rsplit("/", 1)[1]
        resolved = _plain(known[name], known)
        own = {key: value for key, value in schema.items() if key not in ("$ref", "$defs")}
        return {**resolved, **own, "additionalProperties": False} if "properties" in resolved else {**resolved, **own}
    schema = {key: value for key, value in schema.items() if key not in ("title", "$defs")}
    if "properties" in schema:
        schema["properties"] = {name: _plain(each, known) for name, each in schema["properties"].items()}
        if not schema.get("required"):
            schema.pop("required", None)
    if isinstance(schema.get("items"), dict):
        schema["items"] = _plain(schema["items"], known)
    if "anyOf" in schema:
        schema = _one_of(schema, known)
    return schema


def _one_of(schema: dict[str, Any], known: dict[str, Any]) -> dict[str, Any]:
    members = [_plain(each, known) for each in schema["anyOf"]]
    if "default" in schema and schema["default"] is None:
        members = [each for each in members if each != {"type": "null"}]
        del schema["default"]
    rest = {key: value for key, value in schema.items() if key != "anyOf"}
    return {**members[0], **rest} if len(members) == 1 else {"anyOf": members, **rest}
