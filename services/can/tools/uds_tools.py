"""The tools of Peykan's catalogue that ask one unit by ISO 14229, by its names and shapes; and the identification number."""

import re
from typing import Annotated, Any

import msgspec

from drivemcp.node import Node
from services.can.diagnostics import obd, uds, vin
from services.can.diagnostics.addresses import PHYSICAL_IDS, answer_id
from services.can.errors import MalformedFrame
from services.can.profiles.privacy import VIN_HELD_BACK
from services.can.tools import replies, requests
from services.can.tools.diagnostic_tools import DEADLINE_MS, Timeout
from services.can.tools.parameters import HexText, RequestId, ResponseId, number_of
from services.can.tools.requests import Found
from services.can.vehicle import Vehicle

Identifier = Annotated[int, msgspec.Meta(ge=0, le=0xFFFF)] | HexText
Identifiers = Annotated[
    Annotated[list[Identifier], msgspec.Meta(min_length=1, max_length=16)] | Identifier,
    msgspec.Meta(
        description="each a number or hex text: F190 identification number, F40C engine speed",
        examples=[["0xF190", "0xF40C"]],
    ),
]
StatusMask = Annotated[
    Annotated[int, msgspec.Meta(ge=0, le=0xFF)] | HexText,
    msgspec.Meta(description="status bits, a number or hex text: 0x01 failing now, 0x08 confirmed",
                 examples=["0xFF"]),
]  # fmt: skip


LIKE_NUMBER = re.compile(r"[A-Z0-9]{17}")
"""Letters that ISO 3779 leaves out are told, too: then there is no check digit."""


class VinAnswer(msgspec.Struct, frozen=True, kw_only=True, omit_defaults=True):
    """`status`: ok, refused, timeout or error. `vin`: in the clear where allow_vin is on, else its salted hash.
    `check_digit_valid`: absent where letters are not those of ISO 3779; False says little outside North America and
    China, where the digit need not be one.
    """

    status: str
    vin: str | None = None
    check_digit_valid: bool | None = None
    ecu: str | None = None
    message: str | None = None


class DataValue(msgspec.Struct, frozen=True, kw_only=True, omit_defaults=True):
    """One identifier: its bytes in hex, what they mean where that is known; or why the unit `refused` it."""

    did: str
    name: str | None = None
    raw: str | None = None
    value: Any = None
    unit: str | None = None
    refused: str | None = None


class UdsData(msgspec.Struct, frozen=True, kw_only=True, omit_defaults=True):
    """`status`: ok, refused (every identifier), timeout or error."""

    status: str
    values: list[DataValue] = []
    message: str | None = None


class UdsCode(msgspec.Struct, frozen=True, kw_only=True):
    """A trouble code: `test_failed` among the bits is a fault that is there now, `confirmed` alone one that was."""

    code: str
    failure_type: int
    uds_id: str
    status: str
    status_bits: list[str]


class UdsCodes(msgspec.Struct, frozen=True, kw_only=True, omit_defaults=True):
    """`status`: ok, refused, timeout or error."""

    status: str
    dtcs: list[UdsCode] = []
    message: str | None = None


class UdsCleared(msgspec.Struct, frozen=True, kw_only=True, omit_defaults=True):
    """`status`: ok, refused, timeout or error."""

    status: str
    message: str | None = None


def offer(node: Node, vehicle: Vehicle) -> None:
    """Add them to the node."""

    @node.tool(deadline_ms=DEADLINE_MS, capability="diagnostic", read_only=True)
    def read_vin(timeout_s: Timeout = 2.0) -> VinAnswer:
        """Ask the car for its identification number (OBD service 9), told hashed unless allow_vin is on, and whether its
        check digit is right.
        """
        return _vin(vehicle, timeout_s)

    @node.tool(deadline_ms=DEADLINE_MS, capability="diagnostic", read_only=True)
    def uds_read_data(
        dids: Identifiers,
        request_id: RequestId = "0x7E0",
        response_id: ResponseId = "0x7E8",
        timeout_s: Timeout = 2.0,
    ) -> UdsData:
        """Read data identifiers of one unit (ISO 14229 service 0x22), each asked for by itself: bytes, meaning, unit."""
        return _data(vehicle, dids if isinstance(dids, list) else [dids], request_id, response_id, timeout_s)

    @node.tool(deadline_ms=DEADLINE_MS, capability="diagnostic", read_only=True)
    def uds_read_dtcs(
        status_mask: StatusMask = "0xFF",
        request_id: RequestId = "0x7E0",
        response_id: ResponseId = "0x7E8",
        timeout_s: Timeout = 2.0,
    ) -> UdsCodes:
        """Trouble codes that one unit keeps, with their status bits (ISO 14229 service 0x19)."""
        return _codes(vehicle, status_mask, request_id, response_id, timeout_s)

    @node.tool(deadline_ms=DEADLINE_MS, capability="actuation", idempotent=False)
    def uds_clear_dtcs(
        request_id: RequestId = "0x7E0", response_id: ResponseId = "0x7E8", timeout_s: Timeout = 2.0
    ) -> UdsCleared:
        """Clear all trouble codes of one unit (ISO 14229 service 0x14). Takes a grant and a confirmation of exactly this
        command; the car must stand. A fault that is still there sets its code again.
        """
        return _clear(vehicle, request_id, response_id, timeout_s, node.clock.now_ns())


