"""Speed assistance beside the messages: the limit in force, and an overspeed shown and sounded by the times of a table.

Numbers are those of Regulation (EU) 2021/1958, Annex I (sections in brackets). Pure.
"""

import msgspec

from domain.units import to_mps
from proto.decision import Fused, Preferences
from proto.rules import LegalLimit
from proto.speed_assistance import SpeedAssistance, Warning
from proto.vehicle import Ego
from services.orchestrator.signs.limits import in_force
from services.orchestrator.speech.wording import plate_words
from services.orchestrator.state import Overspeed, State
from services.orchestrator.target.target import UNLIMITED_MPS, Target, law_of

SHOWN_AFTER_S = 1.0
"""From the first tick above the limit; 1.5 s are allowed from the road to the glass (3.5.2.1.1)."""
SOUNDED_AFTER_S: tuple[tuple[float, float], ...] = ((1.3, 3.0), (1.2, 4.0), (1.1, 5.0), (1.0, 6.0))
"""From so many times the limit on it is sounded after so long (3.5.2.1.4)."""
TOLERANCE_SHARE, TOLERANCE_MPS = 0.03, 1.0 / 3.6
"""Of the limit, and beside it: an error of the speedometer is no overspeed (3.2.3, 3.2.4)."""
MOST_SOUND_S = 5.0
"""In all, over changes of the limit too (3.5.2.1.5)."""
HIGH_MPS = 60.0 / 3.6
"""Above it the driver's other tolerance holds."""
MOST_TOLERANCE = 10.0
"""That a driver may choose, in the driver's unit."""
RELEASED, BRAKED = 0.02, 0.05
"""Of the pedals' ways: the foot is off the accelerator, and on the brake."""
FELL_MPS = 0.3
"""A limit that is lower by less is the same."""

VITAL = ("perception", "drivelm", "rules", "can")
"""Without one of these services, its topics or the speed, the limit or an overspeed cannot be told."""
FAULT_NS = 2_000_000_000
"""A shorter gap is no fault."""
ADVISED_SHARE = 0.9
"""Road and weather have a number of their own where they ask for less than this share of the limit."""


def stepped(state: State, ego: Ego | None, acknowledged: bool) -> State:
    """The state after the observations of a tick, with its overspeed."""
    law, before = law_of(state), state.overspeed
    if acknowledged and before.sounded_ns is not None:
        before = msgspec.structs.replace(before, ended=True)
    known = law.limit if law.told else None
    after = step(before, known, _lasting_mps(state), ego, state.preferences, state.now_ns)
    return msgspec.structs.replace(_with_limit(state, known), overspeed=after)


def _lasting_mps(state: State) -> float | None:
    """The speed; over a gap that is no fault yet, the one that was believed last."""
    believed = state.held.speed
    if state.speed_mps is not None or believed is None or state.now_ns - believed.stamp_ns >= FAULT_NS:
        return state.speed_mps
    return believed.mps


def _with_limit(state: State, known: LegalLimit | None) -> State:
    """With the last two limits."""
    if known is None:
        return state
    mps = allowed_mps(known)
    if state.limit_mps is not None and abs(mps - state.limit_mps) < FELL_MPS:
        return state
    return msgspec.structs.replace(state, limit_mps=mps, limit_ns=state.now_ns, former_mps=state.limit_mps)


def allowed_mps(limit: LegalLimit) -> float:
    """The limit's speed; where the law recommends one alone, as high as any."""
    return max(limit.mps, UNLIMITED_MPS) if limit.advisory else limit.mps


def assistance(state: State, fused: Fused, goal: Target) -> SpeedAssistance:
    """What is shown after a tick."""
    limit, speed_mps, shown = fused.legal_limit, state.speed_mps, warning_of(state.overspeed, state.now_ns)
    advised = limit is not None and not limit.assumed and goal.road_mps < ADVISED_SHARE * limit.mps
    over = speed_mps is not None and limit is not None and shown != "none"
    return SpeedAssistance(
        tick=state.tick,
        snapshot_stamp_ns=state.world.stamp_ns,
        speed_mps=speed_mps,
        limit=limit,
        country=state.signs.country or "",
        plate=plate_of(state, limit) if limit is not None else "",
        target_mps=fused.target_mps,
        advised_mps=goal.road_mps if advised else None,
        warning=shown,
        excess_mps=max(0.0, speed_mps - limit.mps) if over and speed_mps is not None and limit is not None else 0.0,
        muted=state.preferences.muted,
        fault=" ".join(sorted({*_missing(state), *(("can",) if _lasting_mps(state) is None else ())})),
    )


