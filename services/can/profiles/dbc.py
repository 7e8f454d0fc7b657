"""The description of a bus (DBC, ARXML, KCD, SYM; several are merged), indexed by id and by signal name."""

import logging
from collections.abc import Iterable, Iterator, Mapping
from difflib import get_close_matches
from pathlib import Path
from typing import Any, NamedTuple

from drivemcp.errors import UserError
from drivemcp.files.bus_description import Key, key_of, load_description, unsound
from services.can.errors import MalformedFrame, ProfileError
from services.can.profiles.extract import Extractor, extractor, read_all

logger = logging.getLogger(__name__)
NOT_AVAILABLE = "not available"
"""Told for a raw value that is no measurement and has no name."""


class _Reader(NamedTuple):
    """A signal, and the names of its raw values."""

    extractor: Extractor
    names: Mapping[int, Any]

    def tell(self, data: bytes) -> float | str:
        """The value as it is told; one that is no measurement is never a number."""
        raw, void = self.extractor.raw(data), self.extractor.void
        if raw in self.names:
            return str(self.names[raw])
        return NOT_AVAILABLE if void is not None and void(raw) else self.extractor.read(data)


class _Layout:
    """The signals of a message."""

    def __init__(self, readers: Iterable[_Reader]) -> None:
        self._readers = tuple(readers)
        extractors = [each.extractor for each in self._readers]
        self._end = max((each.end for each in extractors), default=0)
        self._all = None if any(each.here for each in extractors) else read_all(extractors)
        """Reads a whole frame at once, where each signal is in each frame."""
        self._named = tuple(each for each in self._readers if each.names or each.extractor.void is not None)

    def tell(self, data: bytes) -> dict[str, float | str]:
        """The signals that a frame holds."""
        if self._all is not None and len(data) >= self._end:
            return {**self._all(data), **{each.extractor.name: each.tell(data) for each in self._named}}
        there = (each for each in self._readers if each.extractor.end <= len(data))
        return {each.extractor.name: each.tell(data) for each in there if each.extractor.in_frame(data)}


class Dbc:
    """Messages by key, signals by name; of a name that stands in several messages the message has to be said.

    Messages whose signals overlap or do not fit are named in `broken`; a field may be fed by one only where `strict` is
    off.
    """

    def __init__(self, *paths: Path, strict: bool = True, protocol: str = "") -> None:
        databases = [_load(path) for path in paths]
        self.nodes: tuple[str, ...] = tuple(node.name for each in databases for node in each.nodes)
        self.messages: dict[Key, Any] = {}
        self.broken: dict[Key, str] = {}
        self.files: dict[Key, str] = {}
        """The name of the file that describes a message."""
        self.strict = strict
        self._protocol = protocol
        self._groups: dict[int, Any] = {}
        self._signals: dict[str, dict[tuple[Key, str], tuple[Any, Any]]] = {}
        self._of_message: dict[tuple[str, str], tuple[Any, Any]] = {}
        self._layouts: dict[Key, _Layout] = {}
        for path, database in zip(paths, databases, strict=True):
            self.broken |= _broken(path, database)
            for message in database.messages:
                self._add(message)
                self.files.setdefault(key_of(message), path.name)

    def _add(self, message: Any) -> None:
        first = self.messages.setdefault(key_of(message), message)
        if first.name != message.name:
            logger.warning(
                "0x%X is %s and %s; the first is taken for it: describe one bus at a time",
                message.frame_id, first.name, message.name,
            )  # fmt: skip
        if self.is_j1939(message):
            self._groups.setdefault(pgn_of(message.frame_id), message)
        for signal in message.signals:
            self._signals.setdefault(signal.name, {}).setdefault((key_of(message), message.name), (message, signal))
            self._of_message.setdefault((message.name, signal.name), (message, signal))

    def is_j1939(self, message: Any) -> bool:
        """Whether a message is a J1939 parameter group: said for the bus, or by the description."""
        return bool(message.is_extended_frame) and "j1939" in (self._protocol, message.protocol)

    def find(self, key: Key) -> Any | None:
        """The message of a frame; of a J1939 frame by its parameter group, whatever priority and source address."""
        return self.messages.get(key) or (self._groups.get(pgn_of(key[1])) if key[0] else None)

    def signal(self, name: str, message: str = "") -> tuple[Any, Any]:
        """(message, signal). Raises ProfileError."""
        found = [self._of_message.get((message, name))] if message else list(self._signals.get(name, {}).values())
        if len(found) > 1:
            where = ", ".join(sorted(each.name for each, _ in filter(None, found)))
            raise ProfileError(f"signal {name!r} stands in several messages; choose one with message = ...: {where}")
        if not found or found[0] is None:
            where = f"message {message} of " if message else ""
            files = ", ".join(sorted(set(self.files.values())))
            near = [] if name in self._signals else get_close_matches(name, self._signals, n=3, cutoff=0.7)
            hint = f"; did you mean {', '.join(map(repr, near))}?" if near else ""
            raise ProfileError(f"no signal {name!r} in {where}the bus description {files}{hint}")
        return found[0]

    def has_signal(self, name: str) -> bool:
        """Whether the description names this signal."""
        return name in self._signals

    def signal_names(self) -> tuple[str, ...]:
        """Every signal that the description names."""
        return tuple(self._signals)

    def decode(self, arbitration_id: int, data: bytes, *, extended: bool | None = None) -> dict[str, float | str]:
        """Every signal of a frame, named choices as text; `extended` None: whichever is described. Raises
        MalformedFrame where none is described, or the frame is shorter than its description.
        """
        wanted = (False, True) if extended is None else (extended,)
        message = next((found for each in wanted if (found := self.find((each, arbitration_id)))), None)
        if message is None:
            raise MalformedFrame(f"no message with id 0x{arbitration_id:X} in the bus description")
        if len(data) < message.length:
            raise MalformedFrame(f"{message.name} has {message.length} bytes, not {len(data)}")
        return self.signals_in(message, data)

    def signals_in(self, message: Any, data: bytes) -> dict[str, float | str]:
        """The signals that a frame of a described message holds, named choices and voids as text."""
        key, data = key_of(message), data[: message.length]
        if key not in self._layouts:
            self._layouts[key] = _Layout(self._readers_of(message))
        return self._layouts[key].tell(data)

    def _readers_of(self, message: Any) -> Iterator[_Reader]:
        for signal in message.signals:
            try:
                one = extractor(message, signal, j1939=self.is_j1939(message))
            except ProfileError as error:
                logger.warning("%s; the signal is left out", error)
            else:
                yield _Reader(one, {} if signal.is_float else signal.choices or {})


def pgn_of(arbitration_id: int) -> int:
    """The parameter group number in a 29-bit J1939 id; that of a message to one address has no address in it."""
    group = arbitration_id >> 8 & 0x3FFFF
    return group if group & 0xFF00 >= 0xF000 else group & 0x3FF00


def _load(path: Path) -> Any:
    try:
        return load_description(path)
    except UserError as error:
        raise ProfileError(str(error)) from error


def _broken(path: Path, database: Any) -> dict[Key, str]:
    """What a strict reading refuses: message -> why."""
    found = unsound(path, database)
    if found:
        logger.warning("%s; %d messages of %s are described so", next(iter(found.values())), len(found), path.name)
    return found
