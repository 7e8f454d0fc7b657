"""Whether a braking command is news: a copy of an earlier one, one that was overtaken, and one that is too old are not."""

from drivemcp.bus.received import Received
from proto.decision import BrakeCommand
from services.simulator.car.brake_receiver import MAX_VALID_NS


class CommandOrder:
    """The newest command that was taken."""

    def __init__(self) -> None:
        self._last: Received[BrakeCommand] | None = None

    def takes(self, info: Received[BrakeCommand], now_ns: int) -> bool:
        """Whether to take it. A command lives 200 ms from its stamp on, not from its arrival."""
        if abs(now_ns - info.stamp_ns) > MAX_VALID_NS or not self._is_later(info, now_ns):
            return False
        self._last = info
        return True

    def _is_later(self, info: Received[BrakeCommand], now_ns: int) -> bool:
        last = self._last
        if last is None or abs(now_ns - last.stamp_ns) > MAX_VALID_NS:  # no copy of it is young enough any more
            return True
        return info.seq > last.seq if info.epoch == last.epoch else info.stamp_ns > last.stamp_ns
