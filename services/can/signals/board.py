"""The hot path: frames in, curated fields out. Only the profile's messages are decoded, selected by id."""

from collections.abc import Callable, Iterable, Mapping

from drivemcp.files.bus_description import Key, key_of
from proto.sensors import CanFrame
from services.can.errors import ProfileError
from services.can.profiles.dbc import Dbc, pgn_of
from services.can.profiles.profile import Profile
from services.can.signals.field import Field, Reading
from services.can.signals.message_watch import Watch

FUTURE_NS = 1_000_000_000
"""A frame stamped further ahead of the clock than this is not believed."""
RESTART_NS = 2_000_000_000
"""Stamps that fall back further than this are a source that started again, not frames out of order."""

Find = Callable[[Key], Watch | None]


class Board:
    """The latest judged value of every curated field, of all buses. One writer; readers see whole values."""

    def __init__(self, descriptions: Mapping[str, Dbc], profile: Profile) -> None:
        self.fields = {name: Field(name, rule) for name, rule in profile.fields.items()}
        self._find = {bus: _finder(dbc, self._watches(bus, dbc, profile)) for bus, dbc in descriptions.items()}
        self._only = next(iter(descriptions)) if len(descriptions) == 1 else ""
        for field in self.fields.values():
            if len(descriptions) > 1 and profile.bus_of(field.rule) not in descriptions:
                raise ProfileError(
                    f"field {field.name}: bus {field.rule.bus!r} is not one of {', '.join(descriptions)}"
                )
        self.malformed = 0

    def ingest(self, frames: Iterable[CanFrame], now_ns: int, bus: str = "") -> None:
        """Decode the curated among a bus's frames ("": the only bus); what does not fit its description is counted."""
        find = self._find[bus or self._only]
        for frame in frames:
            watch = find((frame.extended, frame.arbitration_id))
            if watch is not None and not frame.remote and not frame.error:
                self._take(watch, frame, now_ns)

    def read(self, name: str, now_ns: int) -> Reading:
        """A field now; one that the profile does not name was never seen."""
        field = self.fields.get(name)
        return field.read(now_ns) if field is not None else Reading(None, 0, "not on this car")

    def _take(self, watch: Watch, frame: CanFrame, now_ns: int) -> None:
        stamp_ns = frame.stamp_ns
        from_the_future = stamp_ns > now_ns + FUTURE_NS
        out_of_order = watch.last_ns - RESTART_NS < stamp_ns < watch.last_ns
        if from_the_future or out_of_order:
            return
        watch.last_ns = stamp_ns
        if not watch.take(frame.data, stamp_ns, frame.arbitration_id):
            self.malformed += 1

    def _watches(self, bus: str, dbc: Dbc, profile: Profile) -> dict[Key, Watch]:
        found: dict[Key, list[Field]] = {}
        for field in self.fields.values():
            if bus == profile.bus_of(field.rule) or len(profile.buses) == 1:
                try:
                    message, _ = dbc.signal(field.rule.signals[0], field.rule.message)
                except ProfileError as error:
                    raise ProfileError(f"field {field.name}: {error}") from None
                known = dbc.messages[key_of(message)]
                if known.name != message.name:
                    raise ProfileError(
                        f"field {field.name}: {message.name} has the id 0x{message.frame_id:X} of {known.name}; describe its bus alone"
                    )
                found.setdefault(key_of(message), []).append(field)
        return {key: _watch(dbc, key, fields, profile, bus) for key, fields in found.items()}


def _watch(dbc: Dbc, key: Key, fields: list[Field], profile: Profile, bus: str) -> Watch:
    message = dbc.messages[key]
    if dbc.strict and key in dbc.broken:
        raise ProfileError(
            f"{dbc.broken[key]}; field {fields[0].name} needs it: say strict = false for the bus to take it"
        )
    rule = profile.messages.get(message.name)
    if rule is not None and len(profile.buses) > 1 and profile.bus_of(rule) != bus:
        rule = None
    try:
        return Watch(message, fields, rule, j1939=dbc.is_j1939(message))
    except ProfileError as error:
        names = ", ".join(field.name for field in fields)
        raise ProfileError(f"{dbc.files[key]}: message {message.name} (for {names}): {error}") from None


def _finder(dbc: Dbc, watches: dict[Key, Watch]) -> Find:
    """By id; J1939 by parameter group, whatever priority and source."""
    groups = {pgn_of(key[1]): watch for key, watch in watches.items() if key[0] and dbc.is_j1939(dbc.messages[key])}
    if not groups:
        return watches.get

    def find(key: Key) -> Watch | None:
        return watches.get(key) or (groups.get(pgn_of(key[1])) if key[0] else None)

    return find
