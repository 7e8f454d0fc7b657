"""What every drive does, of a scenario or of a recording: start, watch, stop, sum up, verify."""

import argparse
import signal
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import msgspec

from app.drive.log_state import state_of
from app.drive.options import options
from app.drive.precheck import check_port, check_voice, trusted, vehicle_of
from app.drive.screen import Screen
from app.drive.stack import Stack, StackPlan, folder_for
from app.drive.summary import Summary, Tally
from app.drive.words import end_line, live_line, spoken_line, summary_lines
from app.replay.again import AtHand
from app.report.command import write_report
from drivemcp.config import settings_of
from drivemcp.files.modes import others_denied
from drivemcp.node import Node
from drivemcp.numbers import port
from drivemcp.paths import own_state
from drivemcp.runtime.supervisor import free_port
from proto import topics

LIVE_PERIOD_S = 0.25
ENDING = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)


def add_common(parser: argparse.ArgumentParser) -> None:
    """Flags of every drive."""
    parser.add_argument("--headless", action="store_true", help="no web viewer; a recording beside the log instead")
    parser.add_argument(
        "--speak", action="store_true", help="speak aloud on this machine (espeak-ng, or cockpit.speech_command)"
    )
    parser.add_argument("--report", action="store_true", help="write the drive's report at the end (drivemcp report)")
    parser.add_argument("--keep", action="store_true", help="leave the stack up at the end, until Ctrl-C")
    parser.add_argument("--vehicle", default="", metavar="NAME", help="name on the bus; one of its own by default")
    parser.add_argument("--json", action="store_true", help="the summary as JSON, as the last line")
    parser.add_argument("--out", default="out", metavar="FOLDER", help="where logs go")
    parser.add_argument("--port", type=port, default=0, help="the router's port; a free one by default")
    parser.add_argument("--grant", default="", metavar="FILE", help="a signed grant to brake (drivemcp grant)")
    parser.add_argument(
        "--trust", action="append", default=[], metavar="KEY|FILE",
        help="public key whose grants count; or a file of them, where a key that is taken out ends its grants at once",
    )  # fmt: skip
    parser.add_argument(
        "--with", dest="extra", action="append", default=[], metavar="SERVICE", help="a third-party expert"
    )
    parser.add_argument("--without", action="append", default=[], metavar="SERVICE", help="leave a service out")
    parser.add_argument(
        "--set", action="append", default=[], metavar="SERVICE.KEY=VALUE", help="one setting of one service"
    )
    for option in options():
        option.add_flag(parser)


def drive(
    flags: argparse.Namespace,
    name: str,
    source: str,
    source_settings: dict[str, Any],
    *,
    lockstep: bool,
) -> tuple[int, Path]:
    """Start, watch, stop, sum up, verify. The status (0: well; 1: no whole log that verifies, or no drive to its end) and the folder."""
    stop = threading.Event()
    with _heeding_signals(stop), others_denied():
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
    asked = [(option, hosts) for option in options() if (hosts := option.hosts(flags))]
    settings[source] = {**source_settings, **settings.get(source, {})}
    settings["logger"] = {"view": {"mode": "file" if flags.headless else "web"}, **settings.get("logger", {})}
    # a port that stays, so that a page finds a cockpit that was started again
    settings["cockpit"] = {"port": free_port(), "speak": flags.speak, **settings.get("cockpit", {})}
    if settings["cockpit"]["speak"]:
        check_voice(settings["cockpit"])
    if flags.grant:
        settings["arbiter"] = {
            "grant_file": str(Path(flags.grant).resolve()), "grant_memory": str(own_state("ended-grants.json")),
            **settings.get("arbiter", {}),
        }  # fmt: skip
    keys, keys_file = trusted(flags.trust)
    plan = StackPlan(
        folder=folder_for(name, flags.out), source=source, settings=settings,
        common={"lockstep": lockstep, "trusted_keys": keys, "trusted_keys_file": keys_file},
        without=tuple(flags.without), extra=tuple(flags.extra), vehicle=vehicle, port=flags.port,
        hosts={name: run for _, hosts in asked for name, run in hosts.items()},
    )  # fmt: skip
    tally, closing = Tally(), []
    screen.say(f"starting the stack in {plan.folder}")
    with Stack(plan, screen.say, stop) as stack:
        node = stack.start()
        follow(node, tally)
        closing = [option.follow(node, Path(plan.folder)) for option, _ in asked]
        if not stop.is_set():
            _watch(stack, tally, screen, stop, keep=flags.keep)
        restarts = stack.restarts()
    logs = _logs_of(Path(plan.folder))
    health = tally.health.get("logger")
    state = state_of(logs, health.detail if health is not None else {})
    summary = tally.summary(
        restarts=restarts, log=str(logs[-1]) if logs else "", verified=state.verified, lost=state.lost,
        unstamped=state.unstamped, trouble=state.trouble,
    )  # fmt: skip
    _print(summary, screen, as_json=flags.json)
    for line in closing:
        screen.say(line())
    if flags.report and logs:
        screen.say(f"report: {write_report(logs, None, AtHand())}")
    if state.complaint:
        sys.stderr.write(f"drivemcp: the log does not verify: {state.complaint}\n")
    if state.trouble:
        sys.stderr.write(f"drivemcp: the log is not whole: {state.trouble}\n")
    problem = tally.scenario.problem if tally.scenario is not None else ""
    if problem:
        sys.stderr.write(f"drivemcp: the drive is not whole: {problem}\n")
    return 0 if state.whole and not problem else 1, Path(plan.folder)


def follow(node: Node, tally: Tally) -> None:
    """Add up what passes."""
    node.subscribe(topics.TRUTH, lambda message, _: tally.add_truth(message))
    node.subscribe(topics.ADVISORY, lambda message, _: tally.add_advisory(message))
    node.subscribe(topics.DECISION, lambda message, _: tally.add_decision(message))
    node.subscribe(topics.CALLS, lambda message, _: tally.add_calls(message))
    node.subscribe(topics.HEALTH, lambda message, _: tally.add_health(message))
    node.subscribe(topics.SCENARIO, lambda message, _: tally.add_scenario(message))


def _watch(stack: Stack, tally: Tally, screen: Screen, stop: threading.Event, *, keep: bool) -> None:
    stack.wait_for_source()
    faces = {("logger", "viewer"): "live view", ("cockpit", "page"): "cockpit", ("gateway", "mcp"): "MCP gateway"}
    ended_s: float | None = None
    told = 0
    while not stop.wait(LIVE_PERIOD_S):
        for face in [face for face in faces if tally.detail(*face) not in ("unknown", "")]:
            screen.say(f"{faces.pop(face)}: {tally.detail(*face)}")
        for said in tally.spoken[told:]:
            screen.say(spoken_line(*said))
            told += 1
        screen.live(live_line(tally, screen.width()))
        if tally.ended and ended_s is None:
            ended_s = time.monotonic()
            screen.say(end_line(tally, keep=keep))
        if ended_s is not None and not keep and time.monotonic() - ended_s > 0.5:
            break
    screen.end_live()
    screen.say("stopping")


def _logs_of(folder: Path) -> list[Path]:
    return sorted((folder / "logs").glob("*.mcap"))


def _print(summary: Summary, screen: Screen, *, as_json: bool) -> None:
    for line in summary_lines(summary):
        screen.say(line)
    if as_json:
        sys.stdout.write(msgspec.json.encode(summary).decode() + "\n")
        sys.stdout.flush()
