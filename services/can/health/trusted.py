"""The board without the sensors that the others contradict."""

from collections.abc import Mapping
from typing import Protocol

from services.can.signals.field import Field, Reading


class Readings(Protocol):
    """Whatever has the car's fields and says what may be used of them now."""

    @property
    def fields(self) -> Mapping[str, Field]:
        """The car's fields, heard or not."""

    def read(self, name: str, now_ns: int) -> Reading:
        """A field now."""


class Trusted:
    """A board of which the convicted fields cannot be used; `convicted` gives the reason of each."""

    def __init__(self, board: Readings, convicted: Mapping[str, str]) -> None:
        self._board, self._convicted = board, convicted

    @property
    def fields(self) -> Mapping[str, Field]:
        """All of the board's."""
        return self._board.fields

    def read(self, name: str, now_ns: int) -> Reading:
        """The board's reading; of a convicted sensor none."""
        reading, kind = self._board.read(name, now_ns), self._convicted.get(name)
        return reading if kind is None else Reading(None, reading.stamp_ns, f"sensor {kind}")
