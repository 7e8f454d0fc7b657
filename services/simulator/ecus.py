"""Simulated control units: they answer diagnostic requests from the same state that the frames show.

SAE J1979 services 01, 03, 04, 07, 09, 0A; ISO 14229 services 0x19, 0x22, 0x3E; ISO 15765-2 transport with flow control.
Fault scenarios
come by RoutineControl to a test unit that no real car has.
"""

from collections.abc import Callable, Mapping
from dataclasses import replace

from proto.sensors import CanFrame
from services.simulator import car_faults
from services.simulator.car_state import CarState

FUNCTIONAL_ID = 0x7DF
ENGINE, TRANSMISSION, BRAKES, BODY, TEST_UNIT = 0x7E0, 0x7E1, 0x7E2, 0x7E3, 0x7E7
UNITS: Mapping[int, str] = {ENGINE: "engine", TRANSMISSION: "transmission", BRAKES: "brakes", BODY: "body"}
PADDING = 0xAA
FLOW_TIMEOUT_NS = 1_000_000_000

NOT_SUPPORTED, WRONG_LENGTH, CONDITIONS, OUT_OF_RANGE = 0x11, 0x13, 0x22, 0x31
SILENT_FOR_ALL = frozenset({NOT_SUPPORTED, 0x12, OUT_OF_RANGE})
"""Negative answers that a unit keeps to itself when everybody was asked (ISO 14229-1)."""


def _byte(value: float) -> bytes:
    return bytes([min(255, max(0, round(value)))])


def _word(value: float) -> bytes:
    return min(65535, max(0, round(value))).to_bytes(2, "big")


# Service 01 parameters by SAE J1979's formulas, inverted.
PIDS: Mapping[int, Callable[[CarState], bytes]] = {
    0x04: lambda s: _byte(abs(s.engine_torque_nm) / 220.0 * 255),
    0x05: lambda s: _byte(s.coolant_temperature_c + 40),
    0x0C: lambda s: _word(s.engine_rpm * 4),
    0x0D: lambda s: _byte(s.speed_mps * 3.6),
    0x0F: lambda s: _byte(s.intake_temperature_c + 40),
    0x11: lambda s: _byte(s.accelerator * 255),
    0x1C: lambda s: _byte(6),
    0x1F: lambda s: _word(s.run_time_s),
    0x2F: lambda s: _byte(s.fuel_share * 255),
    0x33: lambda s: _byte(101),
    0x42: lambda s: _word(s.battery_voltage_v * 1000),
    0x46: lambda s: _byte(s.outside_temperature_c + 40),
    0x49: lambda s: _byte(s.accelerator * 255),
    0x51: lambda s: _byte(1),
    0x5C: lambda s: _byte(s.oil_temperature_c + 40),
}


def code_bytes(code: str) -> bytes:
    """A trouble code as the two bytes on the bus: P0300 is 03 00."""
    return bytes(["PCBU".index(code[0]) << 6 | int(code[1]) << 4 | int(code[2], 16), int(code[3:], 16)])


def unit_of(code: str) -> int:
    """Which unit stores a code."""
    if code.startswith("P07"):
        return TRANSMISSION
    return {"C": BRAKES, "B": BODY}.get(code[0], ENGINE)


class _Transfer:
    """A long answer that waits for flow control."""

    def __init__(self, answer_id: int, payload: bytes, now_ns: int) -> None:
        self.answer_id, self.started_ns = answer_id, now_ns
        self.rest = payload[6:]
        self.number = 1
        self.pause_ns = 0
        self.block = 0
        self.next_ns: int | None = None
        self.head = bytes([0x10 | len(payload) >> 8, len(payload) & 0xFF]) + payload[:6]

    def flow(self, data: bytes, now_ns: int) -> bool:
        """Take a flow control frame; False where the tester gave up."""
        kind = data[0] & 0x0F
        if kind == 0 and len(data) >= 3:
            self.block, self.pause_ns, self.next_ns = data[1], _pause_ns(data[2]), now_ns
        return kind in (0, 1)

    def due(self, now_ns: int) -> list[CanFrame]:
        frames: list[CanFrame] = []
        sent = 0
        while self.rest and self.next_ns is not None and self.next_ns <= now_ns:
            data = bytes([0x20 | self.number & 0x0F]) + self.rest[:7]
            frames.append(_frame(self.answer_id, data, self.next_ns))
            self.rest, self.number, sent = self.rest[7:], self.number + 1, sent + 1
            self.next_ns = None if self.block and sent == self.block else self.next_ns + self.pause_ns
        self.block -= sent if self.block else 0
        return frames


