"""How often the driver may be spoken to: a budget that hazards neither spend nor wait for."""

import msgspec

from services.arbiter.profiles import Profile
from services.arbiter.state import Attention


def refill(attention: Attention, now_ns: int, profile: Profile) -> Attention:
    """One message every `budget_refill_s`, up to `budget_messages`."""
    since = attention.refilled_ns if attention.refilled_ns is not None else now_ns
    grown = attention.messages + max(0, now_ns - since) / 1e9 / profile.budget_refill_s
    return msgspec.structs.replace(
        attention, messages=min(profile.budget_messages, grown), refilled_ns=max(now_ns, since)
    )


def spend(attention: Attention) -> Attention:
    """One message said."""
    return msgspec.structs.replace(attention, messages=max(0.0, attention.messages - 1.0))


def told(attention: Attention, hazard: str, now_ns: int, *, alarm: bool) -> Attention:
    """A hazard said."""
    return msgspec.structs.replace(attention, hazard=hazard, hazard_ns=now_ns, alarm=alarm)


def fresh_hazard(attention: Attention, hazard: str, now_ns: int, profile: Profile, *, alarm: bool) -> bool:
    """Whether a hazard is another than the last one told, or graver, or was told long enough ago to be said again."""
    if attention.hazard != hazard or attention.hazard_ns is None or (alarm and not attention.alarm):
        return True
    return (now_ns - attention.hazard_ns) / 1e9 >= profile.hazard_repeat_s
