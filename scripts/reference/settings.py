"""Settings: every field of every service's configuration."""

import types
import typing
from collections.abc import Iterator
from typing import Any, Literal

import msgspec

from drivemcp.config import ServiceConfig
from drivemcp.http.serving import HttpConfig
from drivemcp.registry import load_service
from proto.services import SERVICES
from scripts.reference.markdown import field_docs, page, table

UNITS = {
    "ms": "ms", "s": "s", "hz": "Hz", "mb": "MB", "kb": "kB", "m": "m", "deg": "°", "days": "days", "mps": "m/s", "kmh": "km/h", "km": "km",
}  # fmt: skip
"""By a field's last part."""
HEAD = ("setting", "type", "default", "unit", "what it does")
BOUNDS = {"ge": "≥", "gt": ">", "le": "≤", "lt": "<"}


def settings() -> str:
    """The page."""
    parts = []
    for row in SERVICES:
        config: Any = load_service(row.name).config
        own = [each for each in _rows(config) if each not in {*_rows(ServiceConfig), *_rows(HttpConfig)}]
        http = " Those of [HTTP](#http) as well." if issubclass(config, HttpConfig) else ""
        parts.append(f"## {row.name}\n\n{_about(config)}{http}\n\n{table(HEAD, own)}")
    common = [each for each in _rows(HttpConfig) if each not in _rows(ServiceConfig)]
    return page(
        "Settings",
        "`drivemcp up --set SERVICE.SETTING=VALUE` and `drivemcp run SERVICE --set SETTING=VALUE` set one; dots descend. "
        "`drivemcp run SERVICE --config FILE` reads them from TOML or JSON, `--show-config` prints those in force. "
        "A setting of another name, type or range ends the start with exit code 2.",
        f"## Every service\n\n{table(HEAD, _rows(ServiceConfig))}",
        f"## HTTP\n\n{_about(HttpConfig)}\n\n{table(HEAD, common)}",
        *parts,
    )


def undocumented() -> list[str]:
    """Settings without a docstring."""
    rows = [(row.name, each) for row in SERVICES for each in _rows(load_service(row.name).config)]  # type: ignore[arg-type]
    return [f"{service}: {each[0]}" for service, each in rows if not each[-1]]


def _about(config: type[msgspec.Struct]) -> str:
    return " ".join((config.__doc__ or "").split())


def _rows(config: type[msgspec.Struct], before: str = "") -> list[tuple[str, ...]]:
    return list(_each(config, before))


def _each(config: type[msgspec.Struct], before: str) -> Iterator[tuple[str, ...]]:
    docs = field_docs(config)
    for field in msgspec.structs.fields(config):
        name, inside = f"{before}{field.name}", _struct(field.type)
        if inside:
            yield from _each(inside, f"{name}{'[]' if inside is not field.type else ''}.")
        else:
            yield (
                f"`{name}`",
                _type(field.type),
                _default(field),
                UNITS.get(field.name.rpartition("_")[2], ""),
                docs.get(field.name) or _said(field.type),
            )


def _said(kind: Any) -> str:
    """The description that stands in the type."""
    found = [each.description for each in getattr(kind, "__metadata__", ()) if getattr(each, "description", None)]
    return next((said for said in (*found, *map(_said, typing.get_args(kind))) if said), "")


def _struct(kind: Any) -> type[msgspec.Struct] | None:
    kinds = [kind, *typing.get_args(kind)]
    return next((each for each in kinds if isinstance(each, type) and issubclass(each, msgspec.Struct)), None)


def _default(field: msgspec.structs.FieldInfo) -> str:
    if field.default_factory is not msgspec.NODEFAULT:
        return f"`{msgspec.json.encode(field.default_factory()).decode()}`"
    if field.default is msgspec.NODEFAULT:
        return "required"
    return "unset" if field.default is None else f"`{msgspec.json.encode(field.default).decode()}`"


def _type(kind: Any) -> str:
    origin, arguments = typing.get_origin(kind), typing.get_args(kind)
    if origin is typing.Annotated:
        meta = [
            (BOUNDS[name], getattr(each, name))
            for each in arguments[1:]
            for name in BOUNDS
            if getattr(each, name) is not None
        ]
        return ", ".join([_type(arguments[0]), *(f"{sign} {value:g}" for sign, value in meta)])
    if origin is Literal:
        return " or ".join(f"`{each}`" if each else "empty" for each in arguments)
    if origin in (types.UnionType, typing.Union):
        return " or ".join(_type(each) for each in arguments if each is not type(None))
    if origin is tuple:
        return f"list of {_type(arguments[0])}" if arguments[-1] is ... else f"({', '.join(map(_type, arguments))})"
    if origin is dict:
        return f"table of {_type(arguments[1])}"
    return {str: "text", bool: "yes or no", int: "whole number", float: "number"}.get(kind, "any")
