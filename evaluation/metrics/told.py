"""What infractions came from: whether the driver was told in time, late, wrongly or not at all."""

from collections import Counter
from collections.abc import Iterator, Sequence
from typing import Literal, get_args

import msgspec

from domain.units import MPS_PER
from evaluation.metrics.conflicts import median_stop_m
from evaluation.metrics.law import SAME_LIMIT_MPS, SPEEDING_AFTER_S, TOLERANCE_MPS, TYPES, same_limit
from evaluation.metrics.record import At, Record
from proto.decision import Advisory
from proto.messages import ROWS, Kind
from proto.truth import Truth

Cause = Literal["told in time", "told late", "told wrongly", "not told"]
CAUSES: tuple[Cause, ...] = get_args(Cause)
BEFORE_S = 25.0
"""Ours: what was said longer before a limit began, or before a line was crossed, does not count."""
REACTS_S, SOFT_MPS2 = 1.25, 2.0
"""Ours: a driver brakes so long after a word at the earliest that counts, and for a limit not harder than that."""
OF_LIMITS = ("limit", "ahead", "border")
OF_A_LINE = frozenset({*ROWS[Kind.STOP].hazards, Kind.STOP, "stop_line"})
OF_A_PLACE = frozenset({Kind.GIVE_WAY, "give_way", "priority", "right_of_way", "yield"})


class Speeding(msgspec.Struct, frozen=True, kw_only=True):
    """An episode of `evaluation.metrics.law.speeding_episodes`, and the first word on its limit."""

    from_s: float
    """When the limit was first exceeded by more than the tolerance."""
    to_s: float
    limit_mps: float
    """The one in force at the beginning."""
    by_mps: float
    """The most."""
    told_s: float | None
    """When the driver first heard of that limit; None: not since 25 s before it began."""
    needs_mps2: float | None
    """The braking that would have obeyed from 1.25 s after the word on; infinite: no time was left."""
    wrong: bool = False
    """Whether the last limit that was told as in force is a higher one."""

    @property
    def cause(self) -> Cause:
        """Told in time: 2 m/s² would have obeyed."""
        if self.wrong:
            return "told wrongly"
        if self.needs_mps2 is None:
            return "not told"
        return "told in time" if self.needs_mps2 <= SOFT_MPS2 else "told late"


def causes(record: Record) -> dict[Cause, int]:
    """How many infractions came from each; together they are all infractions but illegal turns, of which nothing is told."""
    crossed = (_cause_of_crossing(record, each) for each in record.truths if TYPES.get(each.infraction) in _CROSSINGS)
    counts = Counter[Cause]((*(each.cause for each in speedings(record)), *crossed))
    return {cause: counts[cause] for cause in CAUSES}


_CROSSINGS = ("failure_to_stop", "wrong_yielding")


def _cause_of_crossing(record: Record, crossed: Truth) -> Cause:
    """In time: the median driver could have stopped between a word on such a line and the line."""
    words = OF_A_PLACE if TYPES[crossed.infraction] == "wrong_yielding" else OF_A_LINE
    about = [
        each
        for each in record.spoken
        if crossed.time_s - BEFORE_S < each.time_s < crossed.time_s
        and {each.message.topic, each.message.hazard} & words
    ]
    if not about:
        return "not told"
    shown = about[-1].message.picture
    if shown is not None and shown.face == "green_light":
        return "told wrongly"
    return "told in time" if any(_could_stop(record, each, crossed) for each in about) else "told late"


def _could_stop(record: Record, said: At[Advisory], crossed: Truth) -> bool:
    heard = record.truth_at(said.time_s)
    return heard is not None and median_stop_m(heard.speed_mps, heard) <= crossed.distance_m - heard.distance_m


def speedings(record: Record) -> Iterator[Speeding]:
    """In the order of time; as many as `speeding_episodes` counts."""
    for over in _episodes(record.truths):
        begun, limit_mps = over[0], over[0].law_limit_mps or 0.0
        since_s = _since_s(record, begun)
        before = [each for each in record.spoken if since_s - BEFORE_S < each.time_s < begun.time_s]
        told_s = next((each.time_s for each in before if _is_of(record, each, limit_mps)), None)
        yield Speeding(
            from_s=begun.time_s,
            to_s=over[-1].time_s,
            limit_mps=limit_mps,
            by_mps=max(_over_mps(truth) for truth in over),
            told_s=told_s,
            needs_mps2=None if told_s is None else _needs_mps2(record, told_s, begun),
            wrong=_told_a_higher_one([each for each in before if each.time_s >= since_s], limit_mps),
        )


def _since_s(record: Record, begun: Truth) -> float:
    """Since when the limit has been in force."""
    found = begun.time_s
    for truth in reversed(record.truths_between(0.0, begun.time_s)):
        if truth.law_limit_mps is None or not same_limit(truth.law_limit_mps, begun.law_limit_mps or 0.0):
            break
        found = truth.time_s
    return found


def _told_a_higher_one(told: Sequence[At[Advisory]], limit_mps: float) -> bool:
    """Whether the last limit that was told while this one is in force is a higher one."""
    last = next(
        (each.message.told_limit_mps for each in reversed(told) if each.message.told_limit_mps is not None), None
    )
    return last is not None and last > limit_mps + SAME_LIMIT_MPS


def _episodes(truths: Sequence[Truth]) -> Iterator[list[Truth]]:
    """Each from where the tolerance is left, for a second or more, to where the speed is back at the limit."""
    above: list[Truth] = []
    over_s, counts, before_s = 0.0, False, 0.0
    for truth in truths:
        beyond = _over_mps(truth) > TOLERANCE_MPS
        over_s = over_s + truth.time_s - before_s if beyond else 0.0
        before_s = truth.time_s
        if not (beyond or (counts and _over_mps(truth) > 0.0)):
            if counts:
                yield above
            above, counts = [], False
            continue
        above.append(truth)
        counts = counts or over_s >= SPEEDING_AFTER_S - 1e-6
    if counts:
        yield above


def _over_mps(truth: Truth) -> float:
    return 0.0 if truth.law_limit_mps is None else truth.speed_mps - truth.law_limit_mps


def _is_of(record: Record, said: At[Advisory], limit_mps: float) -> bool:
    """Whether a message announces the limit, tells that a sign means it, or asks for it, or less, where it is in force."""
    message, there = said.message, record.truth_at(said.time_s)
    if message.topic == "foreign":
        shown = message.picture
        return (
            shown is not None
            and shown.value is not None
            and same_limit(shown.value * MPS_PER[shown.unit or "km/h"], limit_mps)
        )
    if message.topic not in OF_LIMITS:
        return False
    if message.ahead_mps is not None:
        return same_limit(message.ahead_mps, limit_mps)
    if message.told_limit_mps is not None and same_limit(message.told_limit_mps, limit_mps):
        return True
    asked, law_mps = message.asked_mps, there.law_limit_mps if there else None
    return (
        asked is not None
        and asked <= limit_mps + SAME_LIMIT_MPS
        and law_mps is not None
        and same_limit(law_mps, limit_mps)
    )


def _needs_mps2(record: Record, told_s: float, begun: Truth) -> float:
    heard = record.truth_at(told_s)
    left_s = begun.time_s - told_s - REACTS_S
    if heard is None or begun.law_limit_mps is None or left_s <= 0.0:
        return float("inf")
    return max(heard.speed_mps - begun.law_limit_mps, 0.0) / left_s
