"""What guards a message: its checksum, and the counter that shows that its sender lives. Profile before description."""

from collections.abc import Callable
from typing import Any

from services.can.errors import ProfileError
from services.can.profiles.extract import extractor, signal_of
from services.can.profiles.profile import ChecksumRule, FieldRule, MessageRule
from services.can.signals import reasons
from services.can.signals.checksum import KINDS, checker

STUCK_AFTER = 3
"""So many frames in a row with the same counter mean a sender that repeats itself."""
MAX_STEP = 7
"""A counter may go on by so much at once (six frames lost), or by less than half its range."""

GUARD_ATTRIBUTES = ("GenSigFuncType", "SigFuncType")
"""Attributes of signals that say what a signal is for, as text or as one of an enumeration's values."""
COUNTERS = ("CNTR", "COUNTER", "SEQUENCECOUNTER", "SNC", "ALIVE", "BZ")
CHECKSUMS = ("CHK", "CHECKSUM", "CRC")
KIND_ATTRIBUTE, ID_ATTRIBUTES = "ChecksumKind", ("DataIds", "DataID", "E2E_DataID", "E2EDataId")
"""Attributes of messages: a kind of ours, and its data ids (numbers, apart by commas)."""
AUTOSAR_CODES = {
    "CRC_AR_01_BOTH": "e2e-p1-both",
    "CRC_AR_01_ALT": "e2e-p1-alt",
    "CRC_AR_01_LOW": "e2e-p1-low",
    "CRC_AR_01_NIBBLE": "e2e-p1-nibble",
    "CRC_AR_02": "e2e-p2",
    "CRC_AR_05": "e2e-p5",
}
"""Values of GenSigFuncType that name AUTOSAR's profile too."""


class Guard:
    """Judges the frames of one message, in order."""

    def __init__(self, message: Any, counter: str, checksum: ChecksumRule | None) -> None:
        self._counter = _extractor(message, counter) if counter else None
        self._right: Callable[[bytes], bool] | None = None
        if checksum is not None:
            self._right = checker(checksum.kind, message, signal_of(message, checksum.signal), checksum.data_ids)
        self.whole = message.length if checksum is not None else self._counter.end if self._counter else 0
        """A frame must have so many bytes to be judged."""
        self._modulo = _modulo(message, counter, checksum) if counter else 0
        self._last: int | None = None
        self._repeats = 0

    def judge(self, data: bytes) -> str | None:
        """Why a frame cannot be believed: "" where it can, None where it only says again what was said."""
        if len(data) < self.whole:
            return reasons.TOO_SHORT
        if self._right is not None and not self._right(data):
            return reasons.WRONG_CHECKSUM
        return self._count(self._counter.raw(data)) if self._counter is not None else ""

    def _count(self, count: int) -> str | None:
        before, self._last = self._last, count
        if before is None:
            return ""
        step = (count - before) % self._modulo
        self._repeats = 0 if step else self._repeats + 1
        if not step:
            return reasons.REPEATED if self._repeats >= STUCK_AFTER else None
        return "" if step <= min(MAX_STEP, max(1, self._modulo // 2 - 1)) else "counter jumped"


def guard_for(message: Any, rule: FieldRule, of_message: MessageRule | None) -> tuple[str, ChecksumRule | None]:
    """(counter, checksum) of a field's message: by the field, else the message's rule, else the description."""
    counter, checksum = declared(message)
    if of_message is not None:
        counter, checksum = of_message.counter or counter, of_message.checksum or checksum
    return rule.counter or counter, rule.checksum or checksum


def declared(message: Any) -> tuple[str, ChecksumRule | None]:
    """(counter, checksum) as the description's attributes declare them; a checksum only where its kind is known."""
    counter, checksum = "", None
    for signal in message.signals:
        function = _function(signal)
        if function.startswith(COUNTERS):
            counter = counter or signal.name
        elif function.startswith(CHECKSUMS) and (kind := _kind(message, function)):
            checksum = checksum or ChecksumRule(signal=signal.name, kind=kind, data_ids=_ids(message))
    return counter, checksum


def _function(signal: Any) -> str:
    for name in GUARD_ATTRIBUTES:
        attribute = signal.dbc.attributes.get(name) if signal.dbc else None
        if attribute is not None:
            choices = attribute.definition.choices or ()
            index = attribute.value
            text = choices[index] if isinstance(index, int) and 0 <= index < len(choices) else str(index)
            return str(text).upper()
    return ""


def _kind(message: Any, function: str) -> str:
    stated = str(_message_attribute(message, KIND_ATTRIBUTE))
    kind = stated or AUTOSAR_CODES.get(function, "")
    if stated and stated not in KINDS:
        raise ProfileError(f"message {message.name}: no {KIND_ATTRIBUTE} {stated!r}; known are {', '.join(KINDS)}")
    return kind


def _ids(message: Any) -> tuple[int, ...]:
    text = next((str(value) for name in ID_ATTRIBUTES if (value := _message_attribute(message, name)) != ""), "")
    try:
        return tuple(int(each, 0) for each in text.strip("[](){} ").split(",") if each.strip())
    except ValueError:
        raise ProfileError(f"message {message.name}: data ids {text!r} are no numbers, apart by commas") from None


def _message_attribute(message: Any, name: str) -> Any:
    attribute = message.dbc.attributes.get(name) if message.dbc else None
    return "" if attribute is None else attribute.value


def _modulo(message: Any, counter: str, checksum: ChecksumRule | None) -> int:
    """AUTOSAR's profile 1 counts from 0 to 14."""
    if checksum is not None and checksum.kind.startswith("e2e-p1"):
        return 15
    return 1 << int(signal_of(message, counter).length)


def _extractor(message: Any, name: str) -> Any:
    return extractor(message, signal_of(message, name))
