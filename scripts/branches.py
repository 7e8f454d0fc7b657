"""Branches per 100 code lines of folders of Python: `python scripts/branches.py services/orchestrator --functions 10`.

A branch is an `if`, `elif`, `for`, `while`, `except` or `case`, an operand of `and` or `or` beyond the first, a conditional
expression, or a condition of a comprehension. A code line holds code: blank lines, comments and docstrings do not count.
"""

import argparse
import ast
import io
import sys
import tokenize
from collections.abc import Iterator, Sequence
from importlib.util import find_spec
from pathlib import Path
from typing import NamedTuple

from scripts.syntax import parsed

SINGLE = (ast.If, ast.IfExp, ast.For, ast.AsyncFor, ast.While, ast.ExceptHandler, ast.match_case)
FUNCTIONS = (ast.FunctionDef, ast.AsyncFunctionDef)
LAYOUT = {
    tokenize.COMMENT,
    tokenize.NL,
    tokenize.NEWLINE,
    tokenize.INDENT,
    tokenize.DEDENT,
    tokenize.ENCODING,
    tokenize.ENDMARKER,
}
HEADER = ("folder", "lines", "code lines", "branches", "per 100")


class Count(NamedTuple):
    """What a folder holds."""

    lines: int = 0
    code_lines: int = 0
    branches: int = 0

    @property
    def per_100(self) -> float:
        """Branches per 100 code lines."""
        return 100 * self.branches / self.code_lines if self.code_lines else 0.0

    def plus(self, other: "Count") -> "Count":
        """Both together."""
        return Count(self.lines + other.lines, self.code_lines + other.code_lines, self.branches + other.branches)


class Function(NamedTuple):
    """A function and its own branches; a function inside it counts for itself."""

    branches: int
    name: str
    file: Path
    line: int


def branches(node: ast.AST) -> int:
    """The branches that one node of the syntax tree adds."""
    if isinstance(node, ast.BoolOp):
        return len(node.values) - 1
    if isinstance(node, ast.comprehension):
        return len(node.ifs)
    return int(isinstance(node, SINGLE))


def code_lines(source: str) -> int:
    """The lines that hold code."""
    held: set[int] = set()
    for token in tokenize.generate_tokens(io.StringIO(source).readline):
        if token.type not in LAYOUT:
            held.update(range(token.start[0], token.end[0] + 1))
    for node in ast.walk(parsed(source)):
        if isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant) and isinstance(node.value.value, str):
            held.difference_update(range(node.lineno, (node.end_lineno or node.lineno) + 1))
    lines = source.splitlines()
    return sum(bool(lines[at - 1].strip()) for at in held)


def count(source: str) -> Count:
    """One module."""
    found = sum(map(branches, ast.walk(parsed(source))))
    return Count(len(source.splitlines()), code_lines(source), found)


def functions(source: str, file: Path) -> Iterator[Function]:
    """All functions and methods of a module."""
    for node in ast.walk(parsed(source)):
        if isinstance(node, FUNCTIONS):
            yield Function(sum(map(branches, _own(node))), node.name, file, node.lineno)


def _own(node: ast.AST) -> Iterator[ast.AST]:
    for child in ast.iter_child_nodes(node):
        if not isinstance(child, FUNCTIONS):
            yield child
            yield from _own(child)


def files(folder: Path) -> list[Path]:
    """The Python files below a folder; a file stands for itself."""
    return sorted(folder.rglob("*.py")) if folder.is_dir() else [folder]


def of_folder(folder: Path) -> Count:
    """All modules of a folder together."""
    total = Count()
    for file in files(folder):
        total = total.plus(count(file.read_text(encoding="utf-8")))
    return total


def installed(package: str) -> Path:
    """Where an installed package lies. Raises SystemExit where it is not installed."""
    spec = find_spec(package)
    if spec is None or not spec.submodule_search_locations:
        raise SystemExit(f"{package} is not an installed package")
    return Path(spec.submodule_search_locations[0])


def table(rows: Sequence[Sequence[str]]) -> str:
    """Aligned columns: the first to the left, the others to the right."""
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    return "\n".join(
        "  ".join([row[0].ljust(widths[0]), *(c.rjust(w) for c, w in zip(row[1:], widths[1:], strict=True))])
        for row in rows
    )


def main(arguments: Sequence[str] | None = None) -> None:
    """Print the table, and the functions with most branches where they are asked for."""
    parser = argparse.ArgumentParser(prog="scripts/branches.py", description=__doc__)
    parser.add_argument("folders", type=Path, nargs="+")
    parser.add_argument("--functions", type=int, default=0, metavar="N", help="the N functions with most branches")
    parser.add_argument("--beside", default=[], nargs="+", metavar="PACKAGE", help="installed packages to compare with")
    flags = parser.parse_args(arguments)
    missing = [str(folder) for folder in flags.folders if not folder.exists()]
    if missing:
        parser.error(f"not there: {', '.join(missing)}")
    counts = {str(folder): of_folder(folder) for folder in flags.folders}
    counts |= {package: of_folder(installed(package)) for package in flags.beside}
    rows = [(name, *map(str, each), f"{each.per_100:.1f}") for name, each in counts.items()]
    sys.stdout.write(table([HEADER, *rows]) + "\n")
    if flags.functions:
        every = dict.fromkeys(file for folder in flags.folders for file in files(folder))
        found = [each for file in every for each in functions(file.read_text(encoding="utf-8"), file)]
        worst = sorted(found, key=lambda each: (-each.branches, str(each.file), each.line))[: flags.functions]
        sys.stdout.write("".join(f"{each.branches:4}  {each.file}:{each.line}  {each.name}\n" for each in worst))


if __name__ == "__main__":
    main()
