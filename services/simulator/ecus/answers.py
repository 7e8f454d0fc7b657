"""What the simulated control units answer: SAE J1979 services 01 to 04, 07, 09, 0A and ISO 14229 services 10, 11, 14,
19, 22, 3E. An int is a negative response code.
"""

from collections.abc import Callable, Mapping

from services.simulator.car import faults
from services.simulator.car.state import CarState
from services.simulator.ecus.code_memory import AVAILABLE, CodeMemory
from services.simulator.ecus.parameters import ENGINE, LOCKED, OWN, PARAMETERS, UNITS, bitmap, code_bytes, unit_of, word

NOT_SUPPORTED, NO_SUBFUNCTION, WRONG_LENGTH, CONDITIONS, OUT_OF_RANGE = 0x11, 0x12, 0x13, 0x22, 0x31
LOCKED_AWAY, PENDING, NOT_IN_SESSION = 0x33, 0x78, 0x7F
DEFAULT, EXTENDED = 0x01, 0x03
EXTENDED_ONLY = frozenset({0x27, 0x28, 0x2E, 0x2F, 0x31, 0x85})
STANDING_MPS = 0.5
MAX_PIDS = 6
SNAPSHOT_PIDS = (0x04, 0x05, 0x0C, 0x0D, 0x1F)
RECORD = 0x01
LIST_S = 0.2
"""How long the body unit looks through all it supports; it says so (78) and answers then."""

Answer = bytes | int
Handler = Callable[[int, bytes, CarState], Answer]


