"""Tables in Markdown, and the docstrings of a struct's fields."""

import ast
import inspect
import re
import textwrap
from collections.abc import Iterable, Sequence

import msgspec

from scripts.syntax import parsed


def table(head: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """A table. Every cell is one line."""
    lines = [head, ["---"] * len(head), *rows]
    return "\n".join(f"| {' | '.join(cell(each) for each in line)} |" for line in lines)


def cell(text: str) -> str:
    """Text that breaks no table: one line, no bare pipe, no `<` outside code that would begin a tag."""
    parts = re.split(r"(`[^`]*`)", " ".join(text.split()).replace("|", "\\|"))
    return "".join(part if part.startswith("`") else part.replace("<", "&lt;") for part in parts)


def code(names: Iterable[object]) -> str:
    """Names in code, with commas."""
    return ", ".join(f"`{name}`" for name in names)


def page(title: str, *parts: str) -> str:
    """A page with its title and the line that says how it is made."""
    made = "`python -m scripts.reference` writes this page from the code; do not edit it by hand."
    return "\n\n".join((f"# {title}", made, *(part for part in parts if part))) + "\n"


def field_docs(struct: type[msgspec.Struct]) -> dict[str, str]:
    """Field to its docstring, those of the bases included."""
    found: dict[str, str] = {}
    for kind in reversed(struct.__mro__):
        if not issubclass(kind, msgspec.Struct) or kind is msgspec.Struct:
            continue
        body = parsed(textwrap.dedent(inspect.getsource(kind))).body[0]
        assert isinstance(body, ast.ClassDef)
        for field, below in zip(body.body, body.body[1:], strict=False):
            if isinstance(field, ast.AnnAssign) and isinstance(below, ast.Expr) and isinstance(field.target, ast.Name):
                found[field.target.id] = str(ast.literal_eval(below.value))
    return found
