"""The wheel, installed alone in a fresh environment, drives; the evaluation comes as a wheel of its own. Takes minutes."""

import json
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]

pytestmark = pytest.mark.stack


def run(*command: str | Path, cwd: Path, status: int = 0, timeout_s: float = 900.0) -> subprocess.CompletedProcess[str]:
    ran = subprocess.run(command, cwd=cwd, capture_output=True, text=True, check=False, timeout=timeout_s)
    assert ran.returncode == status, ran.stdout[-2000:] + ran.stderr[-2000:]
    return ran


@pytest.fixture(scope="module")
def wheels(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("wheels")
    for project in (ROOT, ROOT / "evaluation"):
        run(sys.executable, "-m", "pip", "wheel", "-q", "--no-deps", "-w", folder, project, cwd=folder)
    return folder


def packages(wheel: Path) -> set[str]:
    with zipfile.ZipFile(wheel) as file:
        return {name.partition("/")[0] for name in file.namelist() if ".dist-info/" not in name}


def test_what_is_in_which_wheel(wheels: Path) -> None:
    (own,) = wheels.glob("drivemcp-[0-9]*.whl")
    (evaluation,) = wheels.glob("drivemcp_evaluation-*.whl")
    assert packages(own) == {"proto", "domain", "drivemcp", "services", "app"}
    assert packages(evaluation) == {"evaluation"}
    with zipfile.ZipFile(own) as file:
        licences = {name.rpartition("/")[2] for name in file.namelist() if ".dist-info/licenses/" in name}
    assert licences == {"LICENSE", "NOTICE"}


def test_the_wheel_alone_drives_five_seconds_and_says_what_evaluate_needs(wheels: Path, tmp_path: Path) -> None:
    run(sys.executable, "-m", "venv", tmp_path / "venv", cwd=tmp_path)
    tools = tmp_path / "venv" / "bin"
    (wheel,) = wheels.glob("drivemcp-[0-9]*.whl")
    run(tools / "pip", "install", "-q", f"{wheel}[demo]", cwd=tmp_path)
    drove = run(
        tools / "drivemcp",
        "up",
        "--scenario",
        "urb-rain",
        "--seconds",
        "5",
        "--lockstep",
        "--headless",
        "--json",
        cwd=tmp_path,
    )
    summary = json.loads(drove.stdout.splitlines()[-1])
    assert summary["log_verified"]
    assert summary["seconds"] >= 4.9
    assert summary["ticks"] > 40
    replayed = run(tools / "drivemcp", "replay", summary["log"], cwd=tmp_path)
    assert " 0 different" in replayed.stdout
    refused = run(tools / "drivemcp", "evaluate", "results", cwd=tmp_path, status=2)
    assert "drivemcp-evaluation" in refused.stderr
    assert "--corrupt" not in run(tools / "drivemcp", "up", "--help", cwd=tmp_path).stdout
