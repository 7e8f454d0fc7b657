"""`drivemcp evaluate population`: drive the runs that are not there, write the table."""

import argparse
import hashlib
import shlex
import sys
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Literal, get_args

import msgspec

from app.drive.screen import Screen
from evaluation.campaign.kept_outcomes import drive_missing, kept
from evaluation.campaign.machine import cores
from evaluation.campaign.pages import write_pages
from evaluation.campaign.plan import TEST_SEED
from evaluation.campaign.plan import rows_of as rows_of_table
from evaluation.campaign.replacing import write_whole
from evaluation.population import table
from evaluation.population.outcome import Outcome, name_of, run_driver, window_of
from evaluation.population.windows import scenario_of, seed_of, windows
from evaluation.run.behaviour import behaviour
from evaluation.run.grant import EMERGENCY
from evaluation.run.spec import RunSpec, Sensors, run_key
from evaluation.scenarios import FAMILIES, generate
from services.simulator.driver.kinds import DriverKind

POPULATIONS: tuple[DriverKind, ...] = tuple(each for each in get_args(DriverKind) if each not in ("drawn", "obedient"))
WINDOWS = 16
Runs = Mapping[str, RunSpec]


def evaluate_population(flags: argparse.Namespace) -> int:
    """Drive, write; the exit status: 0 all runs are there, 1 some are missing."""
    screen, folder = Screen(), Path(flags.out) / "population"
    runs = folder / "runs"
    runs.mkdir(parents=True, exist_ok=True)
    granted = {key_of(spec): spec for spec in specs_of(flags, folder, screen)}
    jobs = flags.jobs or cores()
    try:
        drive_missing(granted, runs, jobs, screen, run_driver, _named)
        drive_missing(_all_alone(granted, runs), runs, jobs, screen, run_driver, _named)
    finally:
        rows = rows_of(granted, runs)
        _write(rows, folder, flags)
    missing = sum(row.missing for row in rows)
    screen.say("; ".join(f"{row.population}, {row.method}, {row.where}: {row.verdict}" for row in rows if row.verdict))
    sys.stdout.write(f"{folder / 'population.html'}\n")
    return int(bool(missing))


def specs_of(flags: argparse.Namespace, folder: Path, screen: Screen) -> list[RunSpec]:
    """The runs with the grant: of each population all windows, and all but the absent one so many kilometres of routes."""
    populations = tuple(flags.population) or (("absent",) if flags.by else POPULATIONS)
    at = _windows(1 if flags.quick else flags.windows or WINDOWS, folder, screen)
    places = [_at_window(*each, flags.sensors) for each in at]
    places += _routes(flags.km, flags.sensors, flags.first or 0) if flags.km else []
    return [
        _driven_by(population, spec)
        for place in places
        for spec in (_by_rows(flags.by, place) if flags.by else [place])
        for population in populations
        if population != "absent" or window_of(place.scenario) is not None
    ]


def _by_rows(name: Literal["delta", "ablation"], place: RunSpec) -> list[RunSpec]:
    """The place's run by each row of a table; feedback over runs needs drives one after another, and is left out."""
    rows = [row for row in rows_of_table(name, place.sensors) if not row.adapts]
    return [
        msgspec.structs.replace(
            row.spec, scenario=place.scenario, seed=place.seed, seconds=place.seconds, method=_label(name, row.label)
        )
        for row in rows
    ]


def _label(name: str, row: str) -> str:
    return f"Delta {row}" if name == "delta" else row


def _windows(count: int, folder: Path, screen: Screen) -> list[tuple[str, float]]:
    """Windows and when they end; found once by behaviour and number, since that takes minutes."""
    file = folder / f"windows-{count}-{hashlib.sha256(behaviour().encode()).hexdigest()[:8]}.json"
    found = kept(folder, file.stem, list[tuple[str, float]])
    if found is None:
        screen.say(f"looking for {count} windows in which a driver who does nothing hits somebody")
        found = [(name_of(window), end_s) for window, end_s in windows(count)]
        write_whole(file, msgspec.json.encode(found))
    return found


