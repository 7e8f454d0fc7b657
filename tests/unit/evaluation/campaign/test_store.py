"""A run's key: of all that the run reads, and of nothing else."""

import os
import sys
from collections.abc import Iterator
from importlib.metadata import version
from pathlib import Path

import pytest

from evaluation.campaign import store
from evaluation.campaign.store import DATA, Store, world_digest, world_files
from evaluation.run import behaviour as locked
from evaluation.run.host import drive
from evaluation.run.spec import RunSpec, Sensors

ROOT = Path(__file__).parents[4]


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
    data = {path for path in there if path.is_relative_to(ROOT) and path.relative_to(ROOT).parts[0] in DATA}
    assert ROOT / "models/observed.json" in data
    assert data <= {path for _, path in world_files("model")}


def test_another_behaviour_gives_other_keys_and_an_absent_lock_the_version(
    world: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    found = set()
    for text in ("{}", '{"changed":1}'):
        (lock := tmp_path / "lock.json").write_text(text, encoding="utf-8")
        monkeypatch.setattr(locked, "LOCK", lock)
        locked.behaviour.cache_clear()
        found.add(key("model"))
    lock.unlink()
    locked.behaviour.cache_clear()
    assert locked.behaviour() == version("drivemcp")
    locked.behaviour.cache_clear()
    assert len(found) == 2
