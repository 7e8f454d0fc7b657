"""Fresh environments: which Pythons are here, and whether the distributions install and drive in them, outside the repository."""

import json
import os
import subprocess
import sys
import time
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import NamedTuple

VERSIONS = ("3.11", "3.12", "3.13")
"""Those that pyproject.toml's classifiers name."""
SECONDS = 20


class Tried(NamedTuple):
    """What came of a distribution on one Python."""

    python: str
    distribution: str
    install_s: float
    ticks: int
    log: str
    """Of the drive; `drivemcp audit verify` has taken it."""


def interpreter(version: str) -> Path | None:
    """A Python of that version on this machine; `None` without one."""
    return next((path for path in _candidates(version) if _is(path, version)), None)


def _candidates(version: str) -> Iterator[Path]:
    yield Path(sys.executable)
    yield from (Path(folder) / f"python{version}" for folder in os.environ.get("PATH", "").split(os.pathsep))
    yield from sorted(
        Path(os.environ.get("PYENV_ROOT", Path.home() / ".pyenv")).glob(f"versions/{version}.*/bin/python")
    )


def _is(path: Path, version: str) -> bool:
    """A shim without its Python is there, and fails."""
    if not path.is_file():
        return False
    asked = "import sys; print('%d.%d' % sys.version_info[:2])"
    ran = subprocess.run([path, "-c", asked], capture_output=True, text=True, check=False)
    return ran.stdout.strip() == version


def made(python: Path, folder: Path) -> Path:
    """An empty environment's interpreter."""
    run([python, "-m", "venv", "--clear", folder], folder.parent)
    return folder / "bin" / "python"


def tried(version: str, python: Path, distribution: Path, folder: Path, *, alone: bool = False) -> Tried:
    """Install a distribution, drive, verify the log. `alone`: in the environment that is there, in place of what was installed."""
    folder.mkdir(parents=True, exist_ok=True)
    inside = folder / "venv" / "bin" / "python" if alone else made(python, folder / "venv")
    began_s = time.monotonic()
    pip: list[str | Path] = [inside, "-m", "pip", "install", "-q", "--disable-pip-version-check"]
    run([*pip, "--force-reinstall", "--no-deps", distribution] if alone else [*pip, f"{distribution}[demo]"], folder)
    install_s = time.monotonic() - began_s
    console = inside.with_name("drivemcp")
    asked = ["up", "--scenario", "urb-rain", "--seconds", str(SECONDS), "--headless", "--json"]
    told = json.loads(run([console, *asked], folder).splitlines()[-1])
    if told["seconds"] < SECONDS - 0.2:  # two ticks
        raise RuntimeError(
            f"{distribution.name} on Python {version}: the drive ended after {told['seconds']:.1f} s of {SECONDS}"
        )
    run([console, "audit", "verify", told["log"]], folder)
    return Tried(version, distribution.name, install_s, told["ticks"], told["log"])


def run(command: Sequence[str | Path], folder: Path) -> str:
    """What the command prints; nothing of the repository is importable. Raises RuntimeError with the end of its output."""
    environment = {name: value for name, value in os.environ.items() if name != "PYTHONPATH"}
    ran = subprocess.run(command, cwd=folder, env=environment, capture_output=True, text=True, check=False)
    if ran.returncode != 0:
        raise RuntimeError(
            f"{' '.join(map(str, command))} ended with {ran.returncode}:\n{(ran.stdout + ran.stderr)[-3000:]}"
        )
    return ran.stdout
