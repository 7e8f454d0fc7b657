"""`drivemcp up` and what it shares with `drivemcp play`: start, watch, stop, sum up, verify."""

import argparse
import shutil
import signal
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

import msgspec

from drivemcp.config import settings_of
from drivemcp.errors import UserError
from drivemcp.models import find_model
from drivemcp.node import Node
from drivemcp.numbers import number, port
from drivemcp.paths import data, has_data
from evaluation.corruption.hosted import hosts
from evaluation.corruption.record import CorruptionLog
from evaluation.corruption.spec import CLEAN, read_spec
from evaluation.drive.precheck import check_asked, check_faults, check_port, check_scenario, vehicle_of
from evaluation.drive.stack import Stack, StackPlan, folder_for
from evaluation.drive.summary import Summary, Tally
from evaluation.drive.words import live_line, spoken_line, summary_lines
from evaluation.run.start import start_settings
from proto import topics
from services.logger.commands import broken_links
from services.logger.verify import verify

LIVE_PERIOD_S = 0.25
ENDING = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)


def up(subparsers: "argparse._SubParsersAction[argparse.ArgumentParser]") -> None:
    """Add `drivemcp up`."""
    parser = subparsers.add_parser("up", help="start the whole stack and drive a scenario")
    parser.add_argument(
        "--scenario", default="urb-rain", metavar="NAME|FILE", help="urb-rain, cross-border, dynamic-vsl, or a file"
    )
    parser.add_argument("--seconds", type=number(1.0, 86_400.0), default=60.0)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument(
        "--fault",
        action="append",
        default=[],
        metavar="PRESET[:SEVERITY]@SECONDS",
        help="a fault of the car: low_tyre@10",
    )
    parser.add_argument("--lockstep", action="store_true", help="deterministic: the simulation waits for the stack")
    parser.add_argument(
        "--detector", default="", metavar="NAME|FILE", help="another detector than ours (drivemcp models list)"
    )
    add_common(parser)
    parser.set_defaults(run=command)


def add_common(parser: argparse.ArgumentParser) -> None:
    """Flags of every drive."""
    parser.add_argument("--headless", action="store_true", help="no web viewer; a recording beside the log instead")
    parser.add_argument("--keep", action="store_true", help="leave the stack up at the end, until Ctrl-C")
    parser.add_argument("--vehicle", default="", metavar="NAME", help="name on the bus; one of its own by default")
    parser.add_argument("--json", action="store_true", help="the summary as JSON, as the last line")
    parser.add_argument("--out", default="out", metavar="FOLDER", help="where logs go")
    parser.add_argument("--port", type=port, default=0, help="the router's port; a free one by default")
    parser.add_argument("--grant", default="", metavar="FILE", help="a signed grant to brake (drivemcp grant)")
    parser.add_argument("--trust", action="append", default=[], metavar="KEY", help="public key whose grants count")
    parser.add_argument(
        "--with", dest="extra", action="append", default=[], metavar="SERVICE", help="a third-party expert"
    )
    parser.add_argument("--without", action="append", default=[], metavar="SERVICE", help="leave a service out")
    parser.add_argument(
        "--set", action="append", default=[], metavar="SERVICE.KEY=VALUE", help="one setting of one service"
    )
    parser.add_argument(
        "--corrupt", default=CLEAN, metavar="SPEC|FILE.toml", help="miss signs, lose actors, ...: sign_miss=0.2,seed=3"
    )


