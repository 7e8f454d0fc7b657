"""What msgspec leaves unsaid: the values that a field takes, beside the one that it does not."""

import json
import re
from collections.abc import Iterable, Iterator
from difflib import get_close_matches
from functools import lru_cache
from typing import Any

import msgspec
from msgspec import inspect

_PLACE = re.compile(r"^Invalid (?:enum )?value .* - at (`key` in )?`\$(.*)`$", re.DOTALL)
_STEP = re.compile(r"\.([^.\[\]]+)|\[[^\]]*\]")


def explained(error: Exception, kind: Any) -> str:
    """The error in words, with the values that the field takes. `kind`: the type that was decoded."""
    return f"{error}{choices(error, kind)}"


def choices(error: Exception, kind: Any) -> str:
    """What to give instead of a value that no closed list has; empty for any other error."""
    said = str(error)
    found = _PLACE.match(said if " - at " in said else f"{said} - at `$`")
    if not isinstance(error, msgspec.ValidationError) or found is None:
        return ""
    keys, path = found.groups()
    try:
        values = set(_values(_Place(_type(kind), path, bool(keys))))
    except TypeError:  # msgspec cannot describe the type: its own words stand
        return ""
    null = ", or null where it is not known" if None in values else ""
    listed = ", ".join(sorted(msgspec.json.encode(value).decode() for value in values - {None}))
    return f": give one of {listed}{null}" if listed else ""


def fields(error: Exception, kind: Any) -> tuple[str, ...]:
    """The fields of the object that an error is about; of a union those of all its members."""
    said = str(error)
    path = said.rpartition(" - at `$")[2].removesuffix("`") if " - at `$" in said else ""
    here = _Place(_type(kind), path, keys=False).here
    return tuple(
        sorted({each.encode_name for one in here if isinstance(one, inspect.StructType) for each in one.fields})
    )


def nearest(word: str, known: Iterable[str]) -> str:
    """`write "lorry"` for `lory`, with up to three words; empty where none is near."""
    found = get_close_matches(word, tuple(known), 3, 0.6)
    return f"write {' or '.join(json.dumps(each, ensure_ascii=False) for each in found)}" if found else ""


class _Place:
    """The types that may stand at a path, and those one step before it."""

    def __init__(self, kind: inspect.Type, path: str, keys: bool) -> None:
        self.before: list[inspect.Type] = []
        self.here = list(_each(kind))
        self.last = ""
        for step in _STEP.finditer(path):
            self.last = step.group(1) or ""
            self.before, self.here = self.here, [each for one in self.here for each in _inside(one, self.last)]
        if keys:
            self.here = [each for one in self.here if isinstance(one, inspect.DictType) for each in _each(one.key_type)]


def _values(place: _Place) -> Iterator[Any]:
    for each in place.here:
        if isinstance(each, inspect.LiteralType):
            yield from each.values
        elif isinstance(each, inspect.EnumType):
            yield from (member.value for member in each.cls)
        elif isinstance(each, inspect.NoneType):
            yield None
    for each in place.before:
        if isinstance(each, inspect.StructType) and each.tag_field == place.last:
            yield each.tag


def _inside(kind: inspect.Type, field: str) -> Iterator[inspect.Type]:
    if field and isinstance(kind, inspect.StructType | inspect.TypedDictType | inspect.DataclassType):
        yield from (each for one in kind.fields if one.encode_name == field for each in _each(one.type))
    elif not field and isinstance(kind, inspect.TupleType):
        yield from (each for one in kind.item_types for each in _each(one))
    elif not field and isinstance(kind, inspect.DictType):
        yield from _each(kind.value_type)
    elif not field and isinstance(kind, inspect.CollectionType):
        yield from _each(kind.item_type)


def _each(kind: inspect.Type) -> Iterator[inspect.Type]:
    """The members of a union, without what only describes them."""
    if isinstance(kind, inspect.Metadata):
        yield from _each(kind.type)
    elif isinstance(kind, inspect.UnionType):
        yield from (each for one in kind.types for each in _each(one))
    else:
        yield kind


@lru_cache(256)
def _type(kind: Any) -> inspect.Type:
    return inspect.type_info(kind)
