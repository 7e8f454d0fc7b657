"""What the diagnostic tools answer."""

import re
from typing import Any

import msgspec

from services.can.diagnostics import obd, uds
from services.can.diagnostics.addresses import request_id
from services.can.diagnostics.client import Reply
from services.can.errors import MalformedFrame
from services.can.profiles.privacy import VIN_HELD_BACK, Privacy

_DATA_AFTER = {0x22: 3, 0x19: 2, 0x3E: 2}
_VIN_ANSWERS = (b"\x49\x02", *(b"\x62" + each.to_bytes(2, "big") for each in uds.VINS))
_UDS_DATA = (0x62, 0x59)
_LIKE_VIN = re.compile(rb"[A-HJ-NPR-Z0-9]{17}")
"""The letters and digits of ISO 3779."""

Names = dict[int, str]


class UnitAnswer(msgspec.Struct, frozen=True, kw_only=True, omit_defaults=True):
    """One unit's answer: `decoded`, or why it `refused`."""

    ecu: str
    arbitration_id: str
    decoded: dict[str, Any] | None = None
    refused: str | None = None
    raw_data: list[int] | None = None


class ObdAnswer(msgspec.Struct, frozen=True, kw_only=True, omit_defaults=True):
    """`status`: ok, refused, timeout or error. The head is the first unit's that has an answer, of lists of codes all
    units'; `units` has each. `ended`: answered (all units that answer this have), quiet (some have, then no more),
    timeout. `missing`: units that are known to answer this and did not.
    """

    status: str
    arbitration_id: str | None = None
    response_service: int | None = None
    pid: int | None = None
    decoded: dict[str, Any] | None = None
    raw_data: list[int] | None = None
    message: str | None = None
    units: list[UnitAnswer] = []
    ended: str = ""
    missing: list[str] = []


class UnitResponse(msgspec.Struct, frozen=True, kw_only=True):
    """One unit's answer; response_code 0 is positive, else the negative response code of ISO 14229. data_field: the
    first six bytes of data as a number.
    """

    ecu: str
    service_id: int
    parameter_id: int
    response_code: int
    data_field: int
    data: list[int] = []


class DiagnosticAnswer(msgspec.Struct, frozen=True, kw_only=True, omit_defaults=True):
    """`status`: ok, refused, timeout or error; `ended` and `missing` as in the OBD answer."""

    status: str
    responses: list[UnitResponse]
    message: str | None = None
    ended: str = ""
    missing: list[str] = []


class UnitReport(msgspec.Struct, frozen=True, kw_only=True, omit_defaults=True):
    """What units say in words. `status`: ok, refused, timeout or error."""

    status: str
    units: list[UnitAnswer] = []
    message: str | None = None
    ended: str = ""
    missing: list[str] = []


class FaultAnswer(msgspec.Struct, frozen=True, kw_only=True, omit_defaults=True):
    """`status`: ok, refused, timeout or error."""

    status: str
    active_preset: str | None = None
    description: str | None = None
    dtcs: list[str] = []
    message: str | None = None


def unit_name(names: Names, answer_id: int) -> str:
    """The unit that answers here, by the profile; else its id."""
    return names.get(request_id(answer_id), f"0x{answer_id:X}")


def spells_vin(answer: bytes) -> bool:
    """Whether the bytes of this answer hold the vehicle's identification number: because they should, or because a
    unit's own identifier or record holds what looks like one.
    """
    return answer.startswith(_VIN_ANSWERS) or (answer[0] in _UDS_DATA and _LIKE_VIN.search(answer) is not None)


def unit_answer(names: Names, privacy: Privacy, answer_id: int, payload: bytes, answer: bytes) -> UnitAnswer:
    """One unit's answer in words. The identification number is told as `privacy` allows, its bytes only in the clear."""
    name, on = unit_name(names, answer_id), f"0x{answer_id:X}"
    if obd.is_negative(answer):
        return UnitAnswer(ecu=name, arbitration_id=on, refused=uds.refusal(answer[2]), raw_data=list(answer))
    hidden = spells_vin(answer) and not privacy.allow_vin
    raw = None if hidden else list(answer)
    try:
        decoded = obd.decode(answer) if payload[0] < 0x10 else uds.words(payload, answer)
    except MalformedFrame as error:
        return UnitAnswer(ecu=name, arbitration_id=on, refused=str(error), raw_data=raw)
    if hidden:
        decoded = {"vin": privacy.vin(str(decoded["vin"]))} if "vin" in decoded else {"held_back": VIN_HELD_BACK}
    return UnitAnswer(ecu=name, arbitration_id=on, decoded=decoded, raw_data=raw)


def unit_answers(names: Names, privacy: Privacy, payload: bytes, reply: Reply) -> list[UnitAnswer]:
    """Every unit's answer, in the order of their ids."""
    return [unit_answer(names, privacy, unit, payload, answer) for unit, answer in sorted(reply.answers.items())]


def missing(names: Names, reply: Reply) -> list[str]:
    """The units that are known to answer and did not, by name."""
    return [unit_name(names, unit) for unit in reply.missing]


def unit_response(names: Names, privacy: Privacy, answer_id: int, answer: bytes, parameter_id: int) -> UnitResponse:
    """One unit's answer as numbers; none of the identification number unless `privacy` allows it."""
    negative = obd.is_negative(answer)
    service = answer[1] if negative else answer[0] - 0x40
    hidden = negative or (spells_vin(answer) and not privacy.allow_vin)
    data = b"" if hidden else answer[_DATA_AFTER.get(service, 1) :]
    return UnitResponse(
        ecu=unit_name(names, answer_id),
        service_id=service,
        parameter_id=parameter_id,
        response_code=answer[2] if negative else 0,
        data_field=int.from_bytes(data[:6], "big"),
        data=list(data),
    )
