"""A bus description (DBC), indexed by id and by signal name."""

from pathlib import Path
from typing import Any

from cantools.database import load_file
from cantools.database.errors import Error as CantoolsError

from services.can.errors import MalformedFrame, ProfileError


class Dbc:
    """Messages by id and signals by name. Signal names are expected to be unique; of two the first counts."""

    def __init__(self, path: Path) -> None:
        try:
            database: Any = load_file(path)
        except (OSError, CantoolsError, ValueError) as error:
            raise ProfileError(f"{path.name} cannot be read as a bus description: {error}") from error
        self.nodes: tuple[str, ...] = tuple(node.name for node in database.nodes)
        self.messages: dict[int, Any] = {message.frame_id: message for message in database.messages}
        self._signals: dict[str, tuple[Any, Any]] = {}
        for message in database.messages:
            for signal in message.signals:
                self._signals.setdefault(signal.name, (message, signal))

    def signal(self, name: str) -> tuple[Any, Any]:
        """(message, signal). Raises ProfileError."""
        try:
            return self._signals[name]
        except KeyError:
            raise ProfileError(f"no signal {name!r} in the bus description") from None

    def has_signal(self, name: str) -> bool:
        """Whether the description names this signal."""
        return name in self._signals

    def decode(self, arbitration_id: int, data: bytes) -> dict[str, float | str]:
        """Every signal of a frame, named choices as text. Raises MalformedFrame where frame and description do not
        fit.
        """
        message = self.messages.get(arbitration_id)
        if message is None:
            raise MalformedFrame(f"no message with id 0x{arbitration_id:X} in the bus description")
        if len(data) < message.length:
            raise MalformedFrame(f"{message.name} has {message.length} bytes, not {len(data)}")
        try:
            decoded = message.decode(data[: message.length], decode_choices=True)
        except (CantoolsError, ValueError, KeyError) as error:
            raise MalformedFrame(f"{message.name}: {error}") from error
        return {name: value if isinstance(value, int | float) else str(value) for name, value in decoded.items()}
