"""The tools that send: OBD and UDS requests, fault scenarios, clearing, resets. Each waits for its answers."""

from collections.abc import Callable
from typing import Literal, NamedTuple

from services.can.diagnostics import gate, obd, uds
from services.can.diagnostics.client import Reply
from services.can.errors import RequestRefused
from services.can.tools import replies
from services.can.tools.replies import DiagnosticAnswer, FaultAnswer, ObdAnswer, UnitReport
from services.can.vehicle import Vehicle

MIN_WAIT_S, MAX_WAIT_S = 0.05, 5.0
ROUTINE_START = 0x01
STANDING_MPS = 0.3
"""Above the noise of a standing wheel's sensor, below walking."""
Reset = Literal["hard", "key_off_on", "soft"]
RESETS: dict[Reset, int] = {"hard": 0x01, "key_off_on": 0x02, "soft": 0x03}
NOBODY = Reply({}, "timeout")
ClearBy = Literal["obd", "uds"]
CLEARS: dict[ClearBy, bytes] = {"obd": bytes([gate.CLEAR_OBD]), "uds": bytes([gate.CLEAR_UDS, 0xFF, 0xFF, 0xFF])}


class Found(NamedTuple):
    """What was asked and what came back; or why nothing did."""

    payload: bytes
    reply: Reply
    status: str = "ok"
    message: str | None = None


def ask(
    vehicle: Vehicle,
    payload: Callable[[], bytes],
    ecu: str | int | None,
    timeout_s: float,
    allowed: frozenset[int] = gate.NOTHING,
) -> Found:
    """Ask and wait; `payload` may raise ValueError."""
    wait_s = min(max(timeout_s, MIN_WAIT_S), MAX_WAIT_S)
    try:
        asked = payload()
        reply = vehicle.diagnostics.ask(asked, _unit(vehicle, ecu), timeout_s=wait_s, allowed=allowed)
    except RequestRefused as error:
        return Found(b"", NOBODY, "refused", str(error))
    except ValueError as error:
        return Found(b"", NOBODY, "error", str(error))
    except TimeoutError as error:
        return Found(b"", NOBODY, "timeout", str(error))
    if not reply.answers:
        return Found(asked, reply, "timeout", f"no unit answered within {wait_s:g} s")
    return Found(asked, reply)


def _unit(vehicle: Vehicle, ecu: str | int | None) -> int | None:
    """The physical request id of a unit, by its name or that id. Raises ValueError."""
    if ecu is None or isinstance(ecu, int):
        return ecu
    ids = {name: request_id for request_id, name in vehicle.profile.ecu_names.items()}
    if ecu not in ids:
        raise ValueError(f"ecu: there is no unit {ecu[:40]!r}; there are {', '.join(ids)}")
    return ids[ecu]


def send_obd(
    vehicle: Vehicle,
    service: int,
    pid: int | None,
    timeout_s: float,
    *,
    pids: tuple[int, ...] = (),
    frame: int = 0,
    ecu: str | None = None,
) -> ObdAnswer:
    """One OBD request to all units, or to one: the answers of all units that have one."""
    wanted = pids or (() if pid is None else (pid,))
    found = ask(vehicle, lambda: obd.request(service, wanted, frame), ecu, timeout_s)
    if found.message is not None:
        return ObdAnswer(status=found.status, pid=pid, message=found.message)
    return _obd_answer(vehicle, found, pid)


def _obd_answer(vehicle: Vehicle, found: Found, pid: int | None) -> ObdAnswer:
    names, service = vehicle.profile.ecu_names, found.payload[0]
    units = replies.unit_answers(names, vehicle.privacy, found.payload, found.reply)
    head = next((unit for unit in units if unit.refused is None), units[0])
    return ObdAnswer(
        status="ok" if head.refused is None else "refused",
        arbitration_id=head.arbitration_id,
        response_service=None if head.refused else service + 0x40,
        pid=pid,
        decoded=_gathered(service, units) if service in obd.CODE_LISTS else head.decoded,
        raw_data=head.raw_data,
        message=f"the unit refused: {head.refused}" if head.refused else None,
        units=units,
        ended=found.reply.ended,
        missing=replies.missing(names, found.reply),
    )


def _gathered(service: int, units: list[replies.UnitAnswer]) -> dict[str, object] | None:
    """Every unit's codes in one list."""
    key = f"{obd.CODE_LISTS[service]}_codes"
    lists = {unit.arbitration_id: unit.decoded[key] for unit in units if unit.decoded and key in unit.decoded}
    return {key: sorted({code for each in lists.values() for code in each}), "by_unit": lists} if lists else None


def diagnostic_payload(service_id: int, parameter_id: int, data_field: int) -> bytes:
    """The request of ISO 14229 (SAE J1979 for ids below 0x10). ValueError: a number does not fit its field."""
    if not (0 <= service_id <= 0xFF and 0 <= parameter_id <= 0xFFFF and 0 <= data_field <= 0xFFFF):
        raise ValueError("service_id is one byte, parameter_id and data_field at most two")
    if service_id == 0x22:
        return uds.identifier_request(parameter_id)
    if service_id == 0x19:
        return bytes([service_id, parameter_id & 0xFF, data_field & 0xFF])
    if service_id == 0x3E:
        return bytes([service_id, 0x00])
    if service_id < 0x10:
        return obd.request(service_id, (parameter_id & 0xFF,), data_field & 0xFF)
    return bytes([service_id]) + parameter_id.to_bytes(2, "big") + data_field.to_bytes(2, "big")


