"""One curated field over time: believed, doubted, or silent."""

from typing import NamedTuple

from services.can.profiles.profile import FieldRule
from services.can.signals import reasons

NS = 1_000_000_000
CONFIRMATIONS = 3
"""A value that jumped is believed after this many samples that agree with one another."""


class Reading(NamedTuple):
    """A field now. `reason` is empty where the value may be used; the value is then not None."""

    value: float | None
    stamp_ns: int
    reason: str


class Field:
    """Judges each sample of a field in the field's own unit; keeps no history."""

    def __init__(self, name: str, rule: FieldRule) -> None:
        self.name = name
        self.rule = rule
        self._good: float | None = None
        self._good_ns = 0
        self._suspect: float | None = None
        self._agreeing = 0
        self._reason = reasons.NEVER_SEEN
        self._stamp_ns = 0

    @property
    def seen(self) -> bool:
        """Whether any sample came, good or bad."""
        return self._stamp_ns > 0

    def accept(self, value: float, stamp_ns: int) -> bool:
        """Judge one sample, and say whether it may be used; what fails is a reason, never a zero."""
        rule = self.rule
        if not rule.minimum <= value <= rule.maximum:
            self.reject(reasons.OUT_OF_RANGE, stamp_ns)
        elif self._jumped(value, stamp_ns) and not self._confirmed(value):
            self.reject(reasons.JUMPED, stamp_ns, keep_suspect=True)
        else:
            self._good, self._good_ns, self._stamp_ns = value, stamp_ns, stamp_ns
            self._reason, self._suspect, self._agreeing = "", None, 0
        return not self._reason

    def reject(self, reason: str, stamp_ns: int, *, keep_suspect: bool = False) -> None:
        """A sample that cannot be used."""
        self._reason, self._stamp_ns = reason, stamp_ns
        if not keep_suspect:
            self._suspect, self._agreeing = None, 0

    def read(self, now_ns: int) -> Reading:
        """The field as it may be used now; a stamp from a clock that ran ahead is as silent as an old one."""
        if not self._reason and not -NS <= now_ns - self._stamp_ns <= self.rule.max_age_s * NS:
            return Reading(None, self._stamp_ns, reasons.SILENT)
        return Reading(None if self._reason else self._good, self._stamp_ns, self._reason)

    def _jumped(self, value: float, stamp_ns: int) -> bool:
        step = self.rule.max_step_per_s
        if step is None or self._good is None:
            return False
        elapsed_s = max((stamp_ns - self._good_ns) / NS, 0.02)
        return abs(value - self._good) > step * elapsed_s + 0.01 * abs(self._good) + 0.5

    def _confirmed(self, value: float) -> bool:
        near = self._suspect is not None and abs(value - self._suspect) <= 0.05 * abs(self._suspect) + 1.0
        self._agreeing = self._agreeing + 1 if near else 1
        self._suspect = value
        return self._agreeing >= CONFIRMATIONS