def _vin(vehicle: Vehicle, timeout_s: float) -> VinAnswer:
    found = requests.ask(vehicle, lambda: obd.request(0x09, (0x02,)), None, timeout_s)
    if found.message is not None:
        return VinAnswer(status=found.status, message=found.message)
    numbers = {unit: _text(answer) for unit, answer in sorted(found.reply.answers.items())}
    told = {unit: text for unit, text in numbers.items() if text is not None}
    if not told:
        refusals = [answer[2] for answer in found.reply.answers.values() if obd.is_negative(answer)]
        if refusals:
            return VinAnswer(status="refused", message=f"the unit refused: {uds.refusal(refusals[0])}")
        return VinAnswer(status="error", message="the answer is no identification number of 17 letters and digits")
    unit, text = next(iter(told.items()))
    return VinAnswer(
        status="ok",
        vin=vehicle.privacy.vin(text),
        check_digit_valid=vin.check_digit_valid(text),
        ecu=replies.unit_name(vehicle.profile.ecu_names, unit),
        message="the units give different numbers; ask each with uds_read_data"
        if len(set(told.values())) > 1
        else None,
    )


def _text(answer: bytes) -> str | None:
    """The number in a positive answer; None for any other answer."""
    text = "" if obd.is_negative(answer) else str(obd.decode(answer).get("vin", ""))
    return text if LIKE_NUMBER.fullmatch(text) else None


def _unit(request_id: int | str, response_id: int | str) -> int:
    """The request id of one unit. Raises ValueError unless it is one and the unit answers where it is said to."""
    asked, answers = (
        number_of(request_id, "request_id", 0x1FFFFFFF),
        number_of(response_id, "response_id", 0x1FFFFFFF),
    )
    if asked not in PHYSICAL_IDS:
        raise ValueError(f"request_id: 0x{asked:X} asks no single unit; take 0x7E0 to 0x7E7 or 0x18DAxxF1")
    if answers != answer_id(asked):
        raise ValueError(f"response_id: the unit asked on 0x{asked:X} answers on 0x{answer_id(asked):X}; give that")
    return asked


def _data(
    vehicle: Vehicle, dids: list[int | str], request_id: int | str, response_id: int | str, timeout_s: float
) -> UdsData:
    """One after another; the first without an answer ends it, so that silence is waited for once."""
    values: list[DataValue] = []
    try:
        unit = _unit(request_id, response_id)
        wanted = [number_of(did, "dids", 0xFFFF) for did in dids]
    except ValueError as error:
        return UdsData(status="error", message=str(error))
    for did in wanted:
        found = requests.ask(vehicle, lambda did=did: uds.identifier_request(did), unit, timeout_s)  # type: ignore[misc]
        if found.message is not None:
            return UdsData(status=found.status, values=values, message=found.message)
        values.append(_value(vehicle, did, found))
    refused = all(each.refused is not None for each in values)
    return UdsData(status="refused" if refused else "ok", values=values, message=values[0].refused if refused else None)


def _value(vehicle: Vehicle, did: int, found: Found) -> DataValue:
    name, answer = f"0x{did:04X}", next(iter(found.reply.answers.values()))
    if obd.is_negative(answer):
        return DataValue(did=name, refused=uds.refusal(answer[2]))
    try:
        words = uds.words(found.payload, answer)
    except MalformedFrame as error:
        return DataValue(did=name, refused=str(error))
    raw: str | None = answer[3:].hex(" ")
    if replies.spells_vin(answer) and not vehicle.privacy.allow_vin:
        raw, words = (
            None,
            {"vin": vehicle.privacy.vin(str(words["vin"]))} if "vin" in words else {"held_back": VIN_HELD_BACK},
        )
    unit = words.pop("unit", None)
    known = {key: value for key, value in words.items() if not key.startswith("identifier_")}
    head = next(iter(known), None)
    return DataValue(
        did=name,
        name=head if len(known) == 1 else None,
        raw=raw,
        value=known[head] if len(known) == 1 and head is not None else known or None,
        unit=unit,
    )


def _codes(
    vehicle: Vehicle, status_mask: int | str, request_id: int | str, response_id: int | str, timeout_s: float
) -> UdsCodes:
    try:
        unit, mask = _unit(request_id, response_id), number_of(status_mask, "status_mask", 0xFF)
    except ValueError as error:
        return UdsCodes(status="error", message=str(error))
    found = requests.ask(vehicle, lambda: uds.codes_request("by_status", mask, "", 1), unit, timeout_s)
    if found.message is not None:
        return UdsCodes(status=found.status, message=found.message)
    answer = next(iter(found.reply.answers.values()))
    if obd.is_negative(answer):
        return UdsCodes(status="refused", message=f"the unit refused: {uds.refusal(answer[2])}")
    try:
        rows = uds.words(found.payload, answer)["codes"]
    except MalformedFrame as error:
        return UdsCodes(status="error", message=str(error))
    return UdsCodes(status="ok", dtcs=[_code(row) for row in rows])


def _code(row: dict[str, Any]) -> UdsCode:
    status = sum(1 << uds.FLAGS.index(name) for name in row["status"])
    return UdsCode(
        code=row["code"],
        failure_type=int(row["failure_type"], 16),
        uds_id=f"0x{uds.number_of(row['code'] + '-' + row['failure_type']):06X}",
        status=f"0x{status:02X}",
        status_bits=row["status"],
    )


def _clear(
    vehicle: Vehicle, request_id: int | str, response_id: int | str, timeout_s: float, now_ns: int
) -> UdsCleared:
    try:
        unit = _unit(request_id, response_id)
    except ValueError as error:
        return UdsCleared(status="error", message=str(error))
    answer = requests.clear_codes(vehicle, "uds", unit, timeout_s, now_ns=now_ns)
    refused = next((each.response_code for each in answer.responses if each.response_code), None)
    if refused is not None:
        return UdsCleared(status="refused", message=f"the unit refused: {uds.refusal(refused)}")
    return UdsCleared(status=answer.status, message=answer.message)
