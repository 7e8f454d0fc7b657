"""Bills of materials (CycloneDX 1.6, JSON): what an environment holds that has the wheel with one extra."""

import os
import subprocess
from pathlib import Path

from proto.services import SERVICES
from scripts.release.environments import made, run

SETS = ("", *sorted({row.extra for row in SERVICES}), "demo")
"""Extras; empty: the core alone, which the router needs."""


def bill(extra: str, wheel: Path, python: Path, tools: Path, out: Path, folder: Path, stamp: str) -> Path:
    """Write sbom-SET.cdx.json, validated; `stamp`: seconds since 1970 that it bears. Raises RuntimeError where pip or the tool fail."""
    inside = made(python, folder / "venv")
    run([inside, "-m", "pip", "install", "-q", f"{wheel}[{extra}]" if extra else wheel], folder)
    run([inside, "-m", "pip", "uninstall", "-q", "-y", "pip", "setuptools"], folder)
    file = out / f"sbom-{extra or 'core'}.cdx.json"
    environment = os.environ | {"SOURCE_DATE_EPOCH": stamp}
    command: list[str | Path] = [
        tools / "cyclonedx-py", "environment", "--pyproject", Path("pyproject.toml").resolve(), "--output-reproducible",
        "--validate", "--spec-version", "1.6", "--output-file", file, inside,
    ]  # fmt: skip
    subprocess.run(command, env=environment, check=True)
    return file
