"""How often the driver may be spoken to: a budget that hazards neither spend nor wait for."""

import msgspec

from domain.speech import WARNS, presses
from proto.decision import Fused
from services.arbiter.profiles.profile import Profile
from services.arbiter.state import Attention

SET_BACK_NS = 200_000_000
"""A clock that is farther behind the last decision was set back."""


def set_back(attention: Attention, now_ns: int) -> bool:
    """Whether the clock was set back since the last decision: ages reckoned with it would be negative for as long."""
    return attention.refilled_ns is not None and now_ns < attention.refilled_ns - SET_BACK_NS


def refill(attention: Attention, now_ns: int, profile: Profile) -> Attention:
    """One message every `budget_refill_s`, up to `budget_messages`."""
    since = attention.refilled_ns if attention.refilled_ns is not None else now_ns
    grown = attention.messages + max(0, now_ns - since) / 1e9 / profile.budget_refill_s
    return msgspec.structs.replace(
        attention, messages=min(profile.budget_messages, grown), refilled_ns=max(now_ns, since)
    )


def needed(fused: Fused, profile: Profile) -> float:
    """What the budget must hold for a message: mere information leaves a reserve for advice; what presses and what warns waits for
    none."""
    if fused.urgency == "info":
        return 1.0 + profile.budget_reserve
    return 0.0 if presses(fused) or fused.urgency in WARNS else 1.0


def spend(attention: Attention) -> Attention:
    """One message of the budget."""
    return msgspec.structs.replace(attention, messages=max(0.0, attention.messages - 1.0))
