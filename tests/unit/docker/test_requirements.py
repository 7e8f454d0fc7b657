"""Requirements by extra: what a layer of third-party packages is made from."""

import runpy
import subprocess
import sys
from pathlib import Path
from typing import Any

SCRIPT = Path(__file__).parents[3] / "docker/requirements.py"
MODULE: dict[str, Any] = runpy.run_path(str(SCRIPT))
split: Any = MODULE["requirements"]


def test_an_extra_named_by_another_is_put_in_its_place() -> None:
    project = {
        "dependencies": ["b", "a"],
        "optional-dependencies": {"one": ["x>=2"], "two": ["drivemcp[one]", "y"], "all": ["drivemcp[one,two]", "x>=2"]},
    }
    assert split(project) == {"base": ["a", "b"], "one": ["x>=2"], "two": ["x>=2", "y"], "all": ["x>=2", "y"]}


def test_a_shared_layers_version_suits_all_that_ask_for_it() -> None:
    lists = {"base": ["b"], "one": ["opencv-python-headless>=4.10"], "two": ["opencv-python-headless>=5", "numpy>=2"]}
    layers = MODULE["layers"](lists)
    assert layers["pictures"] == ["opencv-python-headless>=4.10", "opencv-python-headless>=5"]
    assert layers["arrays"] == ["numpy>=2"]
    assert layers["networks"] == []


def test_the_projects_own_lists_are_written_a_file_for_each(tmp_path: Path) -> None:
    project = SCRIPT.parents[1] / "pyproject.toml"
    subprocess.run([sys.executable, str(SCRIPT), str(project), str(tmp_path)], check=True, timeout=20)
    can = (tmp_path / "can.txt").read_text(encoding="utf-8").split()
    assert any(line.startswith("cantools") for line in can)
    assert not any("drivemcp[" in path.read_text(encoding="utf-8") for path in tmp_path.iterdir())
