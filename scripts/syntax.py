"""Python source as a syntax tree."""

from __future__ import annotations

import ast
import gc


def parsed(source: str) -> ast.Module:
    """The tree of a module's source. Raises SyntaxError.

    No garbage is collected meanwhile: before 3.11.8 CPython counts the depth of one tree for the whole process, and whatever is
    parsed by a finaliser or by a thread that runs during one makes it raise SystemError (gh-106905).
    """
    collects = gc.isenabled()
    gc.disable()
    try:
        return ast.parse(source)
    finally:
        if collects:
            gc.enable()
