"""The service table names every tool that a built-in service can offer: what it does not name, access control hides."""

import ast
from collections.abc import Iterator
from pathlib import Path

import pytest

import services
from proto.services import SERVICES, ServiceRow
from scripts.syntax import parsed

FOLDER = Path(services.__path__[0])


def offered(tree: ast.AST) -> Iterator[str]:
    """The functions that become tools, by `@node.tool(...)` or `node.tool(...)(self.function)`, whatever it takes to get there."""
    for node in ast.walk(tree):
        if isinstance(node, ast.FunctionDef) and any(map(makes_a_tool, node.decorator_list)):
            yield node.name
        if isinstance(node, ast.Call) and makes_a_tool(node.func):
            yield from (each.attr for each in node.args if isinstance(each, ast.Attribute))


def makes_a_tool(node: ast.expr) -> bool:
    return isinstance(node, ast.Call) and isinstance(node.func, ast.Attribute) and node.func.attr == "tool"


@pytest.mark.parametrize("row", SERVICES, ids=lambda row: row.name)
def test_the_table_names_the_tools_of_each_service(row: ServiceRow) -> None:
    files = sorted((FOLDER / row.name).rglob("*.py"))
    assert {tool for file in files for tool in offered(parsed(file.read_text(encoding="utf-8")))} == {*row.tools}
