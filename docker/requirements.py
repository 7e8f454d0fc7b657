"""Splits pyproject.toml into one requirements file per extra and per shared layer: a layer changes only when its own list does.

`python3 requirements.py pyproject.toml FOLDER` writes FOLDER/base.txt, FOLDER/<extra>.txt and FOLDER/<layer>.txt, sorted.
"""

import re
import sys
import tomllib
from pathlib import Path

LAYERS = {
    "keys": ("cryptography",),
    "web": ("starlette", "uvicorn", "anyio"),
    "arrays": ("numpy",),
    "pictures": ("opencv-python-headless",),
    "networks": ("onnxruntime",),
}
"""The large packages of several services. A layer's file holds every line that an extra has on them: the version suits all."""
_NAME = re.compile(r"[A-Za-z0-9._-]+")
_OWN = re.compile(r"drivemcp\[([a-z0-9,-]+)\]")


def requirements(project: dict[str, object]) -> dict[str, list[str]]:
    """The requirements of the base and of every extra, without the base's; an extra named by another is put in its place."""
    extras: dict[str, list[str]] = project["optional-dependencies"]  # type: ignore[assignment]
    base: list[str] = project["dependencies"]  # type: ignore[assignment]
    return {"base": sorted(base), **{name: sorted(_expanded(name, extras)) for name in extras}}


def _expanded(name: str, extras: dict[str, list[str]]) -> set[str]:
    found: set[str] = set()
    for line in extras[name]:
        own = _OWN.fullmatch(line)
        if own is None:
            found.add(line)
        else:
            found.update(*(_expanded(other, extras) for other in own[1].split(",")))
    return found


def layers(lists: dict[str, list[str]]) -> dict[str, list[str]]:
    """What the shared layers hold, by what base and extras ask for."""
    lines = {line for asked in lists.values() for line in asked}
    return {layer: sorted(line for line in lines if name_of(line) in packages) for layer, packages in LAYERS.items()}


def name_of(line: str) -> str:
    """The package that a requirement is about."""
    found = _NAME.match(line)
    return found[0].lower() if found else ""


def main(project_file: str, folder: str) -> None:
    """Write the files."""
    project = tomllib.loads(Path(project_file).read_text(encoding="utf-8"))["project"]
    target = Path(folder)
    target.mkdir(parents=True, exist_ok=True)
    lists = requirements(project)
    for name, lines in {**lists, **layers(lists)}.items():
        (target / f"{name}.txt").write_text("".join(f"{line}\n" for line in lines), encoding="utf-8")


if __name__ == "__main__":
    main(*sys.argv[1:3])
