"""The description of a bus (DBC, ARXML, KCD, SYM; several are merged), indexed by id and by signal name."""

from pathlib import Path
from typing import Any

from cantools.database import load_file
from cantools.database.errors import Error as CantoolsError

from services.can.errors import MalformedFrame, ProfileError

Key = tuple[bool, int]
"""(extended, id): the same number with 11 and with 29 bits is two messages."""


class Dbc:
    """Messages by key, signals by name. Of two signals of one name the first counts where no message is named."""

    def __init__(self, *paths: Path) -> None:
        databases = [_load(path) for path in paths]
        self.nodes: tuple[str, ...] = tuple(node.name for each in databases for node in each.nodes)
        self.messages: dict[Key, Any] = {}
        self._signals: dict[str, tuple[Any, Any]] = {}
        self._of_message: dict[tuple[str, str], tuple[Any, Any]] = {}
        for message in (message for each in databases for message in each.messages):
            self.messages.setdefault(key_of(message), message)
            for signal in message.signals:
                self._signals.setdefault(signal.name, (message, signal))
                self._of_message.setdefault((message.name, signal.name), (message, signal))

    def signal(self, name: str, message: str = "") -> tuple[Any, Any]:
        """(message, signal). Raises ProfileError."""
        try:
            return self._of_message[message, name] if message else self._signals[name]
        except KeyError:
            where = f"message {message} of " if message else ""
            raise ProfileError(f"no signal {name!r} in {where}the bus description") from None

    def has_signal(self, name: str) -> bool:
        """Whether the description names this signal."""
        return name in self._signals

    def decode(self, arbitration_id: int, data: bytes, *, extended: bool | None = None) -> dict[str, float | str]:
        """Every signal of a frame, named choices as text; `extended` None: whichever is described. Raises
        MalformedFrame where frame and description do not fit.
        """
        wanted = (False, True) if extended is None else (extended,)
        message = next((found for each in wanted if (found := self.messages.get((each, arbitration_id)))), None)
        if message is None:
            raise MalformedFrame(f"no message with id 0x{arbitration_id:X} in the bus description")
        if len(data) < message.length:
            raise MalformedFrame(f"{message.name} has {message.length} bytes, not {len(data)}")
        try:
            decoded = message.decode(data[: message.length], decode_choices=True)
        except (CantoolsError, ValueError, KeyError) as error:
            raise MalformedFrame(f"{message.name}: {error}") from error
        return {name: value if isinstance(value, int | float) else str(value) for name, value in decoded.items()}


def key_of(message: Any) -> Key:
    """Under which a described message is kept."""
    return bool(message.is_extended_frame), int(message.frame_id)


def _load(path: Path) -> Any:
    try:
        return load_file(path)
    except (OSError, CantoolsError, ValueError) as error:
        raise ProfileError(f"{path.name} cannot be read as a bus description: {error}") from error
