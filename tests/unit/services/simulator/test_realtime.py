"""A drive by the wall clock that was stopped, slowed, or whose clock was set comes back to the present."""

import time
from collections.abc import Iterator
from contextlib import contextmanager

import pytest

from drivemcp.bus.session import wait_settled
from proto import topics
from services.simulator.realtime import RealTime
from services.simulator.session import STEP_NS, Outgoing, Session
from tests.unit.services.simulator.test_session import session

AHEAD_NS, STALE_NS = 200_000_000, 150_000_000


class Driving:
    """A drive without cameras, its clock, and the positions that it sends."""

    def __init__(self) -> None:
        self.offset_ns = 0
        self.fixes: list[int] = []
        self.drive = RealTime(
            session(cameras=(), lidar=False, seconds=600.0),
            None,
            self._publish,
            self.now_ns,
            ahead_ns=AHEAD_NS,
            stale_ns=STALE_NS,
        )

    def now_ns(self) -> int:
        return time.time_ns() + self.offset_ns

    def _publish(self, out: Outgoing, stamp_ns: int) -> None:
        if out.topic is topics.GNSS:
            self.fixes.append(stamp_ns)

    def sends_the_present(self, timeout_s: float) -> bool:
        """Whether three positions of the present come within the time."""
        seen = len(self.fixes)

        def fresh() -> bool:
            now_ns = self.now_ns()
            return sum(abs(now_ns - at_ns) < 3e9 for at_ns in self.fixes[seen:]) >= 3

        return wait_settled(fresh, timeout_s)


@contextmanager
def driving() -> Iterator[Driving]:
    found = Driving()
    found.drive.start()
    try:
        yield found
    finally:
        found.drive.stop()


@pytest.mark.parametrize("step_s", [3.0, 20.0, 3600.0, -3.0, -3600.0])
def test_after_a_stop_or_a_clock_that_was_set_positions_are_sent_again_at_once(step_s: float) -> None:
    with driving() as found:
        assert found.sends_the_present(20.0)
        found.offset_ns += int(step_s * 1e9)
        assert found.sends_the_present(5.0)
        assert found.drive.skipped_s == pytest.approx(step_s, abs=2.0)


def test_a_drive_that_was_stopped_on_a_machine_that_just_keeps_up_does_not_stay_behind(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Each step takes nearly as long as it lasts: what was missed is never driven through in time."""
    found = Driving()
    whole = Session.advance

    def slow(self: Session, ahead_s: float = 0.0) -> object:
        found.offset_ns += int(0.95 * STEP_NS)
        return whole(self, ahead_s)

    monkeypatch.setattr(Session, "advance", slow)
    found.drive.start()
    try:
        assert found.sends_the_present(20.0)
        found.offset_ns += 3_000_000_000
        assert found.sends_the_present(5.0)
    finally:
        found.drive.stop()


def test_a_clock_that_is_right_is_followed_step_by_step() -> None:
    with driving() as found:
        assert found.sends_the_present(20.0)
        assert found.drive.skipped_s == 0.0