def _at_window(name: str, end_s: float, sensors: Sensors) -> RunSpec:
    window = window_of(name)
    assert window is not None
    return RunSpec(scenario=name, seed=seed_of(window.place), seconds=end_s, sensors=sensors)


def _routes(km: float, sensors: Sensors, first: int) -> Iterator[RunSpec]:
    driven_km, number = 0.0, first * len(FAMILIES)
    while driven_km < km:
        family = FAMILIES[number % len(FAMILIES)]
        place = number // len(FAMILIES)
        yield RunSpec(scenario=f"{family}/test/{place}", seed=TEST_SEED + place, sensors=sensors)
        driven_km += generate(family, place, "test").length_m / 1000.0
        number += 1


def _driven_by(population: DriverKind, spec: RunSpec) -> RunSpec:
    return msgspec.structs.replace(spec, settings={**spec.settings, "simulator": {"driver": population}})


def alone(spec: RunSpec, granted: Outcome) -> list[RunSpec]:
    """For each intervention the same run left without braking commands from its beginning on; of a route only so far as is judged."""
    whole = window_of(spec.scenario) is not None
    return [
        msgspec.structs.replace(
            spec,
            seconds=spec.seconds if whole else began_s + table.WITHIN_S,
            settings={**spec.settings, "simulator": {**spec.settings["simulator"], "brakes_until_s": began_s}},
        )
        for began_s in granted.interventions
    ]


def _all_alone(granted: Runs, runs: Path) -> dict[str, RunSpec]:
    there = ((spec, kept(runs, key, Outcome)) for key, spec in granted.items())
    return {key_of(each): each for spec, found in there if found is not None for each in alone(spec, found)}


def key_of(spec: RunSpec) -> str:
    """16 hex digits of the run, its scenario and its grant."""
    window = window_of(spec.scenario)
    plan = msgspec.json.encode([scenario_of(window) if window else None, EMERGENCY], order="deterministic")
    return hashlib.sha256(run_key(spec).encode() + plan).hexdigest()[:16]


def _named(spec: RunSpec) -> str:
    settings = spec.settings["simulator"]
    left = f", alone from {settings['brakes_until_s']:.1f} s" if "brakes_until_s" in settings else ""
    return f"{settings['driver']}, {spec.method}, {spec.scenario}{left}"


def rows_of(granted: Runs, runs: Path) -> list[table.Row]:
    """The rows of the runs."""
    found: dict[tuple[DriverKind, str, table.Where], list[table.Driven | None]] = {}
    for key, spec in granted.items():
        where: table.Where = "windows" if window_of(spec.scenario) is not None else "routes"
        row = spec.settings["simulator"]["driver"], spec.method, where
        found.setdefault(row, []).append(_driven(key, spec, runs))
    return [
        table.row_of(*row, [each for each in driven if each is not None], driven.count(None))
        for row, driven in found.items()
    ]


def _driven(key: str, spec: RunSpec, runs: Path) -> table.Driven | None:
    """None: the run, or one of those left alone, is not there."""
    granted = kept(runs, key, Outcome)
    if granted is None:
        return None
    left = [kept(runs, key_of(each), Outcome) for each in alone(spec, granted)]
    there = tuple(each for each in left if each is not None)
    return table.Driven(granted=granted, alone=there) if len(there) == len(left) else None


def command_line(flags: argparse.Namespace) -> str:
    """The command, without where it writes."""
    words = ["drivemcp", "evaluate", "population", "--sensors", flags.sensors]
    words += ["--quick"] if flags.quick else ["--windows", str(flags.windows or WINDOWS)]
    words += ["--km", f"{flags.km:g}"] if flags.km else []
    words += ["--from", str(flags.first)] if flags.first else []
    words += ["--by", flags.by] if flags.by else []
    return shlex.join(words + [word for each in flags.population for word in ("--population", each)])


def _write(rows: Sequence[table.Row], folder: Path, flags: argparse.Namespace) -> None:
    write_pages(
        folder, "population", command_line(flags), flags, {"rows": rows}, table.as_csv(rows),
        templates=Path(__file__).parent, **table.values(rows),
    )  # fmt: skip
