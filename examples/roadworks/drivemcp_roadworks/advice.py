"""What the roadworks expert knows. Pure: values in, values out."""

import msgspec

from proto.scene import Fact

ZONE_M = 400.0
"""How far behind a roadworks sign care is still advised: the length of a usual day site, our choice."""
NARROW_FACTOR = 0.8
HEADWAY_FACTOR = 1.3


class Seen(msgspec.Struct, frozen=True, kw_only=True):
    """A roadworks sign, and how far the car has come since. `driven_m` is None while the ego speed is unknown."""

    confidence: float
    driven_m: float | None = 0.0


class Advice(msgspec.Struct, frozen=True, kw_only=True):
    """Factors that can only lower the target and widen the headway, why, and how sure."""

    speed_factor: float
    headway_factor: float
    reason: str
    confidence: float


def notice(seen: Seen | None, facts: tuple[Fact, ...]) -> Seen | None:
    """The strongest roadworks sign of some facts begins a zone; believed or not, a doubted sign counts as well."""
    found = [fact for fact in facts if fact.kind == "sign" and fact.reading == "roadworks"]
    if any(fact.kind == "limit" and fact.scope == "end" and fact.reading == "all_end" for fact in facts):
        seen = None
    return Seen(confidence=max(fact.confidence for fact in found)) if found else seen


def drive(seen: Seen | None, speed_mps: float | None, dt_s: float) -> Seen | None:
    """Move on: the zone ends after its length; with unknown speed it does not end."""
    if seen is None or speed_mps is None or seen.driven_m is None:
        return None if seen is None else msgspec.structs.replace(seen, driven_m=seen.driven_m)
    driven_m = seen.driven_m + max(0.0, speed_mps) * dt_s
    return None if driven_m > ZONE_M else msgspec.structs.replace(seen, driven_m=driven_m)


def advise(seen: Seen | None) -> Advice:
    """Slower and further apart within a zone."""
    if seen is None:
        return Advice(speed_factor=1.0, headway_factor=1.0, reason="", confidence=1.0)
    return Advice(
        speed_factor=NARROW_FACTOR,
        headway_factor=HEADWAY_FACTOR,
        reason="roadworks: narrow lanes and people at the roadside",
        confidence=seen.confidence,
    )
