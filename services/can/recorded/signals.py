"""The signals of recorded frames, by the descriptions of the car's buses, as far as they may be told."""

from collections import Counter
from typing import Any, NamedTuple

from services.can.profiles.dbc import Dbc
from services.can.profiles.privacy import held_back
from services.can.tools.answers import Scalar
from services.can.tools.disclosure import told_names
from services.can.vehicle import Vehicle

KEYS_LIMIT = 4096
SHORT_TOLD = 3
"""Messages with short frames."""


class Key(NamedTuple):
    """Which frames of a log belong together."""

    channel: str
    extended: bool
    arbitration_id: int


class _Source(NamedTuple):
    """The description of a message, and which of its signals may be told."""

    dbc: Dbc
    message: Any
    names: frozenset[str]


class Signals:
    """A log does not say which of the car's buses it is of: the first that describes an id counts."""

    def __init__(self, vehicle: Vehicle) -> None:
        self._vehicle = vehicle
        self._sources: dict[tuple[bool, int], _Source | None] = {}
        self._units: dict[tuple[str, str], str] = {}
        self._short: Counter[tuple[str, int]] = Counter()
        """Frames of a message that are shorter than its description."""

    def of(self, key: Key, data: bytes, wanted: str = "") -> dict[str, Scalar]:
        """The signals that may be told, or that one; of a short frame those that it holds."""
        source = self._source(key)
        if source is None or not source.names or (wanted and wanted not in source.names):
            return {}
        if len(data) < source.message.length:
            self._short[str(source.message.name), int(source.message.length)] += 1
        found = source.dbc.signals_in(source.message, data)
        return {name: value for name, value in found.items() if name in source.names}

    @property
    def remark(self) -> str:
        """What was shorter than it is described, in one line; empty where nothing was."""
        return "; ".join(
            f"{count} frames of {name} are shorter than the {length} bytes described: signals beyond their end are left out"
            for (name, length), count in self._short.most_common(SHORT_TOLD)
        )

    @property
    def held_back(self) -> str:
        """What was heard and may not be told, in words; empty where nothing is held back."""
        found = (each for each in self._sources.values() if each is not None)
        hidden = (str(each.message.name) for each in found if each.message.signals and not each.names)
        return held_back(self._vehicle.privacy, hidden)

    def message_of(self, key: Key) -> str:
        """The name of the message; empty where it is not described."""
        source = self._source(key)
        return "" if source is None else str(source.message.name)

    def unit_of(self, name: str, message: str) -> str:
        """The unit of a signal that was heard."""
        return self._units.get((name, message), "")

    def _source(self, key: Key) -> _Source | None:
        place = key.extended, key.arbitration_id
        if place not in self._sources:
            if len(self._sources) >= KEYS_LIMIT:
                return self._find(place)
            self._sources[place] = self._find(place)
        return self._sources[place]

    def _find(self, place: tuple[bool, int]) -> _Source | None:
        for bus, dbc in self._vehicle.descriptions.items():
            if (message := dbc.find(place)) is not None:
                for signal in message.signals:
                    self._units[signal.name, str(message.name)] = str(signal.unit or "")
                return _Source(dbc, message, told_names(self._vehicle, bus, *place))
        return None
