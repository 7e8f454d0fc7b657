"""The one place that says which frames may leave on a bus."""

from services.can import isotp
from services.can.errors import RequestRefused

FUNCTIONAL_ID = 0x7DF
PHYSICAL_IDS = range(0x7E0, 0x7E8)
ANSWER_IDS = range(0x7E8, 0x7F0)

# Service ids that only read (SAE J1979 01-03, 06, 07, 09, 0A; ISO 14229 ReadDTCInformation, ReadDataByIdentifier,
# TesterPresent).
READING = frozenset({0x01, 0x02, 0x03, 0x06, 0x07, 0x09, 0x0A, 0x19, 0x22, 0x3E})
CLEARING = frozenset({0x04, 0x14})
ROUTINE = 0x31


def check(arbitration_id: int, data: bytes, *, clearing: bool = False, faults: bool = False) -> None:
    """Raise RequestRefused unless this frame may leave: a diagnostic id, and a service that reads or that was allowed.

    `clearing`: a granted and confirmed clearing of trouble codes. `faults`: fault scenarios in simulation.
    """
    if arbitration_id != FUNCTIONAL_ID and arbitration_id not in PHYSICAL_IDS:
        raise RequestRefused(
            f"0x{arbitration_id:X} is no diagnostic request id; only 0x7DF and 0x7E0 to 0x7E7 may be sent"
        )
    if data == isotp.FLOW_CONTINUE and arbitration_id in PHYSICAL_IDS:
        return
    length = data[0] if data else 0
    if len(data) != 8 or not 1 <= length <= 7:
        raise RequestRefused("only single-frame requests of 8 bytes may be sent")
    service = data[1]
    allowed = service in READING or (clearing and service in CLEARING) or (faults and service == ROUTINE)
    if not allowed:
        raise RequestRefused(
            f"service 0x{service:02X} changes the vehicle; only reading services may be sent: {_names()}"
        )


def _names() -> str:
    return ", ".join(f"0x{service:02X}" for service in sorted(READING))
