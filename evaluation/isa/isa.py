"""`drivemcp evaluate isa`: drive the routes and warning tests that are not there, write the table."""

import argparse
import shlex
import sys
import tempfile
from pathlib import Path

import msgspec

from app.drive.screen import Screen
from drivemcp.node import Node
from evaluation.campaign.kept_outcomes import drive_missing, kept
from evaluation.campaign.machine import cores
from evaluation.campaign.names import QUICK_S
from evaluation.campaign.pages import write_pages
from evaluation.campaign.plan import TEST_SEED
from evaluation.campaign.replacing import write_whole
from evaluation.isa import capabilities, table, warnings
from evaluation.isa.accuracy import accuracy
from evaluation.isa.capabilities import DRIVES
from evaluation.isa.logs import UNTOLD, told_by
from evaluation.isa.table import LIMITS, WARNS, Outcome
from evaluation.isa.warnings import WarningTest, of_truth, test_of
from evaluation.metrics.metrics import measure
from evaluation.metrics.record import Recorder
from evaluation.run.host import drive
from evaluation.run.spec import RunSpec, Sensors, run_key
from evaluation.scenarios import FAMILIES
from proto import topics
from proto.speed_assistance import SpeedAssistance
from services.simulator.scenario.plan import Scenario

ABSENT = {"simulator": {"driver": "absent"}}
ROUTES = 4
"""A family."""


def evaluate_isa(flags: argparse.Namespace) -> int:
    """Drive or read logs, write; the exit status: 0 all runs are there, 1 some are missing."""
    return _of_logs(flags) if flags.log else driven(flags)[0]


def driven(flags: argparse.Namespace) -> tuple[int, list[table.Row]]:
    """Drive the runs that are not there, write; the exit status, and the table's rows."""
    screen, folder = Screen(), Path(flags.out) / "isa"
    runs = folder / "runs"
    runs.mkdir(parents=True, exist_ok=True)
    specs = {run_key(spec): spec for spec in specs_of(flags)}
    try:
        drive_missing(specs, runs, flags.jobs or cores(), screen, run_one, lambda spec: spec.scenario)
    finally:
        found = {spec.scenario: kept(runs, key, Outcome) for key, spec in specs.items()}
        there = {name: each for name, each in found.items() if each is not None}
        _write(there, folder, flags)
    missing = len(found) - len(there)
    screen.say(f"{len(there)} of {len(found)} runs are there; {table.told(there)}")
    sys.stdout.write(f"{folder / 'isa.html'}\n")
    return int(bool(missing)), table.rows(*table.parts(there))


def _of_logs(flags: argparse.Namespace) -> int:
    """The table of logs. Raises UserError naming a log that cannot be used."""
    folder = Path(flags.out) / "isa-logs"
    logs = {log: told_by(Path(log)) for log in flags.log}
    folder.mkdir(parents=True, exist_ok=True)
    found = table.log_rows(list(logs.values()))
    write_pages(
        folder, "logs", command_line(flags), flags, {"logs": logs}, table.as_csv(found), templates=Path(__file__).parent,
        rows=found, overs=table.over_rows(logs), untold=[log for log, each in logs.items() if each.accuracy is None], without=UNTOLD,
    )  # fmt: skip
    Screen().say("; ".join(f"{what}: {value}" for what, value, _ in found))
    sys.stdout.write(f"{folder / 'logs.html'}\n")
    return 0


def specs_of(flags: argparse.Namespace) -> list[RunSpec]:
    """Routes of each family from `--from` on, then the warning tests."""
    first, routes = flags.first or 0, 1 if flags.quick else flags.runs or ROUTES
    seconds = QUICK_S if flags.quick else 0.0
    driven = [
        RunSpec(scenario=f"{family}/test/{number}", seed=TEST_SEED + number, seconds=seconds, sensors=flags.sensors)
        for number in range(first, first + routes)
        for family in FAMILIES
    ]
    tests = warnings.TESTS[-1:] if flags.quick else warnings.TESTS
    limits = list(DRIVES)[:1] if flags.quick else DRIVES
    return [
        *driven,
        *(_warning(test, flags.sensors) for test in tests),
        *(_past(name, flags.sensors) for name in limits),
    ]


def _past(name: str, sensors: Sensors) -> RunSpec:
    return RunSpec(scenario=f"{LIMITS}{name}", seconds=capabilities.SECONDS, sensors=sensors, settings=ABSENT)


def _warning(test: WarningTest, sensors: Sensors) -> RunSpec:
    return RunSpec(scenario=f"{WARNS}{test.name}", seconds=warnings.SECONDS, sensors=sensors, settings=ABSENT)


def run_one(folder: str, key: str, spec: RunSpec) -> Outcome:
    """Drive one run, and keep its outcome as KEY.json in `folder`. Raises what `drive` raises."""
    recorder, told = Recorder(), list[tuple[int, SpeedAssistance]]()

    def observe(node: Node) -> None:
        recorder.follow(node)
        node.subscribe(topics.SPEED_ASSISTANCE, lambda message, info: told.append((info.stamp_ns, message)))

    with tempfile.TemporaryDirectory() as name:
        part = Path(name)
        if (plan := _plan(spec.scenario)) is not None:
            (file := part / f"{plan.name}.json").write_bytes(msgspec.json.encode(plan))
            drive(msgspec.structs.replace(spec, scenario=str(file)), part, observe)
        else:
            drive(spec, part, observe)
    record = recorder.record()
    start_ns = recorder.start_ns()
    found = Outcome(
        accuracy=accuracy(record),
        metrics=measure(record),
        understood=spec.scenario.startswith(LIMITS) and capabilities.understood(record),
        warned=warnings.warned(
            of_truth(record.truths), [((stamp_ns - start_ns) / 1e9, each) for stamp_ns, each in told]
        ),
    )
    write_whole(Path(folder) / f"{key}.json", msgspec.json.encode(found))
    return found


def _plan(name: str) -> Scenario | None:
    """The scenario of a warning test or of a special limit; None: a route has its own."""
    if name.startswith(WARNS):
        return warnings.scenario(test_of(name.removeprefix(WARNS)))
    return capabilities.scenario(name.removeprefix(LIMITS)) if name.startswith(LIMITS) else None


def command_line(flags: argparse.Namespace) -> str:
    """The command, without where it writes."""
    if flags.log:
        return shlex.join(["drivemcp", "evaluate", "isa", *(word for log in flags.log for word in ("--log", log))])
    words = ["drivemcp", "evaluate", "isa", "--sensors", flags.sensors]
    words += ["--from", str(flags.first)] if flags.first else []
    words += ["--runs", str(flags.runs)] if flags.runs else []
    return shlex.join(words + (["--quick"] if flags.quick else []))


def _write(found: dict[str, Outcome], folder: Path, flags: argparse.Namespace) -> None:
    routes, tests, limits = table.parts(found)
    rows = table.rows(routes, tests, limits)
    write_pages(
        folder, "isa", command_line(flags), flags, {"runs": found}, table.as_csv(rows),
        templates=Path(__file__).parent, rows=rows, tests=table.test_rows(tests),
    )  # fmt: skip
