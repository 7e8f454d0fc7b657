"""The table: what was measured, on what, and which numbers runs take from it."""

from collections.abc import Sequence
from pathlib import Path

import msgspec

from app.drive.summary import percentile
from drivemcp.errors import MALFORMED, UserError

FEWEST = 5
"""A tool that was asked less often is left at the fixed latency."""


class Took(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Wall time of one thing, over its samples."""

    p50_ms: float
    p99_ms: float
    count: int


class Latencies(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """What one measurement found."""

    machine: str
    load: float
    """Of the system in the last minute, when it began: 1 for each busy core."""
    runs: tuple[str, ...]
    """What was driven for it."""
    tools: dict[str, Took]
    """From the caller's request to its answer, over the bus."""
    stages: dict[str, Took]
    """A picture in perception and in the front end, a tick in the orchestrator with its waits. No run takes these."""

    def modelled_ms(self) -> dict[str, float]:
        """Tool to the median that lockstep takes for each of its calls, to a tenth of a millisecond."""
        return {name: round(took.p50_ms, 1) for name, took in sorted(self.tools.items()) if took.count >= FEWEST}

    def told(self) -> str:
        """One line for a report."""
        return f"medians of {sum(took.count for took in self.tools.values())} calls measured on {self.machine}, load {self.load:.1f}"


def took(samples_ms: Sequence[float]) -> Took:
    """The spread of samples, by nearest rank."""
    p50, p99 = (round(percentile(samples_ms, share), 3) for share in (0.5, 0.99))
    return Took(p50_ms=p50, p99_ms=p99, count=len(samples_ms))


def read(path: Path) -> Latencies:
    """A measured table. Raises UserError naming the file and what is wrong with it."""
    try:
        return msgspec.json.decode(path.read_bytes(), type=Latencies)
    except OSError as error:
        raise UserError(
            f"latencies {path}: {error.strerror}; measure them by `python -m studies latencies measure --out {path}`"
        ) from None
    except MALFORMED as error:
        raise UserError(f"latencies {path}: {error}") from None
