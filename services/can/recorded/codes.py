"""Trouble codes that a recording heard: in answers of control units, and in J1939 broadcasts."""

import msgspec

from services.can.diagnostics import isotp, obd, uds
from services.can.diagnostics.addresses import ANSWER_IDS, is_extended
from services.can.errors import MalformedFrame
from services.can.j1939 import messages
from services.can.j1939.transport import Transport

CODES_LIMIT = 200
NS = 1_000_000_000
BY_STATUS = b"\x19\x02"


class CodeSeen(msgspec.Struct, frozen=True, kw_only=True):
    """A trouble code, and when an answer first named it, s after the log's first frame."""

    code: str
    first_seen_s: float


class FaultSeen(msgspec.Struct, frozen=True, kw_only=True):
    """A fault that a unit broadcast as active (DM1), and from when to when, s after the log's first frame."""

    spn: int
    fmi: int
    source_address: int
    first_seen_s: float
    last_seen_s: float


class Codes:
    """Takes frames in order; remembers at most 200 codes of each kind."""

    def __init__(self) -> None:
        self._receivers: dict[int, isotp.Receiver] = {}
        self._transport = Transport()
        self._codes: dict[str, float] = {}
        self._faults: dict[tuple[int, int, int], tuple[float, float]] = {}

    def take(self, extended: bool, arbitration_id: int, data: bytes, at_s: float) -> None:
        """A frame; of any other use it is ignored."""
        if arbitration_id in ANSWER_IDS and extended == is_extended(arbitration_id):
            if arbitration_id not in self._receivers:
                self._receivers[arbitration_id] = isotp.Receiver(arbitration_id, lambda *_: None)
            for answer in self._receivers[arbitration_id].feed(data):
                for code in _codes(answer):
                    _remember(self._codes, code, at_s)
        elif extended:
            group = self._transport.feed(arbitration_id, data, int(at_s * NS))
            if group is not None and group.header.pgn == messages.DM1:
                self._fault(group.header.source, group.data, at_s)

    def seen(self) -> list[CodeSeen]:
        """Codes by their names."""
        return [CodeSeen(code=code, first_seen_s=round(at_s, 3)) for code, at_s in sorted(self._codes.items())]

    def faults_seen(self) -> list[FaultSeen]:
        """Faults by unit."""
        return [
            FaultSeen(source_address=source, spn=spn, fmi=fmi, first_seen_s=round(first, 3), last_seen_s=round(last, 3))
            for (source, spn, fmi), (first, last) in sorted(self._faults.items())
        ]

    def _fault(self, source: int, data: bytes, at_s: float) -> None:
        try:
            faults = messages.dm1(data).faults
        except MalformedFrame:
            return
        for fault in faults:
            key = source, fault.spn, fault.fmi
            if key in self._faults or len(self._faults) < CODES_LIMIT:
                self._faults[key] = self._faults.get(key, (at_s, at_s))[0], at_s


def _codes(answer: bytes) -> tuple[str, ...]:
    """Those that an answer reports as faults."""
    if obd.is_list(answer):
        return obd.codes(answer)
    if not answer.startswith(b"\x59\x02"):
        return ()
    try:
        rows = uds.words(BY_STATUS, answer)["codes"]
        return tuple(row["code"] for row in rows if not uds.FAILED.isdisjoint(row["status"]))
    except MalformedFrame:
        return ()


def _remember(codes: dict[str, float], code: str, at_s: float) -> None:
    if len(codes) < CODES_LIMIT:
        codes.setdefault(code, at_s)
