"""On-board diagnostics in words: the services of SAE J1979, which answer belongs to which request, and what it says."""

from collections.abc import Iterator, Mapping
from typing import Any

from services.can.diagnostics import pids
from services.can.diagnostics.trouble_codes import code_of

WITH_PID = frozenset({0x01, 0x02, 0x06, 0x09})
CODE_LISTS: Mapping[int, str] = {0x03: "stored", 0x07: "pending", 0x0A: "permanent"}
MAX_PIDS = 6
"""In one request (SAE J1979)."""
NEGATIVE, PENDING = 0x7F, 0x78
ECHOED: Mapping[int, int] = {0x02: 2, 0x06: 1, 0x09: 1, 0x11: 1, 0x19: 1, 0x22: 2, 0x31: 3, 0x3E: 1}
"""How many bytes of the request, after the service, a positive answer repeats."""

_CONTINUOUS = ("misfire", "fuel_system", "components")
_SPARK = (
    "catalyst", "heated_catalyst", "evaporative_system", "secondary_air", "particulate_filter_petrol",
    "oxygen_sensor", "oxygen_sensor_heater", "exhaust_gas_recirculation",
)  # fmt: skip
_COMPRESSION = (
    "hydrocarbon_catalyst", "nox_aftertreatment", "", "boost_pressure", "", "exhaust_gas_sensor",
    "particulate_filter", "exhaust_gas_recirculation",
)  # fmt: skip
_TEXTS: Mapping[int, tuple[str, int]] = {0x02: ("vin", 17), 0x04: ("calibration_id", 16), 0x0A: ("ecu_name", 20)}


def request(service: int, wanted: tuple[int, ...] = (), frame: int = 0) -> bytes:
    """The payload of an OBD request; `frame`: which freeze frame. ValueError: parameters are missing or too many."""
    if not all(0 <= number <= 0xFF for number in (service, frame, *wanted)):
        raise ValueError("service, pid and frame are single bytes")
    if service not in WITH_PID:
        return bytes([service])
    if not wanted:
        raise ValueError(f"service 0x{service:02X} needs a pid")
    if len(wanted) > (MAX_PIDS if service == 0x01 else 1):
        raise ValueError(f"service 0x{service:02X}: one pid at a time, of service 01 at most {MAX_PIDS}")
    return bytes([service, *wanted]) + (bytes([frame]) if service == 0x02 else b"")


def is_negative(answer: bytes) -> bool:
    """Whether a unit says no."""
    return answer[:1] == bytes([NEGATIVE])


def is_pending(answer: bytes) -> bool:
    """Whether a unit says that its answer follows later."""
    return is_negative(answer) and answer[2:3] == bytes([PENDING])


def answers_to(payload: bytes, answer: bytes) -> bool:
    """Whether `answer` (its first bytes do) belongs to `payload`: by service, and by what the service repeats."""
    if is_negative(answer):
        return len(answer) >= 3 and answer[1] == payload[0]
    if not answer or answer[0] != payload[0] + 0x40:
        return False
    if payload[0] == 0x01:
        return answer[1:2] != b"" and answer[1] in payload[1:]
    echoed = ECHOED.get(payload[0], 0)
    return answer[1 : 1 + echoed] == payload[1 : 1 + echoed]


def is_list(answer: bytes) -> bool:
    """Whether this is a positive answer to services 03, 07 or 0A with all the codes that it announces."""
    return len(answer) >= 2 and answer[0] - 0x40 in CODE_LISTS and len(answer) >= 2 + 2 * answer[1]


def codes(answer: bytes) -> tuple[str, ...]:
    """The trouble codes in an answer to services 03, 07 or 0A: a count, then two bytes each (ISO 15765-4)."""
    pairs = answer[2:]
    found = (code_of(pairs[i], pairs[i + 1]) for i in range(0, len(pairs) - 1, 2) if pairs[i] or pairs[i + 1])
    return tuple(found)


