"""`drivemcp evaluate guard`: drive the cells that are not there, write the table."""

import argparse
import hashlib
import shlex
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path

import msgspec

from app.drive.screen import Screen
from evaluation.campaign.kept_outcomes import drive_missing, kept
from evaluation.campaign.machine import cores
from evaluation.campaign.pages import write_pages
from evaluation.guard import table
from evaluation.guard.beside import BESIDE, VERSION
from evaluation.guard.outcome import Outcome, cell_of, place_of, run_cell
from evaluation.guard.scenes import GROUNDS, SCENES, Ground, scenario
from evaluation.run.grant import EMERGENCY
from evaluation.run.spec import RunSpec, Sensors, run_key

SEEDS: Mapping[Sensors, int] = {"model": 20, "rendered": 3}
Place = tuple[str, int, Ground]


def evaluate_guard(flags: argparse.Namespace) -> int:
    """Drive, write; the exit status: 0 all runs are there, 1 some are missing."""
    return int(any(cell.missing or any(each.missing for each in cell.beside.values()) for cell in driven(flags)))


def driven(flags: argparse.Namespace) -> list[table.Cell]:
    """Drive, write; the cells."""
    screen, folder = Screen(), Path(flags.out) / "guard"
    runs = folder / "runs"
    runs.mkdir(parents=True, exist_ok=True)
    seeds = flags.seeds or (1 if flags.quick else SEEDS[flags.sensors])
    methods = (None, *BESIDE) if flags.beside else (None,)
    specs = {
        key_of(spec): spec
        for place in places(flags.quick)
        for method in methods
        for spec in specs_of(place, seeds, flags.sensors, method)
    }
    try:
        drive_missing(specs, runs, flags.jobs or cores(), screen, run_cell, _named)
    finally:
        cells = cells_of(specs, runs)
        _write(cells, folder, flags)
    missing = sum(cell.missing + sum(each.missing for each in cell.beside.values()) for cell in cells)
    screen.say(f"{len(specs) - missing} of {len(specs)} runs are there; {told(cells)}")
    sys.stdout.write(f"{folder / 'guard.html'}\n")
    return cells


def places(quick: bool) -> list[Place]:
    """The cells: each scene at its speeds; wet and with weak brakes those in which an impact threatens."""
    return [
        (scene.name, speed, ground)
        for scene in SCENES.values()
        for ground in (GROUNDS if scene.kind == "avoid" else GROUNDS[:1])
        for speed in (scene.quick if quick else scene.speeds)
        if not quick or ground == "dry" or (scene.name == "standing car" and speed in (40, 60))
    ]


def specs_of(place: Place, seeds: int, sensors: Sensors, method: str | None = None) -> list[RunSpec]:
    """The runs of a cell; `method`: of one of `BESIDE` in the arbiter's place."""
    scene, speed, _ = place
    seconds = round(SCENES[scene].seconds(speed / 3.6), 1)
    settings = {"simulator": {"driver": "absent"}}
    ours = RunSpec(scenario=place_of(*place), seconds=seconds, sensors=sensors, settings=settings)
    spec = ours if method is None else msgspec.structs.replace(ours, method=method)
    return [msgspec.structs.replace(spec, seed=seed) for seed in range(1, seeds + 1)]


def key_of(spec: RunSpec) -> str:
    """16 hex digits of the run, its scenario and its grant."""
    scene, speed, ground = cell_of(spec.scenario)
    plan = msgspec.json.encode([scenario(SCENES[scene], speed, ground), EMERGENCY], order="deterministic")
    governor = VERSION.encode() if spec.method in BESIDE else b""
    return hashlib.sha256(run_key(spec).encode() + plan + governor).hexdigest()[:16]


def _named(spec: RunSpec) -> str:
    return f"{spec.scenario.removeprefix('guard/')}, {spec.method}"


def cells_of(specs: Mapping[str, RunSpec], runs: Path) -> list[table.Cell]:
    """The cells of the runs, in the order of the runs."""
    found: dict[str, dict[str, list[Outcome | None]]] = {}
    for key, spec in specs.items():
        found.setdefault(spec.scenario, {}).setdefault(spec.method, []).append(kept(runs, key, Outcome))
    return [_cell(place, by_method) for place, by_method in found.items()]


def _cell(place: str, by_method: Mapping[str, Sequence[Outcome | None]]) -> table.Cell:
    there = {method: [each for each in found if each is not None] for method, found in by_method.items()}
    missing = {method: found.count(None) for method, found in by_method.items()}
    beside = {method: table.beside_of(there[method], missing[method]) for method in by_method if method in BESIDE}
    (ours,) = set(by_method) - set(beside)
    return table.cell_of(*cell_of(place), there[ours], missing[ours], beside)


def told(cells: Sequence[table.Cell]) -> str:
    """One line: what holds, and what does not."""
    asked = [cell for cell in cells if cell.verdict]
    fails = [
        f"{cell.scene}, {cell.ground}, {cell.speed_kmh} km/h: {cell.verdict}"
        for cell in asked
        if cell.verdict != "holds"
    ]
    return f"{len(asked) - len(fails)} of {len(asked)} cells hold" + (f"; not: {'; '.join(fails)}" if fails else "")


def command_line(flags: argparse.Namespace) -> str:
    """The command, without where it writes."""
    words = ["drivemcp", "evaluate", "guard", "--sensors", flags.sensors]
    words += ["--seeds", str(flags.seeds)] if flags.seeds else []
    words += ["--quick"] if flags.quick else []
    return shlex.join(words + (["--beside"] if flags.beside else []))


def _write(cells: Sequence[table.Cell], folder: Path, flags: argparse.Namespace) -> None:
    write_pages(
        folder, "guard", command_line(flags), flags, {"cells": cells}, table.as_csv(cells),
        templates=Path(__file__).parent, **table.values(cells),
    )  # fmt: skip
