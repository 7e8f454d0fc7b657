"""What of the advisories a driver hears: an intervention's words stand in every tick, and are spoken once."""

from proto.decision import DecisionKind

ACT_PAUSE_S = 0.5
"""An intervention that pauses for less goes on: a tick or two may be lost or doubted."""


class Hearing:
    """Follows the advisories of a drive in their order."""

    def __init__(self) -> None:
        self._acted_ns: int | None = None
        self._told: set[str] = set()

    def hears(self, kind: DecisionKind | str, about: str, now_ns: int) -> bool:
        """Whether this advisory is spoken: every SPEAK; of an ACT each thing that it is `about` (its hazard, else its topic) once.

        A caution, which names nothing, adds nothing to an intervention that was told.
        """
        if kind != "ACT":
            return kind == "SPEAK"
        if self._acted_ns is None or abs(now_ns - self._acted_ns) >= ACT_PAUSE_S * 1e9:
            self._told.clear()
        self._acted_ns = now_ns
        new = about not in self._told and not (about == "caution" and self._told)
        self._told.add(about)
        return new