class Services:
    """Stateless but for the codes' memory and each unit's session."""

    def __init__(self, vin: str, memory: CodeMemory) -> None:
        self._vin, self.memory = vin, memory
        self.cleared: frozenset[str] = frozenset()
        self.extended: set[int] = set()
        """Units in the extended session."""
        self._table: Mapping[int, Handler] = {
            0x01: self._current_data,
            0x02: self._freeze_frame,
            0x03: lambda unit, payload, state: _obd_codes(payload, _codes(unit, state.stored_codes)),
            0x04: self._clear,
            0x07: lambda unit, payload, state: _obd_codes(payload, _codes(unit, state.pending_codes)),
            0x09: self._information,
            0x0A: lambda unit, payload, state: _obd_codes(payload, memory.permanent(unit)),
            0x10: self._session,
            0x11: self._reset,
            0x14: self._clear_group,
            0x19: self._read_codes,
            0x22: self._read_identifiers,
            0x3E: _present,
        }

    def answer(self, unit: int, payload: bytes, state: CarState) -> bytes:
        """The payload one unit answers with; empty: it keeps silent, as it was asked to."""
        service = payload[0]
        handler = self._table.get(service)
        if handler is None:
            result: Answer = self._beyond(unit, service)
        else:
            result = handler(unit, payload, state)
        if isinstance(result, int):
            return bytes([0x7F, service, result])
        silent = service in (0x10, 0x11, 0x3E) and payload[1] & 0x80
        return b"" if silent else bytes([service + 0x40]) + result

    def _beyond(self, unit: int, service: int) -> int:
        if service not in EXTENDED_ONLY:
            return NOT_SUPPORTED
        return LOCKED_AWAY if unit in self.extended else NOT_IN_SESSION

    # --- OBD --------------------------------------------------------------------------------------------------------
    def _known(self, unit: int) -> set[int]:
        return {0x01, *PARAMETERS[unit]} | ({0x21, 0x30, 0x31, 0x41, 0x4D, 0x4E} if unit == ENGINE else set())

    def _value(self, unit: int, pid: int, state: CarState) -> bytes | None:
        """The bytes of one parameter; None where the unit does not have it."""
        if pid % 0x20 == 0:
            return _bitmap(pid, self._known(unit))
        if pid not in self._known(unit):
            return None
        say = PARAMETERS[unit].get(pid)
        return say(state) if say is not None else self._counted(unit, pid, state)

    def _counted(self, unit: int, pid: int, state: CarState) -> bytes:
        """Parameters about codes and what ran since they were cleared."""
        if pid in (0x01, 0x41):
            return self._monitors(unit, pid, state)
        km, minutes = self.memory.since_cleared(state) if pid in (0x30, 0x31, 0x4E) else self.memory.with_lamp(state)
        return {0x30: b"\x00", 0x21: word(km), 0x31: word(km)}.get(pid, word(minutes))

    def _monitors(self, unit: int, pid: int, state: CarState) -> bytes:
        """Lamp and count; a spark engine's monitors, ready ten minutes after clearing, the catalyst's after twenty."""
        lamp = 0x80 if "engine" in state.lamps and unit == ENGINE else 0
        head = (lamp | min(len(_codes(unit, state.stored_codes)), 0x7F)) if pid == 0x01 else 0
        if unit != ENGINE:
            return bytes([head, 0, 0, 0])
        _, minutes = self.memory.since_cleared(state)
        waiting = (0b0110_0000 if minutes < 10.0 else 0) | (0b0000_0001 if minutes < 20.0 else 0)
        return bytes([head, 0b0000_0111, 0b0110_0101, waiting & 0b0110_0101])

    def _current_data(self, unit: int, payload: bytes, state: CarState) -> Answer:
        if not 2 <= len(payload) <= 1 + MAX_PIDS:
            return WRONG_LENGTH
        found = [(pid, value) for pid in payload[1:] if (value := self._value(unit, pid, state)) is not None]
        return b"".join(bytes([pid]) + value for pid, value in found) if found else OUT_OF_RANGE

    def _freeze_frame(self, unit: int, payload: bytes, state: CarState) -> Answer:
        """Frame 0, of the first code that was set; without one there is code 0 and nothing else."""
        if len(payload) != 3:
            return WRONG_LENGTH
        pid, number = payload[1], payload[2]
        if number != 0:
            return OUT_OF_RANGE
        frozen = self.memory.frozen(unit)
        if pid == 0x02:
            return bytes([pid, number]) + (code_bytes(frozen[0]) if frozen else b"\x00\x00")
        if frozen is None:
            return OUT_OF_RANGE
        if pid % 0x20 == 0:
            value = _bitmap(pid, {0x02, *PARAMETERS[unit]})
        else:
            value = PARAMETERS[unit][pid](frozen[1]) if pid in PARAMETERS[unit] else None
        return OUT_OF_RANGE if value is None else bytes([pid, number]) + value

    def _information(self, unit: int, payload: bytes, state: CarState) -> Answer:
        if len(payload) != 2:
            return WRONG_LENGTH
        texts = {0x0A: f"{UNITS[unit]:\0<20}"} | ({0x02: self._vin, 0x04: "DRIVEMCP-SIM-001"} if unit == ENGINE else {})
        if payload[1] == 0x00:
            return bytes([0x00, 1]) + bitmap(0x00, set(texts))
        text = texts.get(payload[1])
        return OUT_OF_RANGE if text is None else bytes([payload[1], 1]) + text.encode("ascii")

    def _clear(self, unit: int, payload: bytes, state: CarState) -> Answer:
        """Standing only; a fault that is still there sets its code again at once."""
        if len(payload) != 1:
            return WRONG_LENGTH
        if state.speed_mps > STANDING_MPS:
            return CONDITIONS
        self.cleared |= frozenset(_codes(unit, state.stored_codes))
        self.memory.clear(unit, state)
        return b""

    # --- UDS --------------------------------------------------------------------------------------------------------
    def _session(self, unit: int, payload: bytes, state: CarState) -> Answer:
        if len(payload) != 2:
            return WRONG_LENGTH
        kind = payload[1] & 0x7F
        if kind not in (DEFAULT, EXTENDED):
            return NO_SUBFUNCTION
        if kind == EXTENDED:
            self.extended.add(unit)
        else:
            self.extended.discard(unit)
        return bytes([kind]) + bytes.fromhex("003201f4")  # P2 50 ms, P2* 5 s

    def _reset(self, unit: int, payload: bytes, state: CarState) -> Answer:
        if len(payload) != 2:
            return WRONG_LENGTH
        if payload[1] & 0x7F not in (0x01, 0x02, 0x03):
            return NO_SUBFUNCTION
        if state.speed_mps > STANDING_MPS:
            return CONDITIONS
        self.extended.discard(unit)
        return bytes([payload[1] & 0x7F])

    def _clear_group(self, unit: int, payload: bytes, state: CarState) -> Answer:
        if len(payload) != 4:
            return WRONG_LENGTH
        if payload[1:] != b"\xff\xff\xff":
            return OUT_OF_RANGE
        return self._clear(unit, b"\x04", state)

    def _read_codes(self, unit: int, payload: bytes, state: CarState) -> Answer:
        kinds = {0x01: self._by_status, 0x02: self._by_status, 0x04: self._kept, 0x06: self._kept, 0x0A: self._all}
        if len(payload) < 2:
            return WRONG_LENGTH
        handler = kinds.get(payload[1])
        return NO_SUBFUNCTION if handler is None else handler(unit, payload, state)

    def _by_status(self, unit: int, payload: bytes, state: CarState) -> Answer:
        if len(payload) != 3:
            return WRONG_LENGTH
        codes = _codes(unit, tuple(dict.fromkeys(state.stored_codes + state.pending_codes)))
        found = [code for code in codes if self.memory.status(code, state) & payload[2]]
        if payload[1] == 0x01:
            return bytes([0x01, AVAILABLE, 0x01]) + word(len(found))
        return bytes([0x02, AVAILABLE]) + b"".join(self._record(code, state) for code in found)

    def _record(self, code: str, state: CarState) -> bytes:
        return code_bytes(code) + bytes([0x00, self.memory.status(code, state)])

    def _kept(self, unit: int, payload: bytes, state: CarState) -> Answer:
        """Snapshot (04) or extended data (06) of one code."""
        if len(payload) != 6:
            return WRONG_LENGTH
        codes = {code_bytes(code) + b"\x00": code for code in self.memory.frames if unit_of(code) == unit}
        code = codes.get(payload[2:5])
        if code is None or payload[5] not in (RECORD, 0xFF):
            return OUT_OF_RANGE
        kept = self._snapshot(code) if payload[1] == 0x04 else bytes([RECORD, self.memory.counts.get(code, 0)])
        return bytes([payload[1]]) + self._record(code, state) + kept

    def _snapshot(self, code: str) -> bytes:
        state = self.memory.frames[code]
        values = b"".join(bytes([0xF4, pid]) + PARAMETERS[ENGINE][pid](state) for pid in SNAPSHOT_PIDS)
        return bytes([RECORD, len(SNAPSHOT_PIDS)]) + values

    def _all(self, unit: int, payload: bytes, state: CarState) -> Answer:
        """Every code that this unit can set."""
        if len(payload) != 2:
            return WRONG_LENGTH
        codes = sorted({code for fault in faults.FAULTS.values() for code in fault.codes if unit_of(code) == unit})
        return bytes([0x0A, AVAILABLE]) + b"".join(self._record(code, state) for code in codes)

    def _read_identifiers(self, unit: int, payload: bytes, state: CarState) -> Answer:
        """VIN (F190), the unit's name (F197), parameters of service 01 as F4xx, and the unit's own."""
        if len(payload) < 3 or len(payload) % 2 == 0:
            return WRONG_LENGTH
        asked = [payload[i] << 8 | payload[i + 1] for i in range(1, len(payload), 2)]
        if LOCKED & set(asked):
            return LOCKED_AWAY
        found = [(each, value) for each in asked if (value := self._identifier(unit, each, state)) is not None]
        return b"".join(word(each) + value for each, value in found) if found else OUT_OF_RANGE

    def _identifier(self, unit: int, identifier: int, state: CarState) -> bytes | None:
        texts = {0xF190: self._vin, 0xF197: UNITS[unit], 0xF189: "1.0"}
        if identifier in texts:
            return texts[identifier].encode("ascii")
        if identifier >> 8 == 0xF4:
            return self._value(unit, identifier & 0xFF, state)
        say = OWN[unit].get(identifier)
        return None if say is None else say(state)


def routine(payload: bytes) -> Answer:
    """Which fault scenario the test unit is asked for: its number as two bytes; or why not."""
    if len(payload) != 4 or payload[1] != 0x01:
        return WRONG_LENGTH
    number = payload[2] << 8 | payload[3]
    return payload[2:4] if number in faults.BY_ROUTINE or number == faults.CLEAR_ROUTINE else OUT_OF_RANGE


def _bitmap(base: int, known: set[int]) -> bytes | None:
    """None where there is nothing to list; the first is always given."""
    value = bitmap(base, known)
    return value if base == 0 or any(value) else None


def _present(unit: int, payload: bytes, state: CarState) -> Answer:
    if len(payload) != 2:
        return WRONG_LENGTH
    return b"\x00" if payload[1] & 0x7F == 0 else NO_SUBFUNCTION


def _codes(unit: int, codes: tuple[str, ...]) -> list[str]:
    return [code for code in codes if unit_of(code) == unit]


def _obd_codes(payload: bytes, codes: list[str]) -> Answer:
    return bytes([len(codes)]) + b"".join(map(code_bytes, codes)) if len(payload) == 1 else WRONG_LENGTH
