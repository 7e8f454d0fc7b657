"""What of the advisories a driver hears: an intervention's words stand in every tick, and are spoken once."""

from typing import Protocol

ACT_PAUSE_S = 0.5
"""An intervention that pauses for less goes on: a tick or two may be lost or doubted."""
WORDS_S = 1.5
"""An alarm that was spoken no longer ago is still in the driver's ear when the car brakes for the same."""


class Told(Protocol):
    """Of an advisory what matters here: `proto.decision.Advisory`, or a report's."""

    @property
    def kind(self) -> str: ...
    @property
    def urgency(self) -> str: ...
    @property
    def hazard(self) -> str: ...
    @property
    def topic(self) -> str: ...


class Hearing:
    """Follows the advisories of a drive in their order."""

    def __init__(self) -> None:
        self._acted_ns: int | None = None
        self._told: set[str] = set()
        self._alarm, self._alarm_ns = "", 0

    def hears(self, advisory: Told, now_ns: int) -> bool:
        """Whether it is spoken: every SPEAK; of an ACT each hazard once, and none that an alarm was just about.

        A caution, which names nothing, adds nothing to an intervention that was told.
        """
        about = advisory.hazard or advisory.topic
        if advisory.kind == "SPEAK" and advisory.urgency == "alarm":
            self._alarm, self._alarm_ns = about, now_ns
        if advisory.kind != "ACT":
            return advisory.kind == "SPEAK"
        if self._acted_ns is None or abs(now_ns - self._acted_ns) >= ACT_PAUSE_S * 1e9:
            self._told = {self._alarm} if abs(now_ns - self._alarm_ns) < WORDS_S * 1e9 else set()
        self._acted_ns = now_ns
        new = about not in self._told and not (about == "caution" and self._told)
        self._told.add(about)
        return new
