"""Stand-ins for `run_one` that other processes can import."""

import os
import subprocess
import threading
from pathlib import Path

from drivemcp.errors import UserError
from evaluation.run.spec import RunSpec


def touch(folder: str, key: str, spec: RunSpec) -> None:
    """Leaves a file that names the process; the scenario says what goes wrong."""
    if spec.scenario == "crash":
        os._exit(9)
    if spec.scenario == "refuse":
        raise UserError("no such scenario")
    if spec.scenario == "bug":
        raise ZeroDivisionError("a bug")
    if spec.scenario == "stick":
        threading.Event().wait(600)
    if spec.scenario == "leave a child":
        child = subprocess.Popen(["sleep", "600"])
        (Path(folder) / f"{key}.child").write_text(str(child.pid), encoding="utf-8")
        os._exit(9)
    if spec.scenario == "die later":  # as something native that crashes once the run has ended
        threading.Thread(target=_die_once_heard, args=(Path(folder) / f"{key}.heard",), daemon=True).start()
    (Path(folder) / key).write_text(str(os.getpid()), encoding="utf-8")


def _die_once_heard(file: Path) -> None:
    while not file.exists():
        threading.Event().wait(0.01)
    os._exit(9)
