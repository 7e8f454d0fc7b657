"""The tools that send: OBD and diagnostic requests, fault scenarios, clearing. Each waits for its answer, and no
longer.
"""

from services.can import answers, gate, obd
from services.can.answers import DiagnosticAnswer, FaultAnswer, ObdAnswer
from services.can.errors import RequestRefused
from services.can.vehicle import Vehicle

MIN_WAIT_S, MAX_WAIT_S = 0.05, 5.0
TEST_UNIT_ID = 0x7E7
ROUTINE_START = 0x01


def _bounded(timeout_s: float) -> float:
    return min(max(timeout_s, MIN_WAIT_S), MAX_WAIT_S)


def send_obd(vehicle: Vehicle, service: int, pid: int | None, timeout_s: float) -> ObdAnswer:
    """One OBD request to everybody; a list of codes is gathered from all units, a parameter taken from the first that
    has it.
    """
    try:
        payload = obd.request(service, pid)
        many = service in obd.CODE_LISTS
        with vehicle.diagnostics.request(
            gate.FUNCTIONAL_ID, payload, first_only=not many, timeout_s=_bounded(timeout_s)
        ) as exchange:
            exchange.wait(_bounded(timeout_s))
            found = dict(exchange.answers)
    except (RequestRefused, ValueError) as error:
        return ObdAnswer(
            status="refused" if isinstance(error, RequestRefused) else "error", pid=pid, message=str(error)
        )
    except TimeoutError as error:
        return ObdAnswer(status="timeout", pid=pid, message=str(error))
    if not found:
        return ObdAnswer(status="timeout", pid=pid, message=f"no unit answered within {_bounded(timeout_s):g} s")
    return _gathered(found, service) if many else answers.obd_answer(*next(iter(found.items())), pid)


def _gathered(found: dict[int, bytes], service: int) -> ObdAnswer:
    """Every unit's codes as one answer; the raw data is the first unit's that has any."""
    positive = {unit: answer for unit, answer in sorted(found.items()) if answer[0] != 0x7F}
    if not positive:
        return answers.obd_answer(*next(iter(found.items())), None)
    lists = {unit: obd.codes(answer) for unit, answer in positive.items()}
    unit = next((unit for unit, codes in lists.items() if codes), next(iter(positive)))
    codes = sorted({code for each in lists.values() for code in each})
    return ObdAnswer(
        status="ok",
        arbitration_id=f"0x{unit:X}",
        response_service=positive[unit][0],
        decoded={f"{obd.CODE_LISTS[service]}_codes": codes, "by_unit": {f"0x{k:X}": list(v) for k, v in lists.items()}},
        raw_data=list(positive[unit]),
    )


def diagnostic_payload(service_id: int, parameter_id: int, data_field: int) -> bytes:
    """The request of ISO 14229 (or SAE J1979 for ids below 0x10). Raises ValueError where a number does not fit its
    field.
    """
    if not (0 <= service_id <= 0xFF and 0 <= parameter_id <= 0xFFFF and 0 <= data_field <= 0xFFFF):
        raise ValueError("service_id is one byte, parameter_id and data_field at most two")
    if service_id == 0x22:
        return bytes([service_id]) + parameter_id.to_bytes(2, "big")
    if service_id == 0x19:
        return bytes([service_id, parameter_id & 0xFF, data_field & 0xFF])
    if service_id == 0x3E:
        return bytes([service_id, 0x00])
    if service_id < 0x10:
        return obd.request(service_id, parameter_id & 0xFF)
    return bytes([service_id]) + parameter_id.to_bytes(2, "big") + data_field.to_bytes(2, "big")


def send_diagnostic(
    vehicle: Vehicle, service_id: int, parameter_id: int, data_field: int, timeout_s: float
) -> DiagnosticAnswer:
    """One request to every unit; returns when all have answered, or when the bus has fallen quiet after the last
    answer.
    """
    try:
        payload = diagnostic_payload(service_id, parameter_id, data_field)
        with vehicle.diagnostics.request(
            gate.FUNCTIONAL_ID, payload, first_only=False, timeout_s=_bounded(timeout_s)
        ) as exchange:
            exchange.wait(_bounded(timeout_s))
            found = dict(exchange.answers)
    except (RequestRefused, ValueError) as error:
        status = "refused" if isinstance(error, RequestRefused) else "error"
        return DiagnosticAnswer(status=status, responses=[], message=str(error))
    except TimeoutError as error:
        return DiagnosticAnswer(status="timeout", responses=[], message=str(error))
    if not found:
        return DiagnosticAnswer(
            status="timeout", responses=[], message=f"no unit answered within {_bounded(timeout_s):g} s"
        )
    responses = [answers.unit_response(vehicle, unit, answer, parameter_id) for unit, answer in sorted(found.items())]
    return DiagnosticAnswer(status="ok", responses=responses)


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
        with vehicle.diagnostics.request(
            TEST_UNIT_ID, payload, first_only=True, timeout_s=_bounded(timeout_s), faults=True
        ) as exchange:
            exchange.wait(_bounded(timeout_s))
            found = dict(exchange.answers)
    except TimeoutError as error:
        return FaultAnswer(status="timeout", message=str(error))
    if not found:
        return FaultAnswer(status="timeout", message="the test unit did not answer: is this car simulated?")
    if next(iter(found.values()))[0] == 0x7F:
        return FaultAnswer(status="refused", message="the test unit refused")
    codes = _codes_now(vehicle, timeout_s)
    return FaultAnswer(
        status="ok", active_preset=None if name == "none" else name, description=row.description, dtcs=codes
    )


def _codes_now(vehicle: Vehicle, timeout_s: float) -> list[str]:
    answer = send_obd(vehicle, 0x03, None, timeout_s)
    return list((answer.decoded or {}).get("stored_codes", []))


def clear_codes(vehicle: Vehicle, timeout_s: float) -> DiagnosticAnswer:
    """Clear stored codes in every unit (service 04). The caller has checked grant and confirmation."""
    try:
        with vehicle.diagnostics.request(
            gate.FUNCTIONAL_ID, b"\x04", first_only=False, timeout_s=_bounded(timeout_s), clearing=True
        ) as exchange:
            exchange.wait(_bounded(timeout_s))
            found = dict(exchange.answers)
    except TimeoutError as error:
        return DiagnosticAnswer(status="timeout", responses=[], message=str(error))
    if not found:
        return DiagnosticAnswer(status="timeout", responses=[], message="no unit answered")
    return DiagnosticAnswer(
        status="ok",
        responses=[answers.unit_response(vehicle, unit, answer, 0) for unit, answer in sorted(found.items())],
    )
