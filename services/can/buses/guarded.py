"""A bus that sends what its policy allows, and remembers the last frames that it sent or held back.

The check stands at the bus and not at the tools, so that frames which a transport library sends on its own (flow
control) pass it too.
"""

import threading
import time
from collections import deque
from collections.abc import Callable, Sequence

import msgspec

from proto.sensors import CanFrame
from services.can.buses.link import FrameLink, OnFrames
from services.can.errors import LinkDown, RequestRefused

RECORDS_LIMIT = 200
NS = 1_000_000_000


class TransmitPolicy(msgspec.Struct, frozen=True, kw_only=True):
    """What may leave on a bus. `allowlist`: the ids; `write_services_allowed`: services that change the car, which take a
    grant and a confirmation each time.
    """

    bus: str
    interface: str
    transmit_allowed: bool
    write_services_allowed: bool
    allowlist: tuple[str, ...]


class TransmitRecord(msgspec.Struct, frozen=True, kw_only=True, omit_defaults=True):
    """A frame that was sent, or held back and why. timestamp: s since 1970; data: bytes in hex."""

    timestamp: float
    arbitration_id: str
    is_extended_id: bool
    data: str
    purpose: str
    write: bool
    sent: bool
    blocked_reason: str | None = None


class Rule(msgspec.Struct, frozen=True, kw_only=True):
    """What the check knows of frames: why one may not leave (raises RequestRefused), what it is for, whether it changes
    the car.
    """

    check: Callable[[int, bytes], None]
    purpose: Callable[[int, bytes], str]
    writes: Callable[[int, bytes], bool]


class GuardedLink:
    """A link behind a policy. Any thread may send."""

    def __init__(
        self,
        link: FrameLink,
        policy: TransmitPolicy,
        rule: Rule,
        *,
        transmit: bool = True,
        ids: frozenset[int] = frozenset(),
        clock: Callable[[], int] = time.time_ns,
    ) -> None:
        self.policy = policy
        self._link, self._rule, self._transmit, self._ids, self._clock = link, rule, transmit, ids, clock
        self._records: deque[TransmitRecord] = deque(maxlen=RECORDS_LIMIT)
        self._lock = threading.Lock()

    @property
    def state(self) -> str:
        """How the bus is."""
        return self._link.state

    def listen(self, on_frames: OnFrames) -> None:
        """Deliver received frames."""
        self._link.listen(on_frames)

    def transmit(self, frames: Sequence[CanFrame]) -> None:
        """Send frames. Raises RequestRefused where one may not leave, LinkDown where the bus takes none."""
        for frame in frames:
            try:
                self._check(frame)
                self._link.transmit((frame,))
            except (RequestRefused, LinkDown) as error:
                self.note(frame.arbitration_id, frame.data, frame.extended, str(error))
                raise
            self.note(frame.arbitration_id, frame.data, frame.extended)

    def note(self, arbitration_id: int, data: bytes, extended: bool, blocked: str | None = None) -> None:
        """Remember a frame that left, or one that did not and why."""
        record = TransmitRecord(
            timestamp=self._clock() / NS,
            arbitration_id=f"0x{arbitration_id:X}",
            is_extended_id=extended,
            data=data[:64].hex(" "),
            purpose=self._rule.purpose(arbitration_id, data),
            write=self._rule.writes(arbitration_id, data),
            sent=blocked is None,
            blocked_reason=blocked,
        )
        with self._lock:
            self._records.append(record)

    def records(self, limit: int) -> tuple[TransmitRecord, ...]:
        """The newest, oldest first."""
        with self._lock:
            return tuple(self._records)[-limit:]

    def _check(self, frame: CanFrame) -> None:
        if not self._transmit:
            raise RequestRefused(f"bus {self.policy.bus}: sending is off; set transmit = true for it to be asked")
        if self._ids and frame.arbitration_id not in self._ids:
            raise RequestRefused(
                f"bus {self.policy.bus}: 0x{frame.arbitration_id:X} is not among its transmit_ids; add it there"
            )
        self._rule.check(frame.arbitration_id, frame.data)
