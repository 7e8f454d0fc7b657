"""Says one thing after another in a thread of its own: an alarm cuts anything, the rest waits a moment or is dropped."""

import logging
import threading
import time
from collections import deque
from typing import Protocol, Self

import msgspec

from proto.decision import Advisory, Urgency

STALE_S = 2.0
"""What could not be begun for so long is out of date."""
MOST_WAITING = 8
MOST_CHARACTERS = 120


class Utterance(msgspec.Struct, frozen=True, kw_only=True):
    """Words, or without words a tone alone."""

    text: str
    urgency: Urgency
    language: str = "en"
    tick: int = 0
    asked_s: float = msgspec.field(default_factory=time.monotonic)
    stale_s: float = STALE_S

    @classmethod
    def of(cls, advisory: Advisory) -> Self:
        """The directive of an advisory, and no other text."""
        return cls(
            text=cleaned(advisory.directive), urgency=advisory.urgency, language=advisory.language, tick=advisory.tick
        )


class Mouth(Protocol):
    """What says an utterance; it returns once the utterance is said, or soon after `cut` is set."""

    def say(self, utterance: Utterance, cut: threading.Event) -> None:
        """Blocks."""

    def close(self) -> None:
        """Nothing more is said."""


def cleaned(text: str) -> str:
    """One line of printable characters, that no command takes for an option."""
    line = " ".join("".join(each if each.isprintable() else " " for each in text).split())
    return line.lstrip("-/ ")[:MOST_CHARACTERS].rstrip()


class Voice:
    """Takes utterances from any thread; says them on its own."""

    def __init__(self, mouth: Mouth, log: logging.Logger) -> None:
        self._mouth, self._log = mouth, log
        self._changed = threading.Condition()
        self._waiting: deque[Utterance] = deque(maxlen=MOST_WAITING)
        self._cut = threading.Event()
        self._ends = False
        self._thread = threading.Thread(target=self._work, name="cockpit-voice", daemon=True)
        self._thread.start()

    def say(self, utterance: Utterance) -> None:
        """Soon; an alarm at once. An advisory without words is not said."""
        if not utterance.text and utterance.urgency not in ("warning", "alarm"):
            return
        with self._changed:
            if utterance.urgency == "alarm":
                self._waiting.clear()
                self._cut.set()
            self._waiting.append(utterance)
            self._changed.notify()

    def close(self) -> None:
        """Cut what is being said, and end."""
        with self._changed:
            self._ends = True
            self._waiting.clear()
            self._cut.set()
            self._changed.notify()
        self._thread.join(3.0)
        self._mouth.close()

    def _next(self) -> Utterance | None:
        with self._changed:
            while not self._ends:
                while self._waiting:
                    utterance = self._waiting.popleft()
                    if time.monotonic() - utterance.asked_s <= utterance.stale_s:
                        self._cut.clear()
                        return utterance
                self._changed.wait()
        return None

    def _work(self) -> None:
        while (utterance := self._next()) is not None:
            try:
                self._mouth.say(utterance, self._cut)
            except OSError as error:
                self._log.warning("nothing was spoken: %s", error)