def decode(answer: bytes) -> dict[str, Any]:
    """A positive OBD answer in words and units; empty where service or parameter is not in the tables."""
    if len(answer) < 2:
        return {}
    service = answer[0] - 0x40
    if service in CODE_LISTS:
        return {f"{CODE_LISTS[service]}_codes": list(codes(answer))}
    if service == 0x09:
        return _vehicle_information(answer[1], answer[2:])
    if service == 0x02:
        return parameter(answer[1], answer[3:])
    return _parameters(answer[1:]) if service == 0x01 else {}


def values(data: bytes) -> Iterator[tuple[int, bytes]]:
    """The parameters in an answer to service 01, one after another; ends at one whose size is not known."""
    while data and (size := pids.size_of(data[0])) is not None and len(data) > size:
        yield data[0], data[1 : 1 + size]
        data = data[1 + size :]


def _parameters(data: bytes) -> dict[str, Any]:
    """One parameter as it is; several side by side, with the units under `units`."""
    found = [parameter(pid, value) for pid, value in values(data)]
    if len(found) <= 1:
        return found[0] if found else {}
    units = {name: each["unit"] for each in found for name in each if name != "unit" and "unit" in each}
    return {name: value for each in found for name, value in each.items() if name != "unit"} | {"units": units}


def parameter(pid: int, data: bytes) -> dict[str, Any]:
    """One parameter of service 01 or 02 in words; empty where it is unknown or too short."""
    size = pids.size_of(pid)
    if size is None or len(data) < size:
        return {}
    if pid in pids.BITMAPS:
        return {"supported": [f"0x{each:02X}" for each in supported(pid, data)]}
    if pid in pids.MONITORS:
        return monitors(pid, data)
    if pid == pids.FREEZE_CODE:
        return {"freeze_frame_code": code_of(data[0], data[1]) if any(data[:2]) else ""}
    if pid in pids.CODED:
        return {name: words.get(code, code) for (name, words), code in zip(pids.CODED[pid], data, strict=False)}
    parts = [part for part in pids.PIDS[pid].parts if part.present(data)]
    return {part.name: part.value(data) for part in parts} | ({"unit": parts[0].unit} if parts else {})


def supported(base: int, data: bytes) -> tuple[int, ...]:
    """Which parameters a bitmap names."""
    bits = int.from_bytes(data[:4], "big")
    return tuple(base + i for i in range(1, 33) if bits >> (32 - i) & 1)


def monitors(pid: int, data: bytes) -> dict[str, Any]:
    """Lamp, number of codes, and each monitor that the unit has: whether it is ready."""
    kinds = _COMPRESSION if data[1] & 0x08 else _SPARK
    ready = {name: not data[1] >> (4 + i) & 1 for i, name in enumerate(_CONTINUOUS) if data[1] >> i & 1}
    ready |= {name: not data[3] >> i & 1 for i, name in enumerate(kinds) if name and data[2] >> i & 1}
    head = {"malfunction_lamp": data[0] >> 7, "stored_count": data[0] & 0x7F} if pid == 0x01 else {}
    return head | {"ready": ready}


def _vehicle_information(item: int, data: bytes) -> dict[str, Any]:
    """Service 09: how many, then each as text (SAE J1979); calibration verification numbers as hex."""
    if item == 0x00:
        return {"supported": [f"0x{each:02X}" for each in supported(0, data[-4:])]}
    if item == 0x06:
        return {"calibration_verification": [data[i : i + 4].hex().upper() for i in range(1, len(data) - 3, 4)]}
    if item not in _TEXTS:
        return {}
    name, size = _TEXTS[item]
    texts = [_text(data[i : i + size]) for i in range(1, len(data), size)]
    return {name: texts[0] if len(texts) == 1 else texts}


def _text(data: bytes) -> str:
    return data.decode("ascii", "replace").strip("\x00 ")
