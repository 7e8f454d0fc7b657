"""How often the driver may be spoken to: a budget that hazards neither spend nor wait for."""

import msgspec

from proto.decision import Urgency
from services.arbiter.profiles import Profile
from services.arbiter.state import Attention, Told

FORGOTTEN_NS = 10_000_000_000
"""What was said longer ago belongs to another moment."""
GRAVER = {"slow_traffic": ("closing_lead",)}
"""To whom was told to brake for a vehicle, that it is slow is no news."""


def refill(attention: Attention, now_ns: int, profile: Profile) -> Attention:
    """One message every `budget_refill_s`, up to `budget_messages`."""
    since = attention.refilled_ns if attention.refilled_ns is not None else now_ns
    grown = attention.messages + max(0, now_ns - since) / 1e9 / profile.budget_refill_s
    return msgspec.structs.replace(
        attention, messages=min(profile.budget_messages, grown), refilled_ns=max(now_ns, since)
    )


def needed(urgency: Urgency, profile: Profile) -> float:
    """What the budget must hold for a message: mere information leaves a reserve for advice."""
    return 1.0 + (profile.budget_reserve if urgency == "info" else 0.0)


def spend(attention: Attention) -> Attention:
    """One message of the budget."""
    return msgspec.structs.replace(attention, messages=max(0.0, attention.messages - 1.0))


def spoken(attention: Attention, now_ns: int) -> Attention:
    """Something was said."""
    return msgspec.structs.replace(attention, spoken_ns=now_ns)


def just_spoken(attention: Attention, now_ns: int, profile: Profile) -> bool:
    """Whether the driver is still listening to what was said last."""
    return attention.spoken_ns is not None and (now_ns - attention.spoken_ns) / 1e9 < profile.speech_gap_s


def told(attention: Attention, hazard: str, now_ns: int, *, alarm: bool) -> Attention:
    """A hazard said."""
    others = tuple(each for each in attention.hazards if each.hazard != hazard and not _forgotten(each, now_ns))
    said = Told(hazard=hazard, stamp_ns=now_ns, alarm=alarm)
    return msgspec.structs.replace(spoken(attention, now_ns), hazards=(*others, said))


def fresh_hazard(attention: Attention, hazard: str, now_ns: int, profile: Profile, *, alarm: bool) -> bool:
    """Whether a hazard was not told yet, or less gravely, or long enough ago to be said again."""
    last = last_told(attention, hazard, now_ns)
    if last is None or (alarm and not last.alarm):
        return True
    return (now_ns - last.stamp_ns) / 1e9 >= profile.hazard_repeat_s


def last_told(attention: Attention, hazard: str, now_ns: int) -> Told | None:
    """The latest word on a hazard, or on a graver one of the same road user; None: there was none of late."""
    names = (hazard, *GRAVER.get(hazard, ()))
    found = [each for each in attention.hazards if each.hazard in names and not _forgotten(each, now_ns)]
    return max(found, key=lambda each: each.stamp_ns, default=None)


def _forgotten(each: Told, now_ns: int) -> bool:
    return now_ns - each.stamp_ns > FORGOTTEN_NS
