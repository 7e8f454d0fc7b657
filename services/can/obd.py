"""On-board diagnostics in words: SAE J1979 services and parameters, UDS identifiers, negative answers."""

from collections.abc import Callable, Mapping
from typing import NamedTuple

from services.can.dtc import code_of

Number = int | float


class Pid(NamedTuple):
    """One parameter of service 01: name, unit, number of bytes, and its formula in SAE J1979."""

    name: str
    unit: str
    size: int
    value: Callable[[bytes], Number]


def _word(data: bytes) -> int:
    return data[0] << 8 | data[1]


PIDS: Mapping[int, Pid] = {
    0x04: Pid("engine_load", "%", 1, lambda d: d[0] / 2.55),
    0x05: Pid("coolant_temperature", "degC", 1, lambda d: d[0] - 40),
    0x0A: Pid("fuel_pressure", "kPa", 1, lambda d: d[0] * 3),
    0x0B: Pid("intake_manifold_pressure", "kPa", 1, lambda d: d[0]),
    0x0C: Pid("engine_speed", "rpm", 2, lambda d: _word(d) / 4),
    0x0D: Pid("vehicle_speed", "km/h", 1, lambda d: d[0]),
    0x0E: Pid("timing_advance", "deg", 1, lambda d: d[0] / 2 - 64),
    0x0F: Pid("intake_air_temperature", "degC", 1, lambda d: d[0] - 40),
    0x10: Pid("air_flow", "g/s", 2, lambda d: _word(d) / 100),
    0x11: Pid("throttle_position", "%", 1, lambda d: d[0] / 2.55),
    0x1C: Pid("obd_standard", "", 1, lambda d: d[0]),
    0x1F: Pid("run_time", "s", 2, _word),
    0x21: Pid("distance_with_lamp", "km", 2, _word),
    0x2F: Pid("fuel_level", "%", 1, lambda d: d[0] / 2.55),
    0x31: Pid("distance_since_cleared", "km", 2, _word),
    0x33: Pid("barometric_pressure", "kPa", 1, lambda d: d[0]),
    0x42: Pid("control_unit_voltage", "V", 2, lambda d: _word(d) / 1000),
    0x45: Pid("relative_throttle", "%", 1, lambda d: d[0] / 2.55),
    0x46: Pid("outside_temperature", "degC", 1, lambda d: d[0] - 40),
    0x49: Pid("accelerator_position", "%", 1, lambda d: d[0] / 2.55),
    0x51: Pid("fuel_type", "", 1, lambda d: d[0]),
    0x5C: Pid("oil_temperature", "degC", 1, lambda d: d[0] - 40),
    0x5E: Pid("fuel_rate", "l/h", 2, lambda d: _word(d) / 20),
}
BITMAPS = frozenset({0x00, 0x20, 0x40, 0x60, 0x80, 0xA0, 0xC0, 0xE0})
WITH_PID = frozenset({0x01, 0x02, 0x06, 0x09})
CODE_LISTS: Mapping[int, str] = {0x03: "stored", 0x07: "pending", 0x0A: "permanent"}

# ISO 14229-1, the negative answers that a reader can meet.
NEGATIVE: Mapping[int, str] = {
    0x10: "general reject",
    0x11: "service not supported",
    0x12: "sub-function not supported",
    0x13: "wrong length or format",
    0x21: "busy, repeat the request",
    0x22: "conditions not correct",
    0x31: "identifier out of range",
    0x33: "security access denied",
    0x78: "answer follows later",
    0x7F: "service not supported in this session",
}
PENDING = 0x78


def request(service: int, pid: int | None) -> bytes:
    """The payload of an OBD request; freeze frames are asked for as frame 0. Raises ValueError where a parameter is
    missing.
    """
    if not 0 <= service <= 0xFF or (pid is not None and not 0 <= pid <= 0xFF):
        raise ValueError("service and pid are single bytes")
    if service in WITH_PID:
        if pid is None:
            raise ValueError(f"service 0x{service:02X} needs a pid")
        return bytes([service, pid, 0]) if service == 0x02 else bytes([service, pid])
    return bytes([service])


def answers_to(payload: bytes, answer: bytes) -> bool:
    """Whether `answer` belongs to the request `payload`: by service, and by parameter where the service has one."""
    if len(answer) >= 3 and answer[0] == 0x7F:
        return answer[1] == payload[0]
    if not answer or answer[0] != payload[0] + 0x40:
        return False
    echoed = {0x22: 2, 0x19: 1, 0x3E: 1, 0x31: 3}.get(payload[0], 1 if payload[0] in WITH_PID else 0)
    return answer[1 : 1 + echoed] == payload[1 : 1 + echoed]


def codes(answer: bytes) -> tuple[str, ...]:
    """The trouble codes in an answer to services 03, 07 or 0A: a count, then two bytes each (ISO 15765-4)."""
    pairs = answer[2:]
    found = (code_of(pairs[i], pairs[i + 1]) for i in range(0, len(pairs) - 1, 2) if pairs[i] or pairs[i + 1])
    return tuple(found)


def decode(answer: bytes) -> dict[str, Number | str | list[str]]:
    """An OBD answer in words and units; empty where the service or parameter is not in the tables."""
    if len(answer) < 2:
        return {}
    service = answer[0] - 0x40
    if service in CODE_LISTS:
        return {f"{CODE_LISTS[service]}_codes": list(codes(answer))}
    if service == 0x09:
        return _vehicle_information(answer)
    if service in (0x01, 0x02):
        return _parameter(answer[1], answer[2 if service == 0x01 else 3 :])
    return {}


def _parameter(pid: int, data: bytes) -> dict[str, Number | str | list[str]]:
    if pid in BITMAPS and len(data) >= 4:
        bits = int.from_bytes(data[:4], "big")
        return {"supported": [f"0x{pid + i:02X}" for i in range(1, 33) if bits >> (32 - i) & 1]}
    if pid == 0x01 and len(data) >= 4:
        return {"malfunction_lamp": data[0] >> 7, "stored_count": data[0] & 0x7F}
    row = PIDS.get(pid)
    if row is None or len(data) < row.size:
        return {}
    return {row.name: round(row.value(data), 3), "unit": row.unit}


def _vehicle_information(answer: bytes) -> dict[str, Number | str | list[str]]:
    names = {0x02: "vin", 0x04: "calibration_id", 0x0A: "ecu_name"}
    name = names.get(answer[1])
    if name is None:
        return {}
    return {name: answer[3:].decode("ascii", "replace").strip("\x00 ")}
