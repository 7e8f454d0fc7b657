"""Stand-ins for `run_one` that other processes can import."""

import os
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
    (Path(folder) / key).write_text(str(os.getpid()), encoding="utf-8")
