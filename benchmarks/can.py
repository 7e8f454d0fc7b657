"""Fully loaded buses into curated signals: what the CAN service takes of a core, what it loses, how old its ego is."""

import json
import os
import re
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

from app.drive.summary import percentile
from benchmarks.calls import endpoint
from benchmarks.can_traffic import FRAMES_PER_S, Traffic, messages_of, others
from benchmarks.figures import median, table
from drivemcp.bus.received import Received
from drivemcp.bus.session import open_bus, wait_settled
from drivemcp.config import BusConfig, ServiceConfig
from drivemcp.node import Node
from drivemcp.paths import data
from proto import topics
from proto.sensors import CanFrame
from proto.vehicle import Ego
from services.can.profiles.dbc import Dbc
from services.can.profiles.profile import load_profile
from services.can.signals.board import Board

SECONDS, WARM_UP_S, ROUNDS = 60.0, 4.0, 5
TICKS = os.sysconf("SC_CLK_TCK")
GOAL = "at most 25 %, none, at most 10 ms"
HEAD = ["frames/s", "subject", "core %", "frames lost", "frame to ego p50 ms", "p99 ms", "egos", "with a doubt"]


class Measured(NamedTuple):
    """One run of one or four buses."""

    service_share: float
    cantools_share: float
    lost: int
    cantools_lost: int
    egos: list["Heard"]


class Heard(NamedTuple):
    """One published ego: how old, and which fields are not believed."""

    age_ms: float
    invalid: tuple[str, ...]


def can() -> str:
    """The table."""
    rows, ratios = [], []
    for buses in (1, 4):
        sys.stderr.write(f"  {buses} x {FRAMES_PER_S} frames/s, {SECONDS:.0f} s\n")
        found = measure(buses, SECONDS)
        rows += _rows(buses * FRAMES_PER_S, found)
        ratios.append(f"{buses}: {found.cantools_share / found.service_share:.1f}")
    return (
        f"## Fully loaded buses ({SECONDS:.0f} s each; promised for one: {GOAL})\n\n{table(HEAD, rows)}\n\n"
        f"Plain cantools over ours, by buses: {', '.join(ratios)}. Load at the end: {os.getloadavg()[0]:.1f}.\n\n"
        f"{decoding()}"
    )


def decoding() -> str:
    """Frame to judged fields alone, on one thread, in turns with cantools; microseconds of processor time a frame."""
    with tempfile.TemporaryDirectory() as name:
        _settings(folder := Path(name), 1)
        profile = load_profile(folder / "profile.toml")
        descriptions = {"can0": Dbc(folder / "sim.dbc", folder / "others.dbc")}
    traffic, now_ns = Traffic(0, 1), time.time_ns()
    batches = [traffic.batch(now_ns + n * 5_000_000).frames for n in range(1600)]
    ours, theirs, boards = [], [], [Board(descriptions, profile) for _ in range(ROUNDS)]
    for board in boards:
        ours.append(_spent(partial(_judge, board, batches)))
        theirs.append(_spent(partial(_decode_all, descriptions["can0"], batches)))
        _expect_belief(board, batches[-1][-1].stamp_ns)
    count = sum(map(len, batches)) / 1e6
    rows = [
        [name, f"{median(each) / count:.2f}"] for name, each in (("board", ours), ("cantools, all signals", theirs))
    ]
    ratio = median(theirs) / median(ours)
    return f"{table(['decoding alone', 'µs a frame'], rows)}\n\ncantools over ours: {ratio:.1f}."


def _judge(board: Board, batches: list[tuple[CanFrame, ...]]) -> None:
    for frames in batches:
        board.ingest(frames, frames[-1].stamp_ns)


def _expect_belief(board: Board, now_ns: int) -> None:
    """What is refused would be measured too cheap."""
    if doubted := {name: why for name in board.fields if (why := board.read(name, now_ns).reason)}:
        raise RuntimeError(f"fields are not believed: {doubted}")


def _decode_all(dbc: Dbc, batches: list[tuple[CanFrame, ...]]) -> None:
    for frames in batches:
        for frame in frames:
            dbc.messages[False, frame.arbitration_id].decode(frame.data)


def _spent(work: Callable[[], None]) -> float:
    started = time.thread_time()
    work()
    return time.thread_time() - started


def _rows(rate: int, found: Measured) -> list[list[str]]:
    ages = [each.age_ms for each in found.egos]
    told = [f"{percentile(ages, 0.5):.1f}", f"{percentile(ages, 0.99):.1f}", str(len(ages))]
    told.append(str(sum(bool(each.invalid) for each in found.egos)))
    return [
        [str(rate), "CAN service", f"{100 * found.service_share:.1f}", str(found.lost), *told],
        [
            str(rate),
            "cantools, all signals",
            f"{100 * found.cantools_share:.1f}",
            str(found.cantools_lost),
            "",
            "",
            "",
            "",
        ],
    ]


