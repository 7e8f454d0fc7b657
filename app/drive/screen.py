"""What a terminal shows while something drives: lines that stay, and one that is redrawn."""

import shutil
import sys
import threading
import time
from collections.abc import Callable
from contextlib import suppress

from drivemcp.terminal import own_terminal, printable


def _to_terminal(text: str) -> None:
    with suppress(OSError):  # a terminal that was closed; what there is to end is ended all the same
        stream = own_terminal(sys.stderr)
        stream.write(text)
        stream.flush()


class Screen:
    """A live line that is redrawn on a terminal, and printed now and then elsewhere."""

    def __init__(self, write: Callable[[str], object] | None = None) -> None:
        self._write = write if write is not None else _to_terminal
        self._tty = sys.stderr.isatty()
        self._last_s = 0.0
        self._drawn = 0
        self._lock = threading.Lock()

    def say(self, text: str) -> None:
        """A line that stays."""
        with self._lock:
            self._clear()
            self._write(printable(text) + "\n")

    def live(self, text: str) -> None:
        """The live line."""
        text = printable(text).replace("\n", " ")
        now_s = time.monotonic()
        with self._lock:
            if self._tty:
                self._clear()
                self._write(text)
                self._drawn = len(text)
            elif now_s - self._last_s >= 5.0:
                self._last_s = now_s
                self._write(text + "\n")

    def width(self) -> int:
        """Columns that a line may take."""
        return max(40, shutil.get_terminal_size((160, 24)).columns - 1)

    def end_live(self) -> None:
        """Leave the live line where it is."""
        with self._lock:
            if self._drawn:
                self._write("\n")
                self._drawn = 0

    def _clear(self) -> None:
        if self._drawn:
            self._write("\r" + " " * self._drawn + "\r")
            self._drawn = 0
