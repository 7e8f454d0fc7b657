"""Whether a message is due, and what is remembered of it: the arbiter's rule, and the orchestrator's while no arbiter answers."""

from collections.abc import Callable
from typing import NamedTuple

import msgspec

from proto.decision import ArbitrationRequest, Fused, Urgency
from proto.messages import PRESSING, WORD_COUNTS_NS, Kind, covers
from proto.perception import Track
from proto.speech import Memory, News, Spoken, Warned

GRAVITY: tuple[Urgency, ...] = ("info", "advice", "warning", "alarm")
WARNS = frozenset(GRAVITY[2:])
UNBROKEN_NS = 2_000_000_000
"""A hazard that was away for longer is another one, if it is another road user's."""
KEPT_TOPICS, KEPT_NAMES = 40, 60


# -- whether a message is due --------------------------------------------------------------------------------------------


class Saying(NamedTuple):
    """A message, and all that decides whether it is spoken."""

    fused: Fused
    hazard: str
    """The most pressing hazard, whether the message is about it or not; empty without a hazard."""
    fresh_hazard: bool
    answered: bool = False
    """The driver was told of that hazard and brakes enough."""
    being_heard: bool = False
    c_min: float = 0.0
    messages: float = 1.0
    needed_messages: float = 0.0


Row = tuple[Callable[[Saying], bool], bool, str]
ROWS: tuple[Row, ...] = (
    (lambda s: bool(s.hazard) and s.fresh_hazard and not s.answered, True, "hazard"),
    (lambda s: s.fused.first_notice and not s.being_heard, True, "first notice"),
    (lambda s: bool(s.hazard) and s.answered, False, "the driver was told and brakes enough"),
    (lambda s: bool(s.hazard), False, "the hazard was just told"),
    (lambda s: s.fused.muted, False, "muted by the driver"),
    (lambda s: not s.fused.directive, False, "nothing to say"),
    (lambda s: not s.fused.new_information, False, "nothing new"),
    (lambda s: s.fused.confidence < s.c_min, False, "less sure than c_min"),
    (lambda s: s.being_heard, False, "the last message, as grave, is still being heard"),
    (lambda s: s.messages < s.needed_messages, False, "attention budget spent"),
    (lambda s: True, True, "new advice"),
)
"""The first row that holds decides. Hazards and first notices stand before mute, confidence and budget. A first notice stays owed
while a message as grave is being heard."""


def due(saying: Saying) -> tuple[bool, str]:
    """Whether the message is spoken, and why."""
    return next((speak, reason) for holds, speak, reason in ROWS if holds(saying))


def presses(fused: Fused) -> bool:
    """Whether a message is useless later."""
    return fused.topic in PRESSING and fused.urgency != "info"


def being_heard(memory: Memory, fused: Fused, now_ns: int, gap_s: float) -> bool:
    """Whether the driver still listens to the last message. A warning or an alarm cuts a calmer one short; all else waits."""
    if memory.spoken_ns is None or (now_ns - memory.spoken_ns) / 1e9 >= gap_s:
        return False
    now, before = (GRAVITY.index(urgency) for urgency in (fused.urgency, memory.urgency))
    return fused.urgency not in WARNS or now <= before


def is_fresh(memory: Memory, hazard: str, now_ns: int, repeat_s: float, *, alarm: bool) -> bool:
    """Whether the driver was not warned of a hazard yet, or less gravely, or long enough ago to be warned again."""
    return not is_told(memory, hazard, now_ns, alarm=alarm, within_s=repeat_s)


def is_told(memory: Memory, hazard: str, now_ns: int, *, alarm: bool, within_s: float | None = None) -> bool:
    """Whether the driver was warned of a hazard recently, or in the last `within_s`, as gravely."""
    last = last_warned(memory, hazard, now_ns)
    if last is None or (alarm and not last.alarm):
        return False
    return within_s is None or (now_ns - last.stamp_ns) / 1e9 < within_s


def last_warned(memory: Memory, hazard: str, now_ns: int) -> Warned | None:
    """The latest warning of a hazard, or of a graver one of the same road user; None: no such warning recently."""
    found = [each for each in memory.hazards if covers(each.hazard, hazard) and not _forgotten(each, now_ns)]
    return max(found, key=lambda each: each.stamp_ns, default=None)


