"""What the control units last said of their trouble codes."""

from collections.abc import Iterable, Mapping

from services.can.diagnostics import obd


class CodeMemory:
    """Trouble codes by unit; a unit that does not answer keeps those it last had. `listed`: the ids on which the units
    that the profile lists answer.
    """

    def __init__(self, listed: Iterable[int] = ()) -> None:
        self._listed = frozenset(listed)
        self._by_unit: dict[int, tuple[tuple[str, ...], int]] = {}
        self.missing: tuple[int, ...] = ()
        """Which of the listed gave no list when they were last asked."""

    def learn(self, answers: Mapping[int, bytes], now_ns: int) -> None:
        """Take positive answers to services 03, 07 or 0A that are whole: a list that breaks off clears no code."""
        fresh = {unit: (obd.codes(answer), now_ns) for unit, answer in answers.items() if obd.is_list(answer)}
        self._by_unit = self._by_unit | fresh
        self.missing = tuple(sorted(self._listed - fresh.keys()))

    @property
    def stamp_ns(self) -> int | None:
        """Of the oldest answer that is counted on; None where nobody has answered yet."""
        return min((stamp_ns for _, stamp_ns in self._by_unit.values()), default=None)

    @property
    def codes(self) -> tuple[str, ...]:
        """All units' codes, sorted."""
        return tuple(sorted({code for codes, _ in self._by_unit.values() for code in codes}))