def plate_of(state: State, limit: LegalLimit) -> str:
    """The words of the plate under which that limit holds; empty: none."""
    posted = [each.posted for each in in_force(state.signs)]
    same = [each for each in posted if (each.value, each.unit) == (limit.value, limit.unit)]
    if not same or any(not each.plates for each in same):
        return ""
    return plate_words(state.preferences, same[0].plates)


def _missing(state: State) -> set[str]:
    names = (each.kind.split("/")[0] for each in state.missing if state.now_ns - each.since_ns >= FAULT_NS)
    return set(names) & set(VITAL)


def step(
    before: Overspeed,
    limit: LegalLimit | None,
    speed_mps: float | None,
    ego: Ego | None,
    preferences: Preferences,
    now_ns: int,
) -> Overspeed:
    """The overspeed after a tick; `limit` is one that is known well enough to be spoken, else None."""
    sounds = before.sounded_ns is not None and not before.ended
    if limit is None or speed_mps is None or limit.advisory:
        return msgspec.structs.replace(before, since_ns=None, above_ns=(), ended=before.ended or sounds)
    if speed_mps <= limit.mps:
        return Overspeed(limit_mps=limit.mps)
    fell = before.limit_mps is not None and limit.mps < before.limit_mps - FELL_MPS
    if fell:
        before, sounds = Overspeed(limit_mps=limit.mps), False
    after = msgspec.structs.replace(
        before,
        limit_mps=limit.mps,
        since_ns=now_ns if before.since_ns is None else before.since_ns,
        above_ns=_above(before, limit, speed_mps, preferences, now_ns),
    )
    if sounds and before.sounded_ns is not None:
        over = not 0 <= now_ns - before.sounded_ns < MOST_SOUND_S * 1e9 or _answered(ego) or preferences.muted
        return msgspec.structs.replace(after, ended=True) if over else after
    if after.ended or preferences.muted or _answered(ego) or not _is_due(after, now_ns):
        return after
    return msgspec.structs.replace(after, sounded_ns=now_ns)


def kept_up_to_mps(limit_mps: float, preferences: Preferences) -> float:
    """The speed up to which nothing is said of a limit: an error of the speedometer, and what the driver allows."""
    return limit_mps * (1.0 + TOLERANCE_SHARE) + TOLERANCE_MPS + tolerance_mps(preferences, limit_mps)


def _above(
    before: Overspeed, limit: LegalLimit, speed_mps: float, preferences: Preferences, now_ns: int
) -> tuple[int | None, ...]:
    """Since when the speed is above each row's share of the limit and the tolerance, without a break."""
    least_mps = kept_up_to_mps(limit.mps, preferences)
    stood = before.above_ns or (None,) * len(SOUNDED_AFTER_S)
    return tuple(
        (now_ns if since_ns is None else min(since_ns, now_ns))
        if speed_mps > max(least_mps, share * limit.mps)
        else None
        for (share, _), since_ns in zip(SOUNDED_AFTER_S, stood, strict=True)
    )


def tolerance_mps(preferences: Preferences, limit_mps: float) -> float:
    """What the driver allows above this limit before a sound."""
    chosen = preferences.tolerance_high if limit_mps > HIGH_MPS else preferences.tolerance_low
    return to_mps(min(MOST_TOLERANCE, max(0.0, chosen)), preferences.unit)


def _is_due(overspeed: Overspeed, now_ns: int) -> bool:
    rows = zip(SOUNDED_AFTER_S, overspeed.above_ns, strict=True)
    return any(since_ns is not None and now_ns - since_ns >= after_s * 1e9 for (_, after_s), since_ns in rows)


def _answered(ego: Ego | None) -> bool:
    """Whether the driver brakes or has lifted the foot (3.5.2.1.7); a pedal that is not told, or is beyond its way, answers nothing."""
    if ego is None:
        return False
    lifted = ego.accelerator_pedal is not None and abs(ego.accelerator_pedal) <= RELEASED
    return lifted or (ego.brake_pedal is not None and BRAKED <= ego.brake_pedal <= 1.0 + RELEASED)


def warning_of(overspeed: Overspeed, now_ns: int) -> Warning:
    """What is shown or sounded of it now."""
    if overspeed.since_ns is None or now_ns - overspeed.since_ns < SHOWN_AFTER_S * 1e9:
        return "none"
    return "sounded" if overspeed.sounded_ns is not None and not overspeed.ended else "shown"
