"""`drivemcp doctor`: what is missing on this machine, and what to type."""

import argparse
import ctypes.util
import importlib.util
import os
import platform
import shutil
import socket
import sys
from collections.abc import Callable, Iterator
from typing import NamedTuple

from drivemcp.commands import Subparsers
from drivemcp.errors import UserError
from drivemcp.paths import data, has_data

_MODULES = {
    "zenoh": "", "msgspec": "", "can": "can", "cantools": "can", "numpy": "perception", "cv2": "perception",
    "onnxruntime": "perception", "rank_bm25": "retrieval", "cryptography": "arbiter", "mcap": "logger", "rerun": "logger",
    "mcp": "gateway", "starlette": "cockpit", "highway_env": "simulator", "moderngl": "simulator",
}  # fmt: skip
_DATA = (
    "models/detector.onnx",
    "models/people.onnx",
    "models/signs.onnx",
    "models/lights.onnx",
    "models/reader.onnx",
    "models/weather.onnx",
    "vehicles/sim/sim.dbc",
    "rulepacks/DEU-v1",
    "scenarios/urb-rain.toml",
)
_OPENGL = "apt-get install -y libegl1 libgl1 libgl1-mesa-dri"


class Finding(NamedTuple):
    """One thing looked at: well or not, and what to type where it is not."""

    what: str
    well: bool
    remedy: str = ""
    needed: bool = True


def register(subparsers: Subparsers) -> None:
    """Add the command."""
    parser = subparsers.add_parser("doctor", help="what is missing on this machine, and what to type")
    parser.set_defaults(run=command)


def command(_: argparse.Namespace) -> int:
    """Look at everything; exit 1 when something needed is missing."""
    findings = [finding for check in _CHECKS for finding in check()]
    for finding in findings:
        mark = "ok  " if finding.well else ("MISS" if finding.needed else "note")
        sys.stdout.write(f"{mark}  {finding.what}{'' if finding.well else '   -> ' + finding.remedy}\n")
    missing = [finding for finding in findings if not finding.well and finding.needed]
    sys.stdout.write("all that a drive needs is here\n" if not missing else f"{len(missing)} things are missing\n")
    return 1 if missing else 0


def _python() -> Iterator[Finding]:
    yield Finding(f"Python {platform.python_version()}", sys.version_info >= (3, 11), "install Python 3.11 or newer")
    cores = os.cpu_count() or 1
    yield Finding(f"{cores} cores", cores >= 2, "real time wants two cores; use --lockstep or --headless", needed=False)


def _modules() -> Iterator[Finding]:
    for module, extra in _MODULES.items():
        found = importlib.util.find_spec(module) is not None
        yield Finding(
            f"module {module}", found, f"pip install 'drivemcp[{extra}]'" if extra else "pip install drivemcp"
        )


def _data() -> Iterator[Finding]:
    for name in _DATA:
        yield Finding(f"data {name}", has_data(name), "the installation is incomplete: install again")


def _rulepacks() -> Iterator[Finding]:
    """Whether the rulepacks of this installation are those that were shipped."""
    from services.rules.packs.loading import load  # cryptography and all packs: other commands would wait for it
    from services.rules.packs.pins import missing, pins, unlike_shipped

    wrong = list(missing())
    for name in pins():
        if has_data(f"rulepacks/{name}"):
            try:
                wrong += unlike_shipped([load(data(f"rulepacks/{name}")).manifest])
            except UserError as error:
                wrong.append(str(error))
    for line in wrong:
        yield Finding(f"rulepack {line}", False, "if you have not changed it: install again", needed=False)
    if not wrong:
        yield Finding(f"{len(pins())} rulepacks as they were shipped", True)


def _opengl() -> Iterator[Finding]:
    library = ctypes.util.find_library("EGL")
    yield Finding("EGL (software OpenGL for the cameras)", library is not None, _OPENGL)
    if library is not None and importlib.util.find_spec("moderngl") is not None:
        yield Finding("an OpenGL context", _context_opens(), _OPENGL)


def _context_opens() -> bool:
    import moderngl

    try:
        moderngl.create_context(standalone=True, backend="egl").release()  # type: ignore[arg-type]
    except Exception:  # noqa: BLE001 the driver may raise anything; whatever it is, there is no context
        return False
    return True


def _loopback() -> Iterator[Finding]:
    try:
        with socket.socket() as probe:
            probe.bind(("127.0.0.1", 0))
            well = True
    except OSError:
        well = False
    yield Finding("a free port on the loopback device", well, "check the machine's network set-up: ip link set lo up")


def _extras() -> Iterator[Finding]:
    yield Finding("docker", shutil.which("docker") is not None, "only for `docker compose up`", needed=False)
    espeak = shutil.which("espeak-ng") is not None
    yield Finding("espeak-ng (speech of this machine)", espeak, "apt-get install -y espeak-ng", needed=False)
    yield Finding(
        "rapidocr (town names)",
        importlib.util.find_spec("rapidocr") is not None,
        "pip install 'drivemcp[ocr]'",
        needed=False,
    )


_CHECKS: tuple[Callable[[], Iterator[Finding]], ...] = (
    _python, _modules, _data, _rulepacks, _opengl, _loopback, _extras,
)  # fmt: skip
