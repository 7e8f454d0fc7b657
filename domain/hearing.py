"""What of the advisories a driver hears: an intervention's words stand in every tick, and are spoken once and again in their time."""

from typing import Protocol

ACT_PAUSE_S = 0.5
"""An intervention that pauses for less goes on: a tick or two may be lost or doubted."""
WORDS_S = 1.5
"""An alarm that was spoken no longer ago is still in the driver's ear when the car brakes for the same."""
REPEAT_S = 4.0
"""Words of an intervention that lasts are spoken again, as the arbiter repeats those on a hazard (`hazard_repeat_s`)."""


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
        self.begins = False
        """Whether the last advisory began an intervention, spoken or not."""
        self._acted_ns: int | None = None
        self._heard_ns: dict[str, int] = {}
        """Of this intervention: what was spoken, and when last."""
        self._names = False
        """Whether this intervention has named something."""
        self._alarm: tuple[str, int] | None = None

    def notes(self, advisory: Told, now_ns: int) -> bool:
        """Whether it is spoken, or begins an intervention: what a list of messages shows."""
        return self.hears(advisory, now_ns) or self.begins

    def hears(self, advisory: Told, now_ns: int) -> bool:
        """Whether it is spoken: every SPEAK; of an ACT each hazard (else its topic) once in 4 s, and none that an alarm was just about.

        A caution, which names nothing, adds nothing to an intervention that has named something.
        """
        about = advisory.hazard or advisory.topic
        self.begins = False
        if advisory.kind == "SPEAK" and advisory.urgency == "alarm":
            self._alarm = about, now_ns
        if advisory.kind != "ACT":
            return advisory.kind == "SPEAK"
        if self._acted_ns is None or abs(now_ns - self._acted_ns) >= ACT_PAUSE_S * 1e9:
            alarms = () if self._alarm is None else (self._alarm,)
            self._heard_ns = {each: at_ns for each, at_ns in alarms if abs(now_ns - at_ns) < WORDS_S * 1e9}
            self._names, self.begins = False, True
        self._acted_ns = now_ns
        heard_ns = self._heard_ns.get(about)
        due = heard_ns is None or abs(now_ns - heard_ns) >= REPEAT_S * 1e9
        spoken = due and not (about == "caution" and self._names)
        if spoken:
            self._heard_ns[about] = now_ns
        self._names |= about != "caution"
        return spoken
