"""The one place that says which frames may leave on a bus, and how many."""

import threading
import time
from collections.abc import Callable, Mapping

from services.can.diagnostics import isotp
from services.can.diagnostics.addresses import FUNCTIONAL_IDS, PHYSICAL_IDS, REQUEST_IDS
from services.can.errors import RequestRefused

# Service ids that only read (SAE J1979 01-03, 06, 07, 09, 0A; ISO 14229 ReadDTCInformation, ReadDataByIdentifier,
# TesterPresent). Sessions are not opened: nothing that is read here needs one.
READING = frozenset({0x01, 0x02, 0x03, 0x06, 0x07, 0x09, 0x0A, 0x19, 0x22, 0x3E})
CLEAR_OBD, RESET, CLEAR_UDS, ROUTINE = 0x04, 0x11, 0x14, 0x31
ACTUATING = frozenset({CLEAR_OBD, RESET, CLEAR_UDS})
"""May leave for a granted and confirmed command only. Writing, routines and security access may not leave at all."""
SUBFUNCTIONS: Mapping[int, frozenset[int]] = {
    0x19: frozenset({0x01, 0x02, 0x04, 0x06, 0x0A}),
    0x3E: frozenset({0x00}),
    RESET: frozenset({0x01, 0x02, 0x03}),
}
TEST_UNIT_ID = 0x7E7
"""Takes fault scenarios; only a simulated car has one."""
NOTHING: frozenset[int] = frozenset()

FRAMES_PER_S, BURST, RESERVE = 400.0, 40.0, 10.0
"""A tenth of a full 500 kbit/s bus. The reserve is kept for flow control, so that answers under way are not cut off."""


def check(arbitration_id: int, data: bytes, allowed: frozenset[int] = NOTHING) -> None:
    """Raise RequestRefused unless this frame may leave: a diagnostic id, and a service that reads or that is `allowed`
    (by a grant and the confirmation of exactly that command, or in simulation).
    """
    if arbitration_id not in REQUEST_IDS:
        raise RequestRefused(
            f"0x{arbitration_id:X} is no diagnostic request id; only 0x7DF, 0x7E0 to 0x7E7, 0x18DB33F1 and 0x18DAxxF1"
        )
    if data in isotp.FLOW_FRAMES and arbitration_id in PHYSICAL_IDS:
        return
    if len(data) != 8 or not 1 <= data[0] <= 7 or data != isotp.single_frame(data[1 : 1 + data[0]]):
        raise RequestRefused("only single-frame requests of 8 bytes may be sent")
    _check_service(arbitration_id, data[1 : 1 + data[0]], allowed)


def _check_service(arbitration_id: int, payload: bytes, allowed: frozenset[int]) -> None:
    service = payload[0]
    if service == ROUTINE and (ROUTINE not in allowed or arbitration_id != TEST_UNIT_ID):
        raise RequestRefused("routines may not be started")
    if service not in READING and service not in allowed & (ACTUATING | {ROUTINE}):
        raise RequestRefused(
            f"service 0x{service:02X} changes the vehicle; only reading services may be sent: {_names()}"
        )
    if service in SUBFUNCTIONS and (len(payload) < 2 or payload[1] not in SUBFUNCTIONS[service]):
        raise RequestRefused(f"this sub-function of service 0x{service:02X} may not be sent")
    if service == RESET and arbitration_id in FUNCTIONAL_IDS:
        raise RequestRefused("one unit is reset at a time")


def _names() -> str:
    return ", ".join(f"0x{service:02X}" for service in sorted(READING))


J1939_REQUEST = 0xEA00
CLEARING_GROUPS = frozenset({65228, 65235})
"""DM3 and DM11: to ask for them clears stored and active trouble codes (J1939-73)."""


def check_j1939_request(arbitration_id: int, data: bytes) -> None:
    """Raise RequestRefused unless this is a request for a group that only tells: not one that clears, and not a maker's
    own group, since what asking for that does is not known.
    """
    if arbitration_id >> 29 or arbitration_id >> 8 & 0x3FF00 != J1939_REQUEST or len(data) != 3:
        raise RequestRefused("of J1939 only the request for a group (59904) may be sent")
    pgn = int.from_bytes(data, "little")
    if pgn >= 1 << 18 or (pgn & 0xFF00 < 0xF000 and pgn & 0xFF):
        raise RequestRefused(f"{pgn} is no parameter group number")
    if pgn in CLEARING_GROUPS:
        raise RequestRefused(f"asking for group {pgn} clears trouble codes; only reading groups may be asked for")
    if pgn & 0xFF00 in (0xEF00, 0xFF00):
        raise RequestRefused(f"group {pgn} is the maker's own; what asking for it does is not known")


SENDABLE = ("0x7DF", "0x7E0-0x7E7", "0x18DB33F1", "0x18DAxxF1", "J1939 59904 (request for a group)")
"""The ids that a bus without transmit_ids sends on."""


def check_at_bus(arbitration_id: int, data: bytes) -> None:
    """The last check, of every frame whatever made it: raise RequestRefused unless some command could make it leave. Whether
    the command at hand may was checked where that command is known.
    """
    if arbitration_id >> 8 & 0x3FF00 == J1939_REQUEST and arbitration_id not in REQUEST_IDS:
        check_j1939_request(arbitration_id, data)
    else:
        check(arbitration_id, data, ACTUATING | {ROUTINE})


def purpose(arbitration_id: int, data: bytes) -> str:
    """What a frame is for, in words."""
    if arbitration_id not in REQUEST_IDS:
        return "request for a group (J1939)" if len(data) == 3 else "unknown"
    if data[:1] and data[0] >> 4 == 0x3:
        return "flow control"
    return f"request, service 0x{data[1]:02X}" if len(data) > 1 else "unknown"


def writes(arbitration_id: int, data: bytes) -> bool:
    """Whether a frame asks for more than reading."""
    return arbitration_id in REQUEST_IDS and len(data) > 1 and data not in isotp.FLOW_FRAMES and data[1] not in READING


class Pace:
    """A bucket of frames that fills at a rate: never more than `burst` + rate * time leave in any time."""

    def __init__(
        self, rate_per_s: float = FRAMES_PER_S, burst: float = BURST, clock: Callable[[], float] = time.monotonic
    ) -> None:
        self._rate, self._burst, self._clock = rate_per_s, burst, clock
        self._left, self._at, self._lock = burst, clock(), threading.Lock()

    def take(self, keep: float = 0.0) -> float:
        """0: one frame may leave now. Else seconds until one may, so that `keep` are left."""
        with self._lock:
            now = self._clock()
            self._left = min(self._burst, self._left + max(0.0, now - self._at) * self._rate)
            self._at = now
            if self._left < keep + 1.0:
                return (keep + 1.0 - self._left) / self._rate
            self._left -= 1.0
            return 0.0
