"""How often the driver may be spoken to: a budget that hazards neither spend nor wait for."""

import msgspec

from proto.decision import Urgency
from proto.messages import PRESSING, WORD_COUNTS_NS, covers
from proto.perception import Track
from services.arbiter.profiles.profile import Profile
from services.arbiter.state import Attention, Told

GRAVITY: tuple[Urgency, ...] = ("info", "advice", "warning", "alarm")
WARNS = frozenset(GRAVITY[2:])
UNBROKEN_NS = 2_000_000_000
"""A hazard that was away for longer is another one, if it is another road user's."""
SET_BACK_NS = 200_000_000
"""A clock that is farther behind the last decision was set back."""


def set_back(attention: Attention, now_ns: int) -> bool:
    """Whether the clock was set back since the last decision: ages reckoned with it would be negative for as long."""
    return attention.refilled_ns is not None and now_ns < attention.refilled_ns - SET_BACK_NS


def forget(attention: Attention) -> Attention:
    """Nothing was told, as far as this clock knows; what the budget holds stays."""
    return Attention(messages=attention.messages)


def refill(attention: Attention, now_ns: int, profile: Profile) -> Attention:
    """One message every `budget_refill_s`, up to `budget_messages`."""
    since = attention.refilled_ns if attention.refilled_ns is not None else now_ns
    grown = attention.messages + max(0, now_ns - since) / 1e9 / profile.budget_refill_s
    return msgspec.structs.replace(
        attention, messages=min(profile.budget_messages, grown), refilled_ns=max(now_ns, since)
    )


def needed(topic: str, urgency: Urgency, profile: Profile) -> float:
    """What the budget must hold for a message: mere information leaves a reserve for advice; what presses and what warns waits for
    none."""
    if urgency == "info":
        return 1.0 + profile.budget_reserve
    return 0.0 if topic in PRESSING or urgency in WARNS else 1.0


def presses(topic: str, urgency: Urgency) -> bool:
    """Whether a message is of no use later."""
    return topic in PRESSING and urgency != "info"


def spend(attention: Attention) -> Attention:
    """One message of the budget."""
    return msgspec.structs.replace(attention, messages=max(0.0, attention.messages - 1.0))


def spoken(attention: Attention, urgency: Urgency, now_ns: int, *, pressed: bool) -> Attention:
    """Something was said."""
    return msgspec.structs.replace(attention, spoken_ns=now_ns, spoken_urgency=urgency, spoken_pressed=pressed)


def just_spoken(attention: Attention, topic: str, urgency: Urgency, now_ns: int, profile: Profile) -> bool:
    """Whether the driver is still listening to what was said last. What is graver cuts that short; as grave, what presses does
    if that did not."""
    if attention.spoken_ns is None or (now_ns - attention.spoken_ns) / 1e9 >= profile.speech_gap_s:
        return False
    now, before = GRAVITY.index(urgency), GRAVITY.index(attention.spoken_urgency)
    return now < before or (now == before and (attention.spoken_pressed or not presses(topic, urgency)))


def told(attention: Attention, hazard: str, now_ns: int, *, alarm: bool, track_ids: tuple[int, ...]) -> Attention:
    """A hazard said, with everyone in the path at that word."""
    others = tuple(each for each in attention.hazards if each.hazard != hazard and not _forgotten(each, now_ns))
    said = Told(hazard=hazard, stamp_ns=now_ns, alarm=alarm, track_ids=track_ids, stood_ns=now_ns)
    heard = spoken(attention, "alarm" if alarm else "warning", now_ns, pressed=True)
    return msgspec.structs.replace(heard, hazards=(*others, said))


def standing(attention: Attention, hazard: str, now_ns: int) -> Attention:
    """The hazard that was told stands still, or again after no more than a moment."""
    if not hazard:
        return attention
    kept = tuple(
        msgspec.structs.replace(each, stood_ns=now_ns) if _names(each, hazard) and _unbroken(each, now_ns) else each
        for each in attention.hazards
    )
    return msgspec.structs.replace(attention, hazards=kept)


def meant(said: Told, track: Track, now_ns: int) -> bool:
    """Whether a word was about this road user: in the path then, or first seen since while the hazard never went.

    The second is mostly the same one under a new track id.
    """
    since = now_ns - round(track.age_s * 1e9) >= said.stamp_ns
    return track.track_id in said.track_ids or (since and _unbroken(said, now_ns))


def fresh_hazard(attention: Attention, hazard: str, now_ns: int, profile: Profile, *, alarm: bool) -> bool:
    """Whether a hazard was not told yet, or less gravely, or long enough ago to be said again."""
    last = last_told(attention, hazard, now_ns)
    if last is None or (alarm and not last.alarm):
        return True
    return (now_ns - last.stamp_ns) / 1e9 >= profile.hazard_repeat_s


def last_told(attention: Attention, hazard: str, now_ns: int) -> Told | None:
    """The latest word on a hazard, or on a graver one of the same road user; None: there was none of late."""
    found = [each for each in attention.hazards if _names(each, hazard) and not _forgotten(each, now_ns)]
    return max(found, key=lambda each: each.stamp_ns, default=None)


def _names(each: Told, hazard: str) -> bool:
    return covers(each.hazard, hazard)


def _unbroken(each: Told, now_ns: int) -> bool:
    return each.stood_ns is not None and now_ns - each.stood_ns <= UNBROKEN_NS


def _forgotten(each: Told, now_ns: int) -> bool:
    return now_ns - each.stamp_ns > WORD_COUNTS_NS