def command(flags: argparse.Namespace) -> int:
    """Drive a scenario."""
    check_asked(flags)
    is_file = flags.scenario.endswith((".toml", ".json"))
    if not is_file and not has_data(f"scenarios/{flags.scenario}.toml"):
        raise UserError(
            f"no scenario {flags.scenario!r}; there are urb-rain, cross-border, dynamic-vsl, or give a FILE.toml or .json"
        )
    if is_file and not Path(flags.scenario).is_file():
        raise UserError(f"no such scenario file: {flags.scenario}")
    found = check_scenario(Path(flags.scenario) if is_file else data(f"scenarios/{flags.scenario}.toml"))
    flags.set = [*start_settings(found.country, found.driver_language), *flags.set]
    check_faults(flags.fault)
    if flags.detector:
        flags.set = [*flags.set, f"perception.detector={find_model(flags.detector)}"]
    name = Path(flags.scenario).stem
    scenario = str(Path(flags.scenario).resolve()) if is_file else flags.scenario
    source = {"scenario": scenario, "seed": flags.seed, "seconds": flags.seconds, "autostart": True}
    if flags.fault:
        source["faults"] = flags.fault
    return drive(flags, name, "simulator", source, lockstep=flags.lockstep)[0]


def drive(
    flags: argparse.Namespace,
    name: str,
    source: str,
    source_settings: dict[str, Any],
    *,
    lockstep: bool,
) -> tuple[int, Path]:
    """Start, watch, stop, sum up, verify. The status (0: well; 1: no log that verifies, or no drive to its end) and the folder."""
    stop = threading.Event()
    with _heeding_signals(stop):
        return _drive(flags, name, source, source_settings, lockstep, stop)


@contextmanager
def _heeding_signals(stop: threading.Event) -> Iterator[None]:
    """Ctrl-C, SIGTERM and a terminal that closes set `stop`. Under nohup the last stays ignored."""
    heeded = [number for number in ENDING if signal.getsignal(number) is not signal.SIG_IGN or number != signal.SIGHUP]
    previous = [(number, signal.signal(number, lambda *_: stop.set())) for number in heeded]
    try:
        yield
    finally:
        for number, handler in previous:
            signal.signal(number, handler)


def _drive(
    flags: argparse.Namespace, name: str, source: str, source_settings: dict[str, Any], lockstep: bool, stop: threading.Event,
) -> tuple[int, Path]:  # fmt: skip
    screen = Screen()
    settings = settings_of(flags.set)
    check_port(flags.port)
    vehicle = vehicle_of(flags)
    corruption = read_spec(flags.corrupt)
    settings[source] = {**source_settings, **settings.get(source, {})}
    settings["logger"] = {"view": {"mode": "file" if flags.headless else "web"}, **settings.get("logger", {})}
    if flags.grant:
        settings["arbiter"] = {"grant_file": str(Path(flags.grant).resolve()), **settings.get("arbiter", {})}
    plan = StackPlan(
        folder=folder_for(name, flags.out), source=source, settings=settings, common={"lockstep": lockstep, "trusted_keys": flags.trust},
        without=tuple(flags.without), extra=tuple(flags.extra), vehicle=vehicle, port=flags.port,
        hosts=hosts(corruption),
    )  # fmt: skip
    tally, corrupted = Tally(), CorruptionLog(Path(plan.folder)) if plan.hosts else None
    screen.say(f"starting the stack in {plan.folder}")
    with Stack(plan, screen.say, stop) as stack:
        node = stack.start()
        follow(node, tally)
        if corrupted is not None:
            corrupted.follow(node)
        if not stop.is_set():
            _watch(stack, tally, screen, stop, keep=flags.keep)
        restarts = stack.restarts()
    logs = _logs_of(Path(plan.folder))
    verified, complaint = _verify(logs)
    summary = tally.summary(restarts=restarts, log=str(logs[-1]) if logs else "", verified=verified)
    _print(summary, screen, as_json=flags.json)
    if corrupted is not None:
        screen.say(corrupted.line())
    if complaint:
        sys.stderr.write(f"drivemcp: the log does not verify: {complaint}\n")
    problem = tally.scenario.problem if tally.scenario is not None else ""
    if problem:
        sys.stderr.write(f"drivemcp: it ended before its time: {problem}\n")
    return 0 if verified and not problem else 1, Path(plan.folder)


