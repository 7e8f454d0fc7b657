"""A run's key: of all that the run reads, and of nothing else."""

import os
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from drivemcp.codehash import code_hash
from evaluation.evaluate import store
from evaluation.evaluate.store import GENERATORS, Store, world_digest, world_files
from evaluation.run.host import drive
from evaluation.run.spec import PACKAGES, RunSpec, Sensors

ROOT = Path(__file__).parents[4]
LOADED = """
import sys
from pathlib import Path
from evaluation.run.host import drive
from evaluation.run.spec import RunSpec
drive(RunSpec(scenario="cross-border/test/0", seconds=0.5, sensors=sys.argv[1]), Path(sys.argv[2]))
files = {name: getattr(module, "__file__", None) for name, module in sys.modules.items()}
ours = [name for name, file in files.items() if name.split(".")[0] in ("proto", "drivemcp", "services", "evaluation") and file]
print(*(name for name in ours if Path(files[name]).stat().st_size))
"""
"""Drives a run in a process of its own and prints the modules of ours that it loaded; empty ones say nothing."""


@pytest.fixture
def world(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """A small world of data in place of ours."""
    monkeypatch.setattr(store, "data", lambda name: tmp_path / "world" / name)
    for name in ("models/detector.onnx", "models/observed.json", "rulepacks/DEU-v1/manifest.json", "vehicles/dtc.toml"):
        (file := tmp_path / "world" / name).parent.mkdir(parents=True, exist_ok=True)
        file.write_text(name, encoding="utf-8")
    (tmp_path / "world" / "scenarios").mkdir()
    yield tmp_path / "world"
    world_digest.cache_clear()


def key(sensors: Sensors) -> str:
    world_digest.cache_clear()
    return Store(Path("nowhere")).key(RunSpec(scenario="urb-rain/test/0", sensors=sensors))


@pytest.mark.parametrize(
    ("name", "other"),
    [
        ("models/detector.onnx", {"rendered"}),
        ("models/observed.json", {"rendered", "model"}),
        ("models/another.json", {"rendered", "model"}),
        ("rulepacks/DEU-v1/manifest.json", {"rendered", "model"}),
        ("scenarios/new.toml", {"rendered", "model"}),
    ],
)
def test_a_file_is_part_of_the_keys_of_the_runs_that_read_it(world: Path, name: str, other: set[Sensors]) -> None:
    kinds: tuple[Sensors, ...] = ("rendered", "model")
    before = {sensors: key(sensors) for sensors in kinds}
    (world / name).write_text("changed", encoding="utf-8")
    assert {sensors for sensors in kinds if key(sensors) != before[sensors]} == other


def test_where_and_when_the_files_were_written_is_no_part_of_a_key(
    world: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    before = key("rendered")
    for file in world.rglob("*"):
        os.utime(file, (1.0, 1.0))
    moved = world.rename(world.with_name("elsewhere"))
    monkeypatch.setattr(store, "data", lambda name: moved / name)
    assert key("rendered") == before


def test_a_modelled_run_opens_no_data_but_what_is_in_its_key(tmp_path: Path) -> None:
    opened: set[Path] = set()
    listening = [True]

    def listen(event: str, arguments: tuple[object, ...]) -> None:
        if listening[0] and event == "open" and isinstance(arguments[0], str):
            opened.add(Path(arguments[0]).absolute())

    sys.addaudithook(listen)  # nobody can take it away again
    drive(RunSpec(scenario="cross-border/test/0", seconds=0.5, sensors="model"), tmp_path)
    listening[0] = False
    there = {path for path in opened if path.is_file() and "site-packages" not in path.parts}
    ours = {path for path in there if path.is_relative_to(ROOT)}
    data = {
        path for path in ours if path.relative_to(ROOT).parts[0] not in ("proto", "drivemcp", "services", "evaluation")
    }
    assert ROOT / "models/observed.json" in data
    assert data <= {path for _, path in world_files("model")}
    assert {path.suffix for path in ours - data} <= {".py", ".pyc", ".toml", ".json"}, "what a digest of code takes in"


@pytest.mark.parametrize("sensors", ["rendered", "model"])
def test_every_module_of_ours_that_a_run_loads_is_in_its_key(sensors: str, tmp_path: Path) -> None:
    done = subprocess.run(
        [sys.executable, "-c", LOADED, sensors, str(tmp_path)],
        capture_output=True,
        text=True,
        check=True,
        cwd=ROOT,
        timeout=300,
    )
    loaded = done.stdout.split()
    assert {"evaluation.run.host", "services.arbiter.service"} <= set(loaded)
    hashed = (*PACKAGES, *GENERATORS)
    assert [name for name in loaded if not any(f"{name}.".startswith(f"{each}.") for each in hashed)] == []


def test_settings_that_lie_beside_the_code_are_part_of_its_digest(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "some_service").mkdir()
    (tmp_path / "some_service" / "__init__.py").touch()
    (settings := tmp_path / "some_service" / "lambda.json").write_text("1", encoding="utf-8")
    monkeypatch.syspath_prepend(str(tmp_path))
    before = code_hash("some_service")
    settings.write_text("2", encoding="utf-8")
    code_hash.cache_clear()
    assert code_hash("some_service") != before
