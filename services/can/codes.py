"""What the control units last said of their trouble codes."""

from collections.abc import Mapping

from services.can import obd


class CodeMemory:
    """Trouble codes by unit; a unit that does not answer keeps those it last had."""

    def __init__(self) -> None:
        self._by_unit: dict[int, tuple[str, ...]] = {}
        self.stamp_ns: int | None = None

    def learn(self, answers: Mapping[int, bytes], now_ns: int) -> None:
        """Take positive answers to services 03, 07 or 0A that are whole: a list that breaks off clears no code."""
        fresh = {unit: obd.codes(answer) for unit, answer in answers.items() if obd.is_list(answer)}
        if fresh:
            self._by_unit = self._by_unit | fresh
            self.stamp_ns = now_ns

    @property
    def codes(self) -> tuple[str, ...]:
        """All units' codes, sorted."""
        return tuple(sorted({code for codes in self._by_unit.values() for code in codes}))
