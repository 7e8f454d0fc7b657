"""Runs one module of a package by its name in it: `python -m studies tracking`, `python -m training detector.train`."""

import pkgutil
import runpy
import sys
from collections.abc import Iterator
from pathlib import Path
from types import ModuleType

MARK = '\nif __name__ == "__main__":'


def run(package: ModuleType, arguments: list[str]) -> int:
    """Run the module that the first argument names; without one, list them. Returns the exit status of the list or of an unknown name."""
    found = dict(_runnable(package))
    if not arguments or arguments[0] in ("-h", "--help") or arguments[0] not in found:
        unknown = bool(arguments) and not arguments[0].startswith("-")
        out = sys.stderr if unknown else sys.stdout
        if unknown:
            out.write(f"{package.__name__}: there is no {arguments[0]!r}\n")
        out.write(f"usage: python -m {package.__name__} NAME ...\n")
        out.writelines(f"  {name:24} {what}\n" for name, what in found.items())
        return 2 if unknown or not arguments else 0
    name = arguments[0]
    sys.argv = [f"python -m {package.__name__} {name}", *arguments[1:]]
    runpy.run_module(f"{package.__name__}.{name}", run_name="__main__")
    return 0


def _runnable(package: ModuleType) -> Iterator[tuple[str, str]]:
    """Name and first line of the docstring of each package with a `__main__` and of each module that runs."""
    prefix = f"{package.__name__}."
    for info in pkgutil.walk_packages(package.__path__, prefix):
        module = Path(*info.name.split(".")).with_suffix(".py")
        file = Path(package.__path__[0]).parent / (module if not info.ispkg else module.with_suffix("") / "__main__.py")
        if file.name != "__main__.py" or info.ispkg:
            text = file.read_text(encoding="utf-8") if file.is_file() else ""
            if MARK in text:
                yield info.name.removeprefix(prefix), _first_line(text)


def _first_line(text: str) -> str:
    line = text.removeprefix('"""').partition("\n")[0].removesuffix('"""')
    return line.rpartition("`: ")[2] or line
