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
from evaluation.isa import table, warnings
from evaluation.isa.accuracy import accuracy
from evaluation.isa.logs import UNTOLD, told_by
from evaluation.isa.table import Outcome
from evaluation.isa.warnings import WarningTest, of_truth, test_of
from evaluation.metrics.metrics import measure
from evaluation.metrics.record import Recorder
from evaluation.run.host import drive
from evaluation.run.spec import RunSpec, Sensors, run_key
from evaluation.scenarios import FAMILIES
from proto import topics
from proto.speed_assistance import SpeedAssistance

ROUTES = 4
"""A family."""
WARNS = "isa/warning/"


def evaluate_isa(flags: argparse.Namespace) -> int:
    """Drive or read logs, write; the exit status: 0 all runs are there, 1 some are missing."""
    if flags.log:
        return _of_logs(flags)
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
    return int(bool(missing))


def _of_logs(flags: argparse.Namespace) -> int:
    """The table of logs. Raises UserError naming a log that cannot be used."""
    folder = Path(flags.out) / "isa-logs"
    logs = {log: told_by(Path(log)) for log in flags.log}
    folder.mkdir(parents=True, exist_ok=True)
    found = table.log_rows(list(logs.values()))
    write_pages(
        folder, "logs", command_line(flags), flags, {"logs": logs}, table.rows_as_csv(found), templates=Path(__file__).parent,
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
    return driven + [_warning(test, flags.sensors) for test in tests]


def _warning(test: WarningTest, sensors: Sensors) -> RunSpec:
    settings = {"simulator": {"driver": "absent"}}
    return RunSpec(scenario=f"{WARNS}{test.name}", seconds=warnings.SECONDS, sensors=sensors, settings=settings)


def run_one(folder: str, key: str, spec: RunSpec) -> Outcome:
    """Drive one run, and keep its outcome as KEY.json in `folder`. Raises what `drive` raises."""
    recorder, told = Recorder(), list[tuple[int, SpeedAssistance]]()

    def observe(node: Node) -> None:
        recorder.follow(node)
        node.subscribe(topics.SPEED_ASSISTANCE, lambda message, info: told.append((info.stamp_ns, message)))

    with tempfile.TemporaryDirectory() as name:
        part = Path(name)
        if spec.scenario.startswith(WARNS):
            plan = warnings.scenario(test_of(spec.scenario.removeprefix(WARNS)))
            (file := part / f"{plan.name}.json").write_bytes(msgspec.json.encode(plan))
            drive(msgspec.structs.replace(spec, scenario=str(file)), part, observe)
        else:
            drive(spec, part, observe)
    record = recorder.record()
    start_ns = recorder.start_ns()
    found = Outcome(
        accuracy=accuracy(record),
        metrics=measure(record),
        warned=warnings.warned(
            of_truth(record.truths), [((stamp_ns - start_ns) / 1e9, each) for stamp_ns, each in told]
        ),
    )
    write_whole(Path(folder) / f"{key}.json", msgspec.json.encode(found))
    return found


def command_line(flags: argparse.Namespace) -> str:
    """The command, without where it writes."""
    if flags.log:
        return shlex.join(["drivemcp", "evaluate", "isa", *(word for log in flags.log for word in ("--log", log))])
    words = ["drivemcp", "evaluate", "isa", "--sensors", flags.sensors]
    words += ["--from", str(flags.first)] if flags.first else []
    words += ["--runs", str(flags.runs)] if flags.runs else []
    return shlex.join(words + (["--quick"] if flags.quick else []))


def _write(found: dict[str, Outcome], folder: Path, flags: argparse.Namespace) -> None:
    routes, tests = table.parts(found)
    write_pages(
        folder, "isa", command_line(flags), flags, {"runs": found}, table.as_csv(routes, tests),
        templates=Path(__file__).parent, rows=table.rows(routes, tests), tests=table.test_rows(tests),
    )  # fmt: skip