def measure(buses: int, seconds: float) -> Measured:
    """Service and plain cantools hear the same frames at once, each in a process of its own."""
    where = endpoint()
    with tempfile.TemporaryDirectory() as folder, _process("drivemcp.bus.router", "--listen", where):
        settings = _settings(Path(folder), buses)
        with (
            open_bus(BusConfig(connect=(where,))) as bus,
            _process("services.can", "--connect", where, *settings) as service,
            _process("benchmarks.can_traffic", where, "cantools", str(buses), "0") as plain,
        ):
            egos: list[Heard] = []
            node = Node(bus, "bench", ServiceConfig())
            node.watch_services()
            node.subscribe(topics.EGO, lambda ego, info: egos.append(_heard_ego(ego, info)))
            node.open(announce=False)
            if not wait_settled(lambda: "get_vehicle_snapshot" in node.catalogue(), 40.0):
                raise RuntimeError("the CAN service did not come up")
            shares, sent = _while_fed(where, buses, seconds, egos, (service.pid, plain.pid))
            heard = _heard(node, sent)
            plain_heard = _end(plain)
            node.close()
    return Measured(shares[0], shares[1], sent - heard, sent - plain_heard, egos)


def _while_fed(
    where: str, buses: int, seconds: float, egos: list[Heard], pids: tuple[int, ...]
) -> tuple[list[float], int]:
    """(share of a core of each process, frames sent): feeds, and looks from the end of the warm-up on."""
    arguments = [where, "feed", str(buses), str(WARM_UP_S + seconds + 1)]
    command = [sys.executable, "-m", "benchmarks.can_traffic", *arguments]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as feeder:
        if not wait_settled(lambda: bool(egos), 20.0):
            raise RuntimeError("no ego was published")
        threading.Event().wait(WARM_UP_S)
        egos.clear()
        before, started = [_cpu_s(pid) for pid in pids], time.monotonic()
        threading.Event().wait(seconds)
        took = time.monotonic() - started
        shares = [(_cpu_s(pid) - was) / took for pid, was in zip(pids, before, strict=True)]
        kept = list(egos)
        out, _ = feeder.communicate(timeout=60)
    egos[:] = kept
    return shares, int(json.loads(out)["frames"])


def _heard(node: Node, sent: int) -> int:
    """How many frames the service counts, once it has caught up."""
    count = 0
    for _ in range(20):
        outcome = node.call("get_vehicle_snapshot", {}, deadline_ms=2000)
        count = int(outcome.result["frame_count"]) if outcome.ok and outcome.result else count
        if count >= sent:
            break
        threading.Event().wait(0.25)
    return count


def _heard_ego(ego: Ego, info: Received[Ego]) -> Heard:
    """Its age: from the first frame of the batch (its speed) at the source to the publication."""
    return Heard((info.sent_ns - info.stamp_ns) / 1e6, ego.invalid)


def _cpu_s(pid: int) -> float:
    """Processor time of a process, all threads, user and system."""
    fields = Path(f"/proc/{pid}/stat").read_text().rsplit(")", 1)[1].split()
    return (int(fields[11]) + int(fields[12])) / TICKS


def _settings(folder: Path, buses: int) -> list[str]:
    """A profile of the simulated car, its messages spread over the buses; every bus is described in full."""
    (folder / "others.dbc").write_text(others(), encoding="utf-8")
    (folder / "sim.dbc").write_bytes(data("vehicles/sim/sim.dbc").read_bytes())
    described = "\n".join(f'[buses.can{bus}]\ndescription = ["sim.dbc", "others.dbc"]\n' for bus in range(buses))
    text = data("vehicles/sim/profile.toml").read_text(encoding="utf-8")
    text = re.sub(r"(?ms)^\[buses\.can0\].*?(?=^\[)", lambda _: described + "\n", text)
    (folder / "profile.toml").write_text(_spread(text, folder, buses), encoding="utf-8")
    named = json.dumps([{"name": f"can{bus}", "channel": f"can{bus}"} for bus in range(buses)])
    return ["--set", f"profile={folder / 'profile.toml'}", "--set", f"buses={named}", "--set", f"out_dir={folder}"]


def _spread(text: str, folder: Path, buses: int) -> str:
    """Each field with the bus that carries its message."""
    dbc, home = Dbc(folder / "sim.dbc"), {name: bus for bus in range(buses) for name in messages_of(bus, buses)}

    def line(match: re.Match[str]) -> str:
        message, _ = dbc.signal(match[2])
        return f'{match[1]} bus = "can{home[message.name]}", signal = "{match[2]}"'

    return re.sub(r'(?m)^(\w+ = \{) signal = "(\w+)"', line, text)


@contextmanager
def _process(module: str, *arguments: str) -> Iterator[subprocess.Popen[str]]:
    with subprocess.Popen(
        [sys.executable, "-m", module, *arguments], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    ) as process:
        try:
            yield process
        finally:
            process.terminate()


def _end(listener: "subprocess.Popen[Any]") -> int:
    """Let the listener finish; the frames it heard."""
    out, _ = listener.communicate(timeout=30)
    return int(json.loads(out)["frames"])