def follow(node: Node, tally: Tally) -> None:
    """Add up what passes."""
    node.subscribe(topics.TRUTH, lambda message, _: tally.add_truth(message))
    node.subscribe(topics.ADVISORY, lambda message, _: tally.add_advisory(message))
    node.subscribe(topics.DECISION, lambda message, _: tally.add_decision(message))
    node.subscribe(topics.CALLS, lambda message, _: tally.add_calls(message))
    node.subscribe(topics.HEALTH, lambda message, _: tally.add_health(message))
    node.subscribe(topics.SCENARIO, lambda message, _: tally.add_scenario(message))


def _watch(stack: Stack, tally: Tally, screen: "Screen", stop: threading.Event, *, keep: bool) -> None:
    stack.wait_for_source()
    viewer, gateway = "", ""
    ended_s: float | None = None
    told = 0
    while not stop.wait(LIVE_PERIOD_S):
        if not viewer and tally.detail("logger", "viewer") not in ("unknown", ""):
            viewer = tally.detail("logger", "viewer")
            screen.say(f"live view: {viewer}")
        if not gateway and tally.detail("gateway", "mcp") not in ("unknown", ""):
            gateway = tally.detail("gateway", "mcp")
            screen.say(f"MCP gateway: {gateway}")
        for said in tally.spoken[told:]:
            screen.say(spoken_line(*said))
            told += 1
        screen.live(live_line(tally, screen.width()))
        if tally.ended and ended_s is None:
            ended_s = time.monotonic()
        if ended_s is not None and not keep and time.monotonic() - ended_s > 0.5:
            break
    screen.end_live()
    screen.say("stopping")


def _logs_of(folder: Path) -> list[Path]:
    return sorted((folder / "logs").glob("*.mcap"))


def _verify(logs: list[Path]) -> tuple[bool | None, str]:
    """Every file of the drive, and that each goes on from the one before; a restarted logger goes on in another file."""
    if not logs:
        return None, "no log was written; see the folder's log/logger.log"
    reports = [verify(log) for log in logs]
    for report in reports:
        if not report.intact:
            return False, f"{report.file}: {report.first_bad or 'an expected head is missing'}"
    broken = broken_links(reports)
    return not broken, "; ".join(broken)


def _print(summary: Summary, screen: "Screen", *, as_json: bool) -> None:
    for line in summary_lines(summary):
        screen.say(line)
    if as_json:
        sys.stdout.write(msgspec.json.encode(summary).decode() + "\n")
        sys.stdout.flush()


def time_left(done: int, total: int, began_s: float) -> str:
    """How long the rest will take by what was done since then (monotonic)."""
    left_s = (time.monotonic() - began_s) / max(1, done) * max(0, total - done)
    hours, minutes = int(left_s // 3600), left_s % 3600 / 60
    return f"about {f'{hours} h {minutes:.0f} min' if hours else f'{minutes:.1f} min'} left"


def _to_terminal(text: str) -> None:
    with suppress(OSError):  # a terminal that was closed; what there is to end is ended all the same
        sys.stderr.write(text)
        sys.stderr.flush()


class Screen:
    """A live line that is redrawn on a terminal, and printed now and then elsewhere."""

    def __init__(self, write: Callable[[str], object] | None = None) -> None:
        self._write = write if write is not None else _to_terminal
        self._tty = sys.stderr.isatty()
        self._last_s = 0.0
        self._drawn = 0
        self._lock = threading.Lock()

    def say(self, text: str) -> None:
        """A line that stays."""
        with self._lock:
            self._clear()
            self._write(text + "\n")

    def live(self, text: str) -> None:
        """The live line."""
        now_s = time.monotonic()
        with self._lock:
            if self._tty:
                self._clear()
                self._write(text)
                self._drawn = len(text)
            elif now_s - self._last_s >= 5.0:
                self._last_s = now_s
                self._write(text + "\n")

    def width(self) -> int:
        """Columns that a line may take."""
        return max(40, shutil.get_terminal_size((160, 24)).columns - 1)

    def end_live(self) -> None:
        """Leave the live line where it is."""
        with self._lock:
            if self._drawn:
                self._write("\n")
                self._drawn = 0

    def _clear(self) -> None:
        if self._drawn:
            self._write("\r" + " " * self._drawn + "\r")
            self._drawn = 0
