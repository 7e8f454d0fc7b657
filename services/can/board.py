"""The hot path: frames in, curated fields out. Only the profile's messages are decoded, selected by id."""

from collections.abc import Iterable, Mapping
from typing import Any

from cantools.database.errors import Error as CantoolsError

from proto.sensors import CanFrame
from services.can.dbc import Dbc, Key, key_of
from services.can.errors import ProfileError
from services.can.field import Field, Reading
from services.can.profile import Profile, conversion

STUCK_AFTER = 3
"""So many frames in a row with the same counter mean a sender that repeats itself."""
FUTURE_NS = 1_000_000_000
"""A frame stamped further ahead of the clock than this is not believed."""
RESTART_NS = 2_000_000_000
"""Stamps that fall back further than this are a source that started again, not frames out of order."""


class _Feed:
    """One field's place in one message."""

    __slots__ = ("field", "scale", "signal", "valid_if")

    def __init__(self, field: Field, scale: float) -> None:
        self.field, self.scale = field, scale
        self.signal, self.valid_if = field.rule.signal, field.rule.valid_if


class _Watched:
    """One curated message: what it feeds, and whether its sender is alive."""

    def __init__(self, message: Any, feeds: list[_Feed]) -> None:
        self.message, self.feeds = message, feeds
        self.length: int = message.length
        self.counters = sorted({feed.field.rule.counter for feed in feeds if feed.field.rule.counter})
        self.last_counters: tuple[float, ...] = ()
        self.repeats = 0
        self.last_ns = 0

    def stuck(self, values: dict[str, float]) -> bool:
        """Whether the message's counter has stopped moving."""
        if not self.counters:
            return False
        counters = tuple(values[name] for name in self.counters)
        self.repeats = self.repeats + 1 if counters == self.last_counters else 0
        self.last_counters = counters
        return self.repeats >= STUCK_AFTER


class Board:
    """The latest judged value of every curated field, fed by one or several buses. One writer; readers see whole
    values.
    """

    def __init__(self, descriptions: Mapping[str, Dbc], profile: Profile) -> None:
        self.fields = {name: Field(name, rule) for name, rule in profile.fields.items()}
        self._watched = {bus: _watch(dbc, self._of_bus(bus, descriptions)) for bus, dbc in descriptions.items()}
        self._only = next(iter(descriptions)) if len(descriptions) == 1 else ""
        self.malformed = 0
        self.out_of_order = 0
        self.from_the_future = 0
        self.last_frame_ns = 0

    def ingest(self, frames: Iterable[CanFrame], now_ns: int, bus: str = "") -> None:
        """Decode the curated ones among `frames` of a bus ("": the only one); what does not fit its description is
        counted.
        """
        of_bus = self._watched[bus or self._only]
        for frame in frames:
            if frame.stamp_ns > now_ns + FUTURE_NS:
                self.from_the_future += 1
                continue
            self.last_frame_ns = frame.stamp_ns
            watched = of_bus.get((frame.extended, frame.arbitration_id))
            if watched is not None:
                self._decode(watched, frame)

    def read(self, name: str, now_ns: int) -> Reading:
        """A field now; one that the profile does not name was never seen."""
        field = self.fields.get(name)
        return field.read(now_ns) if field is not None else Reading(None, 0, "not on this car")

    def _of_bus(self, bus: str, descriptions: Mapping[str, Dbc]) -> list[Field]:
        """The fields that this bus feeds; with one bus a field need not name it."""
        found = []
        for field in self.fields.values():
            named = getattr(field.rule, "bus", "") or (bus if len(descriptions) == 1 else "")
            if named not in descriptions:
                raise ProfileError(f"field {field.name}: bus {named!r} is none of {', '.join(descriptions)}")
            if named == bus:
                found.append(field)
        return found

    def _decode(self, watched: _Watched, frame: CanFrame) -> None:
        if watched.last_ns - RESTART_NS < frame.stamp_ns < watched.last_ns:
            self.out_of_order += 1
            return
        watched.last_ns = frame.stamp_ns
        if len(frame.data) < watched.length:
            self.malformed += 1
            return
        try:
            values = watched.message.decode(frame.data[: watched.length], decode_choices=False)
        except (CantoolsError, ValueError, KeyError):
            self.malformed += 1
            return
        _feed(watched, values, frame.stamp_ns)


def _feed(watched: _Watched, values: dict[str, float], stamp_ns: int) -> None:
    stuck = watched.stuck(values)
    for feed in watched.feeds:
        if stuck and feed.field.rule.counter:
            feed.field.reject("sender repeats itself", stamp_ns)
        elif feed.valid_if and not values[feed.valid_if]:
            feed.field.reject("marked invalid by the sender", stamp_ns)
        else:
            feed.field.accept(values[feed.signal] * feed.scale, stamp_ns)


def _watch(dbc: Dbc, fields: Iterable[Field]) -> dict[Key, _Watched]:
    feeds: dict[Key, list[_Feed]] = {}
    for field in fields:
        message, signal = dbc.signal(field.rule.signal, getattr(field.rule, "message", ""))
        names = {each.name for each in message.signals}
        for other in (field.rule.counter, field.rule.valid_if):
            if other and other not in names:
                raise ProfileError(f"field {field.name}: {other} is not in message {message.name}")
        feeds.setdefault(key_of(message), []).append(_Feed(field, conversion(signal.unit or "", field.rule)))
    return {key: _Watched(dbc.messages[key], each) for key, each in feeds.items()}