def is_meant(said: Warned, track: Track, now_ns: int) -> bool:
    """Whether a warning was about this road user: in the path then, or first seen since while the hazard never went.

    The second is mostly the same road user under a new track id.
    """
    since = now_ns - round(track.age_s * 1e9) >= said.stamp_ns
    return track.track_id in said.track_ids or (since and _unbroken(said, now_ns))


# -- what is remembered ----------------------------------------------------------------------------------------------------


def standing(memory: Memory, hazards: tuple[str, ...], now_ns: int) -> Memory:
    """The hazards that were told stand still, or again after no more than a moment."""
    kept = tuple(
        msgspec.structs.replace(each, stood_ns=now_ns)
        if any(covers(each.hazard, hazard) for hazard in hazards) and _unbroken(each, now_ns)
        else each
        for each in memory.hazards
    )
    return msgspec.structs.replace(memory, hazards=kept)


def said(
    memory: Memory,
    request: ArbitrationRequest,
    hazard: str,
    now_ns: int,
    *,
    alarm: bool,
    track_ids: tuple[int, ...] = (),
) -> Memory:
    """The memory after a tick's message; `hazard` is what it warns of, where the message is not the request's, too."""
    entries = _entries(request, hazard, now_ns)
    replaced = {(each.kind, each.about) for each in entries}
    others = tuple(each for each in memory.spoken if (each.kind, each.about) not in replaced)
    names = request.message.names if request.message is not None and not _alone(request, hazard) else ()
    urgency = ("alarm" if alarm else "warning") if hazard else request.fused.urgency
    warned = tuple(each for each in memory.hazards if each.hazard != hazard and not _forgotten(each, now_ns))
    last = (Warned(hazard=hazard, stamp_ns=now_ns, alarm=alarm, track_ids=track_ids, stood_ns=now_ns),)
    return Memory(
        spoken=(*others, *entries)[-KEPT_TOPICS:],
        hazards=(*warned, *last) if hazard else memory.hazards,
        spoken_ns=now_ns,
        urgency=urgency,
        noticed=tuple(dict.fromkeys((*memory.noticed, *names)))[-KEPT_NAMES:],
    )


def _entries(request: ArbitrationRequest, hazard: str, now_ns: int) -> tuple[Spoken, ...]:
    message = request.message
    if message is None or _alone(request, hazard):
        return (Spoken(kind=Kind.CAUTION, news=News(what="caution"), stamp_ns=now_ns),)
    own = Spoken(kind=message.kind, about=message.about, news=message.news, stamp_ns=now_ns)
    if message.tells is None:
        return (own,)
    kind, news = message.tells
    return own, Spoken(kind=kind, news=news, stamp_ns=now_ns)


def _alone(request: ArbitrationRequest, hazard: str) -> bool:
    """Whether the warning is about something else than the fused advice: the arbiter alone sees it."""
    return hazard not in ("", request.fused.hazard)


def without(memory: Memory, past: tuple[Kind, ...]) -> Memory:
    """The memory without the last message of some kinds: what they announced is over, the same again is news."""
    return msgspec.structs.replace(memory, spoken=tuple(each for each in memory.spoken if each.kind not in past))


AHEAD_NS = 200_000_000
"""So far ahead the clock of another process may be."""


def on_this_clock(memory: Memory, now_ns: int) -> Memory:
    """The memory by a clock that was set back: what is stamped later than now is forgotten, and so are all warnings."""
    return msgspec.structs.replace(adopted(memory, now_ns - AHEAD_NS), hazards=())


def adopted(memory: Memory, now_ns: int) -> Memory:
    """Another process's memory: what it stamps later than now would silence for as long, and is forgotten."""
    latest_ns, spoken_ns = now_ns + AHEAD_NS, memory.spoken_ns
    return msgspec.structs.replace(
        memory,
        spoken=tuple(each for each in memory.spoken if each.stamp_ns <= latest_ns),
        hazards=tuple(each for each in memory.hazards if each.stamp_ns <= latest_ns),
        spoken_ns=spoken_ns if spoken_ns is not None and spoken_ns <= latest_ns else None,
    )


def _unbroken(each: Warned, now_ns: int) -> bool:
    return each.stood_ns is not None and now_ns - each.stood_ns <= UNBROKEN_NS


def _forgotten(each: Warned, now_ns: int) -> bool:
    return now_ns - each.stamp_ns > WORD_COUNTS_NS
