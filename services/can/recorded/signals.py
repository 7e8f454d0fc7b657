"""The signals of recorded frames, by the descriptions of the car's buses, as far as they may be told."""

from typing import Any, NamedTuple

from services.can.errors import MalformedFrame
from services.can.profiles.dbc import Dbc
from services.can.tools.answers import Scalar
from services.can.tools.disclosure import told_names
from services.can.vehicle import Vehicle

KEYS_LIMIT = 4096


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

    def of(self, key: Key, data: bytes, wanted: str = "") -> dict[str, Scalar]:
        """The signals that may be told, or that one; of a frame that does not fit its description none."""
        source = self._source(key)
        if source is None or not source.names or (wanted and wanted not in source.names):
            return {}
        try:
            found = source.dbc.decode(key.arbitration_id, data, extended=key.extended)
        except MalformedFrame:
            return {}
        return {name: value for name, value in found.items() if name in source.names}

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
