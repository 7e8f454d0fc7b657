"""Simulated control units: they answer diagnostic requests from the same state that the frames show, as real ones do.

Engine, transmission, brakes and body, by 11- and 29-bit ids (ISO 15765-4) and with the times of ISO 14229-2. Fault
scenarios come by RoutineControl to a test unit that no real car has.
"""

from dataclasses import replace

from proto.sensors import CanFrame
from services.simulator.car import faults
from services.simulator.car.state import CarState
from services.simulator.ecus import answers
from services.simulator.ecus.answers import LIST_S, NOT_IN_SESSION, NOT_SUPPORTED, OUT_OF_RANGE, PENDING, Services
from services.simulator.ecus.code_memory import CodeMemory
from services.simulator.ecus.parameters import ADDRESSES, BODY, TEST_UNIT, UNITS
from services.simulator.ecus.transport import FUNCTIONAL_11, FUNCTIONAL_29, Line, is_extended

NS = 1_000_000_000
SILENT_FOR_ALL = frozenset({NOT_SUPPORTED, 0x12, OUT_OF_RANGE, 0x7E, NOT_IN_SESSION})
"""Negative answers that a unit keeps to itself when all units were asked (ISO 14229-1)."""
SESSION_NS = 5 * NS
"""An extended session ends so long after the last request (S3, ISO 14229-2)."""
RESTART_NS = 300_000_000
"""How long a unit that was reset is silent."""

# Request id -> the units that it asks, each with the id that it answers on.
_ASKED: dict[int, dict[int, int]] = {
    FUNCTIONAL_11: {unit: unit + 8 for unit in UNITS},
    FUNCTIONAL_29: {unit: 0x18DAF100 | address for unit, address in ADDRESSES.items()},
    **{unit: {unit: unit + 8} for unit in (*UNITS, TEST_UNIT)},
    **{0x18DA00F1 | address << 8: {unit: 0x18DAF100 | address} for unit, address in ADDRESSES.items()},
}


class EcuBank:
    """All units of the car, and the faults that are active."""

    def __init__(self, vin: str = "WDM0SIM0000000001") -> None:
        self.faults = faults.Faults()
        self.memory = CodeMemory()
        self._services = Services(vin, self.memory)
        self._line = Line()
        self._asked_ns: dict[int, int] = {}
        self._silent_until_ns: dict[int, int] = {}

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
        self.memory.observe(self.faults.show(state, now_ns))
        kept = tuple(code for code in state.stored_codes if code not in self._services.cleared)
        return self.faults.show(replace(state, stored_codes=kept), now_ns)

    # --- transport --------------------------------------------------------------------------------------------------
    def on_frame(self, frame: CanFrame, state: CarState, now_ns: int) -> list[CanFrame]:
        """What the units send at once for this frame; frames that are no request, and broken ones, are ignored."""
        units, data = _ASKED.get(frame.arbitration_id), frame.data
        if units is None or frame.extended != is_extended(frame.arbitration_id):
            return []
        if not data:
            return []
        if data[0] >> 4 == 0x3:
            return [each for answer_id in units.values() for each in self._line.flow(answer_id, data, now_ns)]
        length = data[0] & 0x0F
        if data[0] >> 4 != 0 or not 1 <= length <= len(data) - 1:
            return []  # requests longer than one frame are not served here
        return self._answer_all(units, data[1 : 1 + length], state, now_ns)

    def step(self, now_ns: int, state: CarState | None = None) -> list[CanFrame]:
        """Parts of answers that are due; `state`: what the units see now, and remember where a code is set."""
        if state is not None:
            self.memory.observe(state)
        return self._line.step(now_ns)

    def _answer_all(self, units: dict[int, int], payload: bytes, state: CarState, now_ns: int) -> list[CanFrame]:
        frames: list[CanFrame] = []
        for unit, answer_id in units.items():
            if now_ns < self._silent_until_ns.get(unit, 0):
                continue
            answer = self._answer(unit, payload, state, now_ns)
            quiet = not answer or (len(units) > 1 and answer[0] == 0x7F and answer[2] in SILENT_FOR_ALL)
            if not quiet:
                frames.append(self._send(unit, answer_id, payload, answer, now_ns))
        return frames

    def _answer(self, unit: int, payload: bytes, state: CarState, now_ns: int) -> bytes:
        if unit == TEST_UNIT:
            return self._test_unit(payload)
        if now_ns - self._asked_ns.get(unit, now_ns) > SESSION_NS:
            self._services.extended.discard(unit)
        self._asked_ns[unit] = now_ns
        return self._services.answer(unit, payload, state)

    def _send(self, unit: int, answer_id: int, payload: bytes, answer: bytes, now_ns: int) -> CanFrame:
        if answer[0] == 0x51:
            self._silent_until_ns[unit] = now_ns + RESTART_NS
            self._line.drop(answer_id)
        if unit == BODY and answer[:2] == b"\x59\x0a":
            self._line.send_later(answer_id, answer, now_ns + round(LIST_S * NS))
            return self._line.send(answer_id, bytes([0x7F, payload[0], PENDING]), now_ns)
        return self._line.send(answer_id, answer, now_ns)

    def _test_unit(self, payload: bytes) -> bytes:
        """Takes fault scenarios by RoutineControl, and nothing else."""
        if payload[0] != 0x31:
            return bytes([0x7F, payload[0], NOT_SUPPORTED])
        found = answers.routine(payload)
        if isinstance(found, int):
            return bytes([0x7F, 0x31, found])
        fault = faults.BY_ROUTINE.get(int.from_bytes(found, "big"))
        self.activate(fault.preset if fault is not None else "none")
        return bytes([0x71, 0x01]) + found + bytes([len(self.active)])
