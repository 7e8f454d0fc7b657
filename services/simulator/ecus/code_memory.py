"""The trouble codes that simulated control units remember: the state when each was set, what stays permanent, and what
ran since the codes were cleared.
"""

from services.simulator.car.state import CarState
from services.simulator.ecus.parameters import unit_of

FAILED, FAILED_NOW, PENDING, CONFIRMED, SINCE_CLEAR, LAMP = 0x01, 0x02, 0x04, 0x08, 0x20, 0x80
AVAILABLE = FAILED | FAILED_NOW | PENDING | CONFIRMED | SINCE_CLEAR | LAMP
"""Status bits that these units keep (ISO 14229-1, annex D)."""


class CodeMemory:
    """Of all units. The codes themselves are the car's state."""

    def __init__(self) -> None:
        self.frames: dict[str, CarState] = {}
        """Code -> the car when it was first seen: the freeze frame."""
        self.counts: dict[str, int] = {}
        self._permanent: set[str] = set()
        self._before: frozenset[str] = frozenset()
        self._cleared_at: CarState | None = None
        self._lamp_at: CarState | None = None

    def observe(self, state: CarState) -> None:
        """The car now: codes that were not there before are set now."""
        present = frozenset(state.stored_codes) | frozenset(state.pending_codes)
        for code in present - self._before:
            self.frames.setdefault(code, state)
            self.counts[code] = min(255, self.counts.get(code, 0) + 1)
        lamp = "engine" in state.lamps
        self._permanent = {
            code
            for code in present
            if code in self._permanent or (lamp and code in state.stored_codes and code[0] == "P")
        }
        self._lamp_at = (self._lamp_at or state) if lamp else None
        self._cleared_at = self._cleared_at or state
        self._before = present

    def clear(self, unit: int, state: CarState) -> None:
        """The unit forgets what it kept with its codes; permanent codes go only when their fault is gone."""
        for code in [code for code in self.frames if unit_of(code) == unit]:
            del self.frames[code]
            self.counts.pop(code, None)
            self._before -= {code}
        self._cleared_at = state

    def permanent(self, unit: int) -> list[str]:
        """The unit's permanent codes."""
        return sorted(code for code in self._permanent if unit_of(code) == unit)

    def frozen(self, unit: int) -> tuple[str, CarState] | None:
        """The unit's freeze frame: of the first code that it set."""
        return next(((code, state) for code, state in self.frames.items() if unit_of(code) == unit), None)

    def status(self, code: str, state: CarState) -> int:
        """The status byte of a code."""
        known = self.frames.get(code)
        bits = SINCE_CLEAR if known is not None else 0
        if code in state.pending_codes:
            bits |= FAILED_NOW | PENDING | SINCE_CLEAR
        if code in state.stored_codes:
            bits |= FAILED | FAILED_NOW | CONFIRMED | SINCE_CLEAR | (LAMP if state.lamps else 0)
        return bits

    def since_cleared(self, state: CarState) -> tuple[float, float]:
        """Kilometres and minutes."""
        return _between(self._cleared_at, state)

    def with_lamp(self, state: CarState) -> tuple[float, float]:
        """Kilometres and minutes with the lamp on."""
        return _between(self._lamp_at, state)


def _between(since: CarState | None, state: CarState) -> tuple[float, float]:
    if since is None:
        return 0.0, 0.0
    return max(0.0, state.distance_km - since.distance_km), max(0.0, state.run_time_s - since.run_time_s) / 60.0
