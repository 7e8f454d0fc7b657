"""The one shape of a refusal: what was wrong, which field, what to do. Tool, tool server, client and gateway all word it here."""

import math
from typing import Any

from drivemcp.choices import nearest

SEE_TEXT = "see the tool's description"


def refusal(problem: str, *, field: str = "", do: str = SEE_TEXT) -> str:
    """`problem [field: situation.zone] [do: give ...]`; a refusal that no single field caused has `-` for it."""
    return f"{problem} [field: {field or '-'}] [do: {do}]"


def unknown_tool(name: str, known: tuple[str, ...]) -> str:
    """The refusal of a name that no server offers, with the nearest names."""
    do = nearest(name[:80], known) or "list the tools and take one of their names"
    return refusal(f"no tool {name[:80]!r}", field="name", do=do)


def impossible(value: Any, path: str = "") -> str:
    """The path of the first number in the arguments that is NaN or infinite, which JSON cannot carry; empty: all are finite."""
    if isinstance(value, float) and not math.isfinite(value):
        return path or "-"
    inside = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list | tuple) else ()
    for key, each in inside:
        step = f"{path}.{key}".lstrip(".") if isinstance(value, dict) else f"{path}[{key}]"
        if found := impossible(each, step):
            return found
    return ""
