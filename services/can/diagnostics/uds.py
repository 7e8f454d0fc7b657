"""The reading services of ISO 14229 by `udsoncan`: requests as bytes, answers and refusals in words."""

import re
import struct
from collections.abc import Mapping
from typing import Any, Literal

from udsoncan import DidCodec, Dtc
from udsoncan.exceptions import ConfigError, InvalidResponseException
from udsoncan.Response import Response
from udsoncan.ResponseCode import ResponseCode
from udsoncan.services.ReadDataByIdentifier import ReadDataByIdentifier
from udsoncan.services.ReadDTCInformation import ReadDTCInformation

from services.can.diagnostics import obd, pids
from services.can.diagnostics.trouble_codes import code_of
from services.can.errors import MalformedFrame

Report = Literal["by_status", "snapshot", "extended", "supported"]
REPORTS: Mapping[Report, int] = {"by_status": 0x02, "snapshot": 0x04, "extended": 0x06, "supported": 0x0A}
VINS = frozenset({0xF190, 0xF802})
"""The vehicle's identification number: ISO 14229, and ISO 27145 (information type 02)."""
OBD_FIRST = 0xF400
"""Identifiers F400 to F4FF are the parameters of OBD service 01 (SAE J1979-2)."""
TEXTS: Mapping[int, str] = {
    0xF187: "part_number", 0xF188: "software_number", 0xF189: "software_version", 0xF18A: "supplier",
    0xF18C: "serial_number", 0xF191: "hardware_number", 0xF195: "supplier_software_version", 0xF197: "system_name",
    **dict.fromkeys(VINS, "vin"),
}  # fmt: skip
FLAGS = (
    "test_failed", "test_failed_this_operation_cycle", "pending", "confirmed",
    "test_not_completed_since_last_clear", "test_failed_since_last_clear",
    "test_not_completed_this_operation_cycle", "warning_indicator_requested",
)  # fmt: skip
FAILED = frozenset(FLAGS) - {"test_not_completed_since_last_clear", "test_not_completed_this_operation_cycle"}
"""One of them says that a code's test failed, now or before; of any other code a unit only lists that it has such a test."""
_CODE = re.compile(r"([PCBU])([0-3])([0-9A-F])([0-9A-F]{2})(?:-([0-9A-F]{2}))?")


class _Bytes(DidCodec):
    """As many bytes as are said, or all that are left."""

    def __init__(self, size: int | None) -> None:
        super().__init__()
        self._size = size

    def decode(self, data: bytes) -> bytes:
        """As they are."""
        return data

    def __len__(self) -> int:
        if self._size is None:
            raise DidCodec.ReadAllRemainingData
        return self._size


Codecs = dict[int | str, str | DidCodec | type[DidCodec]]
_PARAMETERS: Codecs = {OBD_FIRST | pid: _Bytes(size) for pid in range(0x100) if (size := pids.size_of(pid)) is not None}


def identifier_request(identifier: int) -> bytes:
    """Ask for one identifier. Raises ValueError outside two bytes."""
    return bytes(ReadDataByIdentifier.make_request([identifier], None).get_payload())


def codes_request(report: Report, status_mask: int, code: str, record: int) -> bytes:
    """Ask for trouble codes: by status, or for one code what was kept with it. Raises ValueError."""
    kind = REPORTS[report]
    request = ReadDTCInformation.make_request(
        kind,
        status_mask=status_mask if report == "by_status" else None,
        dtc=number_of(code) if report in ("snapshot", "extended") else None,
        snapshot_record_number=record if report == "snapshot" else None,
        extended_data_record_number=record if report == "extended" else None,
    )
    return bytes(request.get_payload())


def number_of(code: str) -> int:
    """A trouble code as its three bytes: P0300 or P0300-11, the last two digits the failure type. Raises ValueError."""
    found = _CODE.fullmatch(code.strip().upper())
    if found is None:
        raise ValueError(f"code: {code[:20]!r} is no trouble code, as in C0035 or C0035-11")
    letter, kind, group, rest, failure = found.groups()
    high = "PCBU".index(letter) << 6 | int(kind) << 4 | int(group, 16)
    return high << 16 | int(rest, 16) << 8 | int(failure or "0", 16)


def refusal(code: int) -> str:
    """A negative response code in words."""
    name = ResponseCode.get_name(code)
    if name is None or name == str(code):
        return f"code 0x{code:02X}"
    return re.sub(r"(?<=[a-z])(?=[A-Z])|_", " ", name).lower()


def words(payload: bytes, answer: bytes) -> dict[str, Any]:
    """What a positive answer to `payload` says. Raises MalformedFrame where it is not what the service answers."""
    try:
        if payload[0] == 0x22:
            return _identifier(int.from_bytes(payload[1:3], "big"), answer)
        return _codes(payload[1], answer) if payload[0] == 0x19 else {}
    except (InvalidResponseException, ConfigError, LookupError, ValueError, struct.error) as error:
        raise MalformedFrame(f"answer to service 0x{payload[0]:02X}: {error}") from error


def _identifier(identifier: int, answer: bytes) -> dict[str, Any]:
    config: Codecs = {identifier: _Bytes(None)}
    found = ReadDataByIdentifier.interpret_response(Response.from_payload(answer), [identifier], config)
    return meaning(identifier, bytes(found.service_data.values[identifier]))


def meaning(identifier: int, data: bytes) -> dict[str, Any]:
    if OBD_FIRST <= identifier <= OBD_FIRST | 0xFF and (value := obd.parameter(identifier & 0xFF, data)):
        return value
    if identifier in TEXTS:
        return {TEXTS[identifier]: data.decode("ascii", "replace").strip("\x00 ")}
    return {f"identifier_{identifier:04X}": data.hex().upper()}


def _codes(kind: int, answer: bytes) -> dict[str, Any]:
    found = ReadDTCInformation.interpret_response(
        Response.from_payload(answer), kind, extended_data_size=max(1, len(answer) - 7), didconfig=_PARAMETERS
    ).service_data
    if kind == 0x01:
        return {"count": found.dtc_count}
    return {"codes": [_code(dtc) for dtc in found.dtcs]}


def _code(dtc: Dtc) -> dict[str, Any]:
    high, low, failure = dtc.id.to_bytes(3, "big")
    status = dtc.status.get_byte_as_int()
    row: dict[str, Any] = {
        "code": code_of(high, low),
        "failure_type": f"{failure:02X}",
        "status": [name for i, name in enumerate(FLAGS) if status >> i & 1],
    }
    kept = [each for each in dtc.snapshots if isinstance(each, Dtc.Snapshot)]
    if kept:
        row["snapshot"] = [meaning(each.did or 0, each.raw_data or b"") for each in kept]
    if dtc.extended_data:
        row["extended"] = {f"0x{each.record_number or 0:02X}": _hex(each.raw_data) for each in dtc.extended_data}
    return row


def _hex(data: bytes | None) -> str:
    return (data or b"").hex().upper()
