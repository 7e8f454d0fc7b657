"""A call's arguments: decoded, with whole numbers taken for integers and fields that do not exist refused, inner ones too."""

import re
from collections.abc import Iterator
from typing import Any

import msgspec
from msgspec import inspect

from drivemcp.choices import choices, fields, nearest
from drivemcp.errors import MALFORMED
from drivemcp.tools.definition import Tool
from drivemcp.tools.refusal import SEE_TEXT, refusal
from drivemcp.tools.schema import at

_UNKNOWN = re.compile(r"unknown field `([^`]*)`")
_MISSING = re.compile(r"missing required field `([^`]*)`")
_STEP = re.compile(r"\.([^.\[\]]+)|\[[^\]]*\]")


ANY, TAG = inspect.AnyType(), inspect.StrType()


class ArgumentsRefused(ValueError):
    """Arguments that a tool does not take, in words."""


class ArgumentDecoder:
    """Decodes the arguments of one tool."""

    def __init__(self, tool: Tool) -> None:
        self._tool = tool
        self._decoder = msgspec.json.Decoder(tool.arguments)
        self._kind, self._shapes = inspect.type_info(tool.arguments), _Shapes()
        self._looks_inside = not tool.entry.meta.callers and _nested(self._kind)

    def decode(self, payload: bytes) -> msgspec.Struct:
        """The argument struct. Raises ArgumentsRefused."""
        try:
            decoded: msgspec.Struct = self._decoder.decode(payload)
        except MALFORMED as error:
            decoded = self._second_try(payload, error)
        if self._looks_inside:
            for path, word, known in self._shapes.strangers(msgspec.json.decode(payload), self._kind):
                raise self._refused(f"unknown field `{word}`", f"{path}.{word}".lstrip("."), _instead(word, known))
        return decoded

    def _second_try(self, payload: bytes, error: Exception) -> msgspec.Struct:
        """Decoded with whole numbers as integers: a language model writes 1.0 for 1."""
        if not isinstance(error, msgspec.ValidationError):
            raise self._refused(str(error), "", "give one JSON object") from error
        try:
            decoded: msgspec.Struct = msgspec.convert(
                _whole(msgspec.json.decode(payload), self._kind), self._tool.arguments
            )
        except MALFORMED as again:
            raise self._explained(again) from again
        return decoded

    def _explained(self, error: Exception) -> ArgumentsRefused:
        said, _, place = str(error).partition(" - at `")
        path = place.rstrip("`").removeprefix("key in `").lstrip("$").lstrip(".")
        kind = self._tool.arguments
        if stranger := _UNKNOWN.search(said):
            word = stranger.group(1)
            return self._refused(said, f"{path}.{word}".lstrip("."), _instead(word, fields(error, kind)))
        if missing := _MISSING.search(said):
            path = f"{path}.{missing.group(1)}".lstrip(".")
        listed = choices(error, kind)
        return self._refused(said, path, listed.removeprefix(": ") or self._described(path))

    def _described(self, path: str) -> str:
        schema = at(self._tool.entry.inputSchema, tuple(step.group(1) or "" for step in _STEP.finditer(f".{path}")))
        example = next(iter(schema.get("examples", ())), None)
        for_example = "" if example is None else f", for example {msgspec.json.encode(example).decode()}"
        return f"give {schema['description']}{for_example}" if "description" in schema else SEE_TEXT

    def _refused(self, problem: str, field: str, do: str) -> ArgumentsRefused:
        return ArgumentsRefused(refusal(f"arguments of {self._tool.entry.name}: {problem}", field=field, do=do))


def _instead(word: str, known: tuple[str, ...]) -> str:
    return nearest(word, known) or (
        f"leave it out; there are {', '.join(known)}" if known else "leave it out; it takes none"
    )


def _members(kind: inspect.Type) -> tuple[inspect.Type, ...]:
    if isinstance(kind, inspect.Metadata):
        return _members(kind.type)
    if isinstance(kind, inspect.UnionType):
        return tuple(each for one in kind.types for each in _members(one))
    return (kind,)


def _structs(kind: inspect.Type) -> tuple[inspect.StructType, ...]:
    return tuple(each for each in _members(kind) if isinstance(each, inspect.StructType))


def _items(kind: inspect.Type, place: int) -> inspect.Type:
    """The type of an array's element."""
    for each in _members(kind):
        if isinstance(each, inspect.CollectionType):
            return each.item_type
        if isinstance(each, inspect.TupleType) and place < len(each.item_types):
            return each.item_types[place]
    return ANY


def _nested(kind: inspect.Type) -> bool:
    """Whether an argument holds an object with fields of its own."""
    return any(
        _structs(field.type) or any(_structs(_items(each, 0)) for each in _members(field.type))
        for struct in _structs(kind)
        for field in struct.fields
    )


class _Shapes:
    """Which fields an object of a type may have, looked up once a type: arguments come many times a second.

    Only for types of one tree that lives as long as this does.
    """

    def __init__(self) -> None:
        self._known: dict[int, dict[str, inspect.Type] | None] = {}

    def strangers(self, value: Any, kind: inspect.Type, path: str = "") -> Iterator[tuple[str, str, tuple[str, ...]]]:
        """Fields that no struct at their place has: where, the word, and the fields that there are."""
        if isinstance(value, list):
            for number, each in enumerate(value):
                if isinstance(each, dict | list):
                    yield from self.strangers(each, _items(kind, number), f"{path}[{number}]")
        if not isinstance(value, dict) or (known := self._of(kind)) is None:
            return
        for word, each in value.items():
            if word not in known:
                yield path, word, tuple(name for name, field in sorted(known.items()) if field is not TAG)
            elif isinstance(each, dict | list):
                yield from self.strangers(each, known[word], f"{path}.{word}".lstrip("."))

    def _of(self, kind: inspect.Type) -> dict[str, inspect.Type] | None:
        """Types by the names of fields; None: a type without fields of its own, which may hold any."""
        if id(kind) not in self._known:
            structs = _structs(kind)
            tags = {struct.tag_field: TAG for struct in structs if struct.tag_field is not None}
            found = {field.encode_name: field.type for struct in structs for field in struct.fields}
            self._known[id(kind)] = {**tags, **found} if structs else None
        return self._known[id(kind)]


def _whole(value: Any, kind: inspect.Type) -> Any:
    """The value with floats that are whole as integers, where an integer and no float is asked for."""
    if isinstance(value, list):
        return [_whole(each, _items(kind, number)) for number, each in enumerate(value)]
    if isinstance(value, dict):
        known = {field.encode_name: field.type for struct in _structs(kind) for field in struct.fields}
        return {word: _whole(each, known.get(word, ANY)) for word, each in value.items()}
    kinds = {type(each) for each in _members(kind)}
    if isinstance(value, float) and value.is_integer() and inspect.IntType in kinds and inspect.FloatType not in kinds:
        return int(value)
    return value
