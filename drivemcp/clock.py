"""The clock that deciding reads: the wall's, or the simulation's. Never time.time() in a decision."""

import time
from typing import Protocol


class Clock(Protocol):
    """Nanoseconds since an epoch."""

    def now_ns(self) -> int:
        """The present instant."""
        ...


class WallClock:
    """CLOCK_REALTIME, shared by all processes of a machine."""

    def now_ns(self) -> int:
        """Nanoseconds since the Unix epoch."""
        return time.time_ns()


class SimulatedClock:
    """Stands still until it is set; owned by the lockstep conductor, or by a test."""

    def __init__(self, start_ns: int = 0) -> None:
        self._now_ns = start_ns

    def now_ns(self) -> int:
        """The simulated instant."""
        return self._now_ns

    def set_ns(self, now_ns: int) -> None:
        """Move to an instant; time never runs backwards."""
        self._now_ns = max(self._now_ns, now_ns)