def send_diagnostic(
    vehicle: Vehicle, service_id: int, parameter_id: int, data_field: int, timeout_s: float, ecu: str | None = None
) -> DiagnosticAnswer:
    """One request to every unit or to one, answered in numbers."""
    found = ask(vehicle, lambda: diagnostic_payload(service_id, parameter_id, data_field), ecu, timeout_s)
    return _numbers(vehicle, found, parameter_id)


def _numbers(vehicle: Vehicle, found: Found, parameter_id: int = 0) -> DiagnosticAnswer:
    names, reply = vehicle.profile.ecu_names, found.reply
    return DiagnosticAnswer(
        status=found.status,
        responses=[
            replies.unit_response(names, vehicle.privacy, unit, answer, parameter_id)
            for unit, answer in sorted(reply.answers.items())
        ],
        message=found.message,
        ended=reply.ended,
        missing=replies.missing(names, reply),
    )


def read_units(vehicle: Vehicle, payload: Callable[[], bytes], ecu: str | None, timeout_s: float) -> UnitReport:
    """One reading request to every unit or to one, answered in words."""
    found = ask(vehicle, payload, ecu, timeout_s)
    names = vehicle.profile.ecu_names
    units = replies.unit_answers(names, vehicle.privacy, found.payload, found.reply)
    refused = bool(units) and all(unit.refused is not None for unit in units)
    return UnitReport(
        status="refused" if refused else found.status,
        units=units,
        message=found.message,
        ended=found.reply.ended,
        missing=replies.missing(names, found.reply),
    )


def activate_fault(vehicle: Vehicle, preset: str | None, timeout_s: float, *, allowed: bool) -> FaultAnswer:
    """Ask the simulated car's test unit for a fault scenario; `none` (or nothing) ends all."""
    scenarios = vehicle.profile.fault_scenarios
    name = preset or "none"
    if not allowed or not scenarios:
        return FaultAnswer(
            status="refused",
            message="fault scenarios are for simulation only: set allow_fault_scenarios in the CAN service's configuration",
        )
    if name not in scenarios:
        return FaultAnswer(
            status="error", message=f"no scenario {name[:40]!r}; there are {', '.join(sorted(scenarios))}"
        )
    row = scenarios[name]
    payload = bytes([gate.ROUTINE, ROUTINE_START]) + row.routine.to_bytes(2, "big")
    try:
        reply = vehicle.diagnostics.ask(
            payload, gate.TEST_UNIT_ID, timeout_s=timeout_s, allowed=frozenset({gate.ROUTINE})
        )
    except TimeoutError as error:
        return FaultAnswer(status="timeout", message=str(error))
    if not reply.answers:
        return FaultAnswer(status="timeout", message="the test unit did not answer: is this car simulated?")
    if obd.is_negative(next(iter(reply.answers.values()))):
        return FaultAnswer(status="refused", message="the test unit refused")
    codes = list((send_obd(vehicle, 0x03, None, timeout_s).decoded or {}).get("stored_codes", []))
    return FaultAnswer(
        status="ok", active_preset=None if name == "none" else name, description=row.description, dtcs=codes
    )


def _not_standing(vehicle: Vehicle, now_ns: int) -> str:
    """Why nothing may be changed in this car now; empty where it stands."""
    speed_mps = vehicle.ego(now_ns).speed_mps
    if speed_mps is None:
        return "the speed is not known; this is done on a standing car only"
    return "" if abs(speed_mps) <= STANDING_MPS else f"the car moves at {speed_mps:.1f} m/s; this is done standing only"


def clear_codes(
    vehicle: Vehicle, by: ClearBy, ecu: str | int | None, timeout_s: float, *, now_ns: int
) -> DiagnosticAnswer:
    """Clear trouble codes: service 04, or 14 for all groups. The caller has checked grant and confirmation."""
    if reason := _not_standing(vehicle, now_ns):
        return DiagnosticAnswer(status="refused", responses=[], message=reason)
    payload = CLEARS[by]
    return _numbers(vehicle, ask(vehicle, lambda: payload, ecu, timeout_s, frozenset({payload[0]})))


def reset_unit(vehicle: Vehicle, ecu: str, kind: Reset, timeout_s: float, *, now_ns: int) -> DiagnosticAnswer:
    """Restart one unit (service 11). The caller has checked grant and confirmation."""
    if reason := _not_standing(vehicle, now_ns):
        return DiagnosticAnswer(status="refused", responses=[], message=reason)
    payload = bytes([gate.RESET, RESETS[kind]])
    return _numbers(vehicle, ask(vehicle, lambda: payload, ecu, timeout_s, frozenset({gate.RESET})))
