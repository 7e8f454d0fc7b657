"""One curated message: from its bytes to the samples of the fields that it feeds."""

from collections.abc import Iterable, Mapping
from typing import Any

from services.can.profiles.extract import extractor, read_all
from services.can.profiles.profile import MessageRule
from services.can.signals import reasons
from services.can.signals.field import Field
from services.can.signals.message_guard import Guard, guard_for
from services.can.signals.source import source, usable

ONE_SENDER_NS = 1_000_000_000
"""So long after a sender's last value another may tell the same J1939 group."""
ANY_SENDER = -1


class Feed:
    """One field's place in one message."""

    __slots__ = ("_sample", "_sender", "_told_ns", "_usable", "field", "measured", "names")

    def __init__(self, field: Field, message: Any) -> None:
        rule = field.rule
        self.field, self._sample = field, source(rule, message)
        self._usable = usable(rule, message) if rule.valid_if else None
        self._sender, self._told_ns = ANY_SENDER, -ONE_SENDER_NS
        self.names = frozenset(each for each in (*rule.signals, rule.negative_if, rule.valid_if) if each)
        """Signals that must be in the frame."""
        self.measured = self.names - frozenset(rule.signals if rule.values and rule.otherwise is None else ())
        """Those of them that must be a measurement; where the profile tells the meaning of each value, it counts."""

    def follows(self, sender: int, stamp_ns: int) -> bool:
        """Whether the field is read from this sender: units that send one J1939 group measure by themselves, and some know nothing.

        Another is followed once the one before has told no value for a second, or the clock fell back.
        """
        if sender != self._sender and 0 <= stamp_ns - self._told_ns < ONE_SENDER_NS:
            return False
        self._sender = sender
        return True

    def take(self, values: Mapping[str, float], stamp_ns: int) -> None:
        """Judge the sample in the physical values of the message's signals."""
        if self._usable is not None and not self._usable(values):
            self.field.reject(reasons.INVALID, stamp_ns)
            return
        value = self._sample(values)
        if value is None:
            self.field.reject(reasons.UNKNOWN_VALUE, stamp_ns)
        elif self.field.accept(value, stamp_ns):
            self._told_ns = stamp_ns


class Watch:
    """A message's feeds, by what guards them. Only the signals that they need are read."""

    def __init__(self, message: Any, fields: Iterable[Field], rule: MessageRule | None, *, j1939: bool) -> None:
        self.last_ns = 0
        self._j1939 = j1939
        self._length: int = message.length
        groups: dict[Any, list[Feed]] = {}
        for field in fields:
            groups.setdefault(guard_for(message, field.rule, rule), []).append(Feed(field, message))
        self._groups = [(Guard(message, *guard) if any(guard) else None, feeds) for guard, feeds in groups.items()]
        names = frozenset().union(*(feed.names for feeds in groups.values() for feed in feeds))
        self._reads = [extractor(message, each, j1939=j1939) for each in message.signals if each.name in names]
        self._read_all = read_all(self._reads)
        self._end = max(each.end for each in self._reads)
        self._careful = any(each.here or each.void for each in self._reads)

    def take(self, data: bytes, stamp_ns: int, frame_id: int) -> bool:
        """Feed the fields from one frame; False where it is too short for all of them. Bytes beyond the described
        length (padding of CAN FD) are not looked at.
        """
        if len(data) > self._length:
            data = data[: self._length]
        if self._j1939 or self._careful or len(data) < self._end:
            return self._take_carefully(data, stamp_ns, frame_id & 0xFF if self._j1939 else ANY_SENDER)
        values = self._read_all(data)
        for guard, feeds in self._groups:
            verdict = guard.judge(data) if guard is not None else ""
            if verdict == "":
                for feed in feeds:
                    feed.take(values, stamp_ns)
            elif verdict:
                _reject(feeds, verdict, stamp_ns)
        return True

    def _take_carefully(self, data: bytes, stamp_ns: int, sender: int) -> bool:
        """Signals may be absent: not selected, beyond a short frame's end, or no measurement; senders may be several."""
        there = [each for each in self._reads if each.end <= len(data) and each.in_frame(data)]
        values = {each.name: each.read(data) for each in there}
        short = frozenset(each.name for each in self._reads if each.end > len(data))
        void = frozenset(each.name for each in there if each.void is not None and each.void(each.raw(data)))
        for guard, feeds in self._groups:
            verdict = guard.judge(data) if guard is not None else ""
            for feed in feeds if verdict is not None else ():
                if not feed.follows(sender, stamp_ns):
                    continue
                if why := verdict or _fault(feed, short, void):
                    feed.field.reject(why, stamp_ns)
                elif feed.names <= values.keys():
                    feed.take(values, stamp_ns)
        return not short


def _fault(feed: Feed, short: frozenset[str], void: frozenset[str]) -> str:
    if feed.names & short:
        return reasons.TOO_SHORT
    return reasons.NOT_AVAILABLE if feed.measured & void else ""


def _reject(feeds: Iterable[Feed], reason: str, stamp_ns: int) -> None:
    for feed in feeds:
        feed.field.reject(reason, stamp_ns)
