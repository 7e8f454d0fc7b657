"""Watches a running drive from a process of its own: `python -m tests.stack.chaos.watcher FILE`, a JSON object a line until SIGTERM.

Its clock is the machine's steady one, which the test reads as well.
"""

import signal
import sys
import threading
import time
from pathlib import Path

import msgspec

from drivemcp.client import join
from proto import topics
from proto.decision import Advisory
from proto.truth import Truth
from tests.stack.chaos.allowed import allowed_mps


class Seen(msgspec.Struct, frozen=True, kw_only=True):
    """One advisory, with the truth at that moment."""

    at_s: float
    tick: int
    kind: str
    target_mps: float | None
    limit_mps: float | None
    why: str
    degraded: tuple[str, ...]
    drive_s: float | None = None
    law_mps: float | None = None
    gap_m: float | None = None
    allowed_mps: float | None = None
    """What the truth allows (`allowed.py`)."""


def main(file: Path) -> None:
    """Write what is seen."""
    stop, truth = threading.Event(), list[Truth]()
    signal.signal(signal.SIGTERM, lambda *_: stop.set())
    encoder = msgspec.json.Encoder()
    with file.open("ab", buffering=0) as out, join(name="evaluation") as node:

        def told(advisory: Advisory) -> None:
            now = truth[-1] if truth else None
            seen = Seen(
                at_s=time.monotonic(), tick=advisory.tick, kind=advisory.kind, target_mps=advisory.target_mps,
                limit_mps=advisory.legal_limit.mps if advisory.legal_limit is not None else None,
                why=advisory.target_why, degraded=advisory.degraded,
                drive_s=now.time_s if now is not None else None,
                law_mps=now.law_limit_mps if now is not None else None, gap_m=now.gap_m if now is not None else None,
                allowed_mps=allowed_mps(now) if now is not None else None,
            )  # fmt: skip
            out.write(encoder.encode(seen) + b"\n")

        node.subscribe(topics.TRUTH, lambda message, _: truth.__setitem__(slice(None), [message]))
        node.subscribe(topics.ADVISORY, lambda message, _: told(message))
        stop.wait()


if __name__ == "__main__":
    main(Path(sys.argv[1]))