def _pause_ns(separation: int) -> int:
    """STmin of ISO 15765-2: 0 to 127 ms, 0xF1 to 0xF9 tenths of a millisecond; what is reserved counts as 127 ms."""
    if separation <= 0x7F:
        return separation * 1_000_000
    return (separation - 0xF0) * 100_000 if 0xF1 <= separation <= 0xF9 else 127_000_000


def _frame(arbitration_id: int, data: bytes, stamp_ns: int) -> CanFrame:
    return CanFrame(stamp_ns=stamp_ns, arbitration_id=arbitration_id, data=data + bytes([PADDING]) * (8 - len(data)))


class EcuBank:
    """All units of the car, and the faults that are active."""

    def __init__(self, vin: str = "WDM0SIM0000000001") -> None:
        self._vin = vin
        self.faults = car_faults.Faults()
        self._cleared: frozenset[str] = frozenset()
        self._transfers: dict[int, _Transfer] = {}
        self.malformed = 0

    # --- faults -----------------------------------------------------------------------------------------------------
    @property
    def active(self) -> tuple[str, ...]:
        """The presets that are active."""
        return self.faults.active

    def activate(self, preset: str) -> None:
        """Add a fault scenario; `none` ends them all. Raises ValueError for an unknown one."""
        self.faults.activate(preset)

    def affect(self, state: CarState, now_ns: int) -> CarState:
        """What the units know of `state` under the active faults; a fault begins when it first meets a state."""
        kept = tuple(code for code in state.stored_codes if code not in self._cleared)
        return self.faults.show(replace(state, stored_codes=kept), now_ns)

    # --- transport --------------------------------------------------------------------------------------------------
    def on_frame(self, frame: CanFrame, state: CarState, now_ns: int) -> list[CanFrame]:
        """What the units send at once for this frame; frames that are no request are ignored, broken ones counted."""
        request_id, data = frame.arbitration_id, frame.data
        if frame.extended or (request_id != FUNCTIONAL_ID and request_id not in UNITS and request_id != TEST_UNIT):
            return []
        if not data:
            self.malformed += 1
            return []
        if data[0] >> 4 == 0x3:
            return self._on_flow(request_id, data, now_ns)
        length = data[0] & 0x0F
        if data[0] >> 4 != 0 or not 1 <= length <= len(data) - 1:
            self.malformed += 1  # requests longer than one frame are not served here
            return []
        return self._answer_all(request_id, data[1 : 1 + length], state, now_ns)

    def step(self, now_ns: int) -> list[CanFrame]:
        """Parts of long answers that are due; transfers whose tester fell silent are dropped."""
        frames = [frame for transfer in self._transfers.values() for frame in transfer.due(now_ns)]
        self._transfers = {
            unit: transfer
            for unit, transfer in self._transfers.items()
            if transfer.rest and now_ns - transfer.started_ns < FLOW_TIMEOUT_NS
        }
        return frames

    def _on_flow(self, request_id: int, data: bytes, now_ns: int) -> list[CanFrame]:
        transfer = self._transfers.get(request_id)
        if transfer is None:
            return []
        if not transfer.flow(data, now_ns):
            del self._transfers[request_id]
            return []
        return self.step(now_ns)

    def _answer_all(self, request_id: int, payload: bytes, state: CarState, now_ns: int) -> list[CanFrame]:
        units = tuple(UNITS) if request_id == FUNCTIONAL_ID else (request_id,)
        frames: list[CanFrame] = []
        for unit in units:
            answer = self.answer(unit, payload, state)
            quiet = request_id == FUNCTIONAL_ID and answer[0] == 0x7F and answer[2] in SILENT_FOR_ALL
            if answer and not quiet:
                frames.append(self._send(unit, answer, now_ns))
        return frames

    def _send(self, unit: int, payload: bytes, now_ns: int) -> CanFrame:
        if len(payload) <= 7:
            return _frame(unit + 8, bytes([len(payload)]) + payload, now_ns)
        transfer = _Transfer(unit + 8, payload, now_ns)
        self._transfers[unit] = transfer
        return _frame(unit + 8, transfer.head, now_ns)

    # --- services ---------------------------------------------------------------------------------------------------
    def answer(self, unit: int, payload: bytes, state: CarState) -> bytes:
        """The payload one unit answers with; a refusal is 7F, the service, and why."""
        service = payload[0]
        handler = self._handlers(unit).get(service)
        if handler is None:
            return bytes([0x7F, service, NOT_SUPPORTED])
        result = handler(unit, payload, state)
        return bytes([0x7F, service, result]) if isinstance(result, int) else bytes([service + 0x40]) + result

    def _handlers(self, unit: int) -> Mapping[int, Callable[[int, bytes, CarState], bytes | int]]:
        if unit == TEST_UNIT:
            return {0x31: self._routine}
        return {
            0x01: self._current_data,
            0x03: self._stored,
            0x04: self._clear,
            0x07: self._pending,
            0x09: self._information,
            0x0A: self._stored,
            0x14: self._clear,
            0x19: self._read_codes,
            0x22: self._read_identifier,
            0x3E: lambda unit, payload, state: bytes([0x00]) if payload[1:2] == b"\x00" else WRONG_LENGTH,
        }

    def _codes(self, unit: int, codes: tuple[str, ...]) -> list[str]:
        return [code for code in codes if unit_of(code) == unit]

    def _current_data(self, unit: int, payload: bytes, state: CarState) -> bytes | int:
        if len(payload) != 2:
            return WRONG_LENGTH
        pid = payload[1]
        if pid % 0x20 == 0:
            known = {0x01, *PIDS} if unit == ENGINE else {0x01}
            value = _supported(pid, known)
            return bytes([pid]) + value if any(value) or pid == 0 else OUT_OF_RANGE
        if pid == 0x01:
            count = len(self._codes(unit, state.stored_codes))
            return bytes([pid, (0x80 if "engine" in state.lamps and unit == ENGINE else 0) | min(count, 0x7F), 0, 0, 0])
        if unit != ENGINE or pid not in PIDS:
            return OUT_OF_RANGE
        return bytes([pid]) + PIDS[pid](state)

    def _stored(self, unit: int, payload: bytes, state: CarState) -> bytes | int:
        codes = self._codes(unit, state.stored_codes)
        return bytes([len(codes)]) + b"".join(map(code_bytes, codes))

    def _pending(self, unit: int, payload: bytes, state: CarState) -> bytes | int:
        codes = self._codes(unit, state.pending_codes)
        return bytes([len(codes)]) + b"".join(map(code_bytes, codes))

    def _clear(self, unit: int, payload: bytes, state: CarState) -> bytes | int:
        """Standing only; a fault that is still there sets its code again at once."""
        if state.speed_mps > 0.5:
            return CONDITIONS
        self._cleared |= frozenset(self._codes(unit, state.stored_codes))
        return b""

    def _information(self, unit: int, payload: bytes, state: CarState) -> bytes | int:
        if len(payload) != 2:
            return WRONG_LENGTH
        texts = {0x0A: f"{UNITS[unit]:\0<20}"} | ({0x02: self._vin, 0x04: "DRIVEMCP-SIM-001"} if unit == ENGINE else {})
        if payload[1] == 0x00:
            return bytes([0x00]) + _supported(0x00, set(texts))
        text = texts.get(payload[1])
        return OUT_OF_RANGE if text is None else bytes([payload[1], 1]) + text.encode("ascii")

    def _read_codes(self, unit: int, payload: bytes, state: CarState) -> bytes | int:
        """Sub-functions 01 (number of codes) and 02 (codes by status mask); every code here is confirmed and failing
        now (0x09).
        """
        if len(payload) < 3 or payload[1] not in (0x01, 0x02):
            return WRONG_LENGTH if len(payload) < 3 else 0x12
        codes = self._codes(unit, state.stored_codes) if payload[2] & 0x09 else []
        if payload[1] == 0x01:
            return bytes([0x01, 0x09, 0x00]) + _word(len(codes))
        return bytes([0x02, 0x09]) + b"".join(code_bytes(code) + bytes([0x00, 0x09]) for code in codes)

    def _read_identifier(self, unit: int, payload: bytes, state: CarState) -> bytes | int:
        """VIN (F190), unit's name (F197), and the parameters of service 01 as F4xx."""
        if len(payload) != 3:
            return WRONG_LENGTH
        identifier = payload[1] << 8 | payload[2]
        if identifier == 0xF190:
            return payload[1:] + self._vin.encode("ascii")
        if identifier == 0xF197:
            return payload[1:] + UNITS[unit].encode("ascii")
        if identifier >> 8 == 0xF4 and unit == ENGINE and payload[2] in PIDS:
            return payload[1:] + PIDS[payload[2]](state)
        return OUT_OF_RANGE

    def _routine(self, unit: int, payload: bytes, state: CarState) -> bytes | int:
        if len(payload) != 4 or payload[1] != 0x01:
            return WRONG_LENGTH
        routine = payload[2] << 8 | payload[3]
        fault = car_faults.BY_ROUTINE.get(routine)
        if fault is None and routine != car_faults.CLEAR_ROUTINE:
            return OUT_OF_RANGE
        self.activate(fault.preset if fault is not None else "none")
        return payload[1:] + bytes([len(self.active)])


def _supported(base: int, known: set[int]) -> bytes:
    """The bitmap of parameters base + 1 to base + 32; the last bit says that a further bitmap follows."""
    bits = sum(1 << (32 - (pid - base)) for pid in known if base < pid <= base + 32)
    if any(pid > base + 32 for pid in known):
        bits |= 1
    return bits.to_bytes(4, "big")
