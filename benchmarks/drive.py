"""Sensor to advice by stage, over a real-time drive with all services running."""

import sys
import tempfile
import threading
import time
from typing import Any

from app.drive.stack import Stack, StackPlan
from app.drive.summary import percentile
from benchmarks.figures import table
from drivemcp.bus.received import Received
from drivemcp.node import Node
from proto import topics
from proto.decision import Advisory
from proto.perception import Tracks
from proto.scene import Facts

SECONDS = 60.0
WARM_UP_S = 5.0


class Stages:
    """Times of each stage, in ms."""

    def __init__(self, node: Node) -> None:
        self.perception: list[float] = []
        self.reading: list[float] = []
        self.tick: list[float] = []
        self.whole: list[float] = []
        self.kinds: dict[str, int] = {}
        self._tracks_sent: dict[int, int] = {}
        node.subscribe(topics.TRACKS, self._tracks)
        node.subscribe(topics.FACTS, self._facts)
        node.subscribe(topics.ADVISORY, self._advisory)

    def _tracks(self, _: Tracks, info: Received[Tracks]) -> None:
        self.perception.append((info.sent_ns - info.stamp_ns) / 1e6)
        self._tracks_sent[info.stamp_ns] = info.sent_ns

    def _facts(self, _: Facts, info: Received[Facts]) -> None:
        self.reading.append((info.sent_ns - info.stamp_ns) / 1e6)

    def _advisory(self, advisory: Advisory, info: Received[Advisory]) -> None:
        self.kinds[advisory.kind] = self.kinds.get(advisory.kind, 0) + 1
        sent = self._tracks_sent.pop(advisory.snapshot_stamp_ns, None)
        if sent is not None:
            self.tick.append((info.sent_ns - sent) / 1e6)
            self.whole.append((info.sent_ns - advisory.snapshot_stamp_ns) / 1e6)


def stages() -> str:
    """The table."""
    with tempfile.TemporaryDirectory() as folder:
        settings: dict[str, dict[str, Any]] = {
            "simulator": {"scenario": "urb-rain", "seed": 1, "seconds": SECONDS, "autostart": True},
            "logger": {"view": {"mode": "web"}},
        }
        with Stack(StackPlan(folder=folder, settings=settings), _say) as stack:
            node = stack.start()
            stack.wait_for_source()
            threading.Event().wait(WARM_UP_S)
            measured = Stages(node)
            started = time.monotonic()
            threading.Event().wait(SECONDS - WARM_UP_S)
            seconds = time.monotonic() - started
    rows = [
        _row("frame to tracks (perception)", measured.perception),
        _row("frame to facts (drivelm; no tick waits for it)", measured.reading),
        _row("tracks to advisory (tick, experts, arbiter)", measured.tick),
        _row("snapshot to advisory", measured.whole),
    ]
    head = ["stage", "p50 ms", "p99 ms", "count"]
    kinds = ", ".join(f"{count} {kind}" for kind, count in sorted(measured.kinds.items()))
    return (
        f"## Sensor to advice, urb-rain, {seconds:.0f} s in real time, live view on\n\n{table(head, rows)}\n\n{kinds}\n"
    )


def _say(text: str) -> None:
    sys.stderr.write(f"  {text}\n")


def _row(name: str, values: list[float]) -> list[str]:
    if not values:
        return [name, "-", "-", "0"]
    return [name, f"{percentile(values, 0.5):.1f}", f"{percentile(values, 0.99):.1f}", str(len(values))]
