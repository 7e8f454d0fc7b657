"""Infractions, overspeed, and time under a wrong limit: from truth and the law in force."""

import math
from collections.abc import Callable, Iterator, Mapping

from evaluation.metrics.record import Record
from proto.decision import Advisory
from proto.truth import Truth

TYPES: Mapping[str, str] = {
    "red_light": "failure_to_stop",
    "no_stop": "failure_to_stop",
    "wrong_yield": "wrong_yielding",
    "illegal_turn": "illegal_turn",
}
"""What the truth calls an infraction of lines and priority, and the paper's type of it."""
TOLERANCE_MPS, SPEEDING_AFTER_S = 3 / 3.6, 1.0
"""Ours: more than this above the limit, for at least this long, is a speeding."""
KINDS = ("speeding", "failure_to_stop", "wrong_yielding", "illegal_turn")
SAME_LIMIT_MPS = 0.3
"""Limits that differ by less are one: a conversion from mph is rounded by up to 0.2 m/s."""


def infractions(record: Record) -> dict[str, int]:
    """Infractions by the paper's types. Speeding counts an episode once, however long it lasts."""
    counts = dict.fromkeys(KINDS, 0)
    counts["speeding"] = speeding_episodes(record)
    for truth in record.truths:
        if truth.infraction in TYPES:
            counts[TYPES[truth.infraction]] += 1
    return counts


def speeding_episodes(record: Record) -> int:
    """Times in which the true limit was exceeded by more than 3 km/h for 1 s or more.

    An episode ends where the speed is back at the limit itself, so that wavering about the tolerance is one episode.
    """
    count, over_s, on, before_s = 0, 0.0, False, 0.0
    for truth in record.truths:
        limit, speed = truth.law_limit_mps, truth.speed_mps
        over_s = over_s + truth.time_s - before_s if limit is not None and speed > limit + TOLERANCE_MPS else 0.0
        before_s = truth.time_s
        on = on and limit is not None and speed > limit
        if not on and over_s >= SPEEDING_AFTER_S - 1e-6:
            count, on = count + 1, True
    return count


def overspeed_true_pct(record: Record) -> float | None:
    """Mean over time of the share by which the true limit is exceeded; 0 below it. Percent; None: no limit anywhere."""
    return _mean(
        100.0 * max(0.0, truth.speed_mps / truth.law_limit_mps - 1.0) for truth in record.truths if truth.law_limit_mps
    )


def overspeed_inferred_pct(record: Record) -> float | None:
    """The paper's overspeed: the same against the limit that the system has inferred. Ticks without one do not count."""
    return _mean(
        100.0 * max(0.0, truth.speed_mps / limit - 1.0)
        for advisory, truth in _ticks(record)
        if (limit := inferred_mps(advisory)) is not None
    )


def inferred_mps(advisory: Advisory) -> float | None:
    """The limit that the system holds to be in force; an advised speed is not a limit."""
    limit = advisory.legal_limit
    return None if limit is None or limit.advisory or limit.mps <= 0.0 else limit.mps


def wrong_limit_s(record: Record) -> float:
    """Seconds in which the system held another limit than the true one, or a limit where no limit is in force."""
    return _held(record, lambda held, true: held is not None and not same_limit(held, true))


def target_above_law_s(record: Record) -> float:
    """Seconds in which the speed that the system aims at is above the true limit."""
    return _seconds(
        record,
        lambda said, true: said.target_mps is not None and true is not None and said.target_mps > true + SAME_LIMIT_MPS,
    )


def unknown_limit_s(record: Record) -> float:
    """Seconds in which there was a limit and the system knew of none."""
    return _held(record, lambda held, true: held is None and true is not None)


def _held(record: Record, counts: Callable[[float | None, float | None], bool]) -> float:
    return _seconds(record, lambda said, true: counts(inferred_mps(said), true))


def _seconds(record: Record, counts: Callable[[Advisory, float | None], bool]) -> float:
    if not record.truths:
        return 0.0
    last_s = record.truths[-1].time_s
    ends_s = [*(each.time_s for each in record.advisories[1:]), last_s]
    return math.fsum(
        max(0.0, min(end_s, last_s) - each.time_s)
        for each, end_s in zip(record.advisories, ends_s, strict=False)
        if (truth := record.truth_at(each.time_s)) is not None and counts(each.message, truth.law_limit_mps)
    )


def same_limit(held_mps: float | None, true_mps: float | None) -> bool:
    """Whether two limits are one, or neither is there."""
    if held_mps is None or true_mps is None:
        return held_mps is true_mps
    return abs(held_mps - true_mps) <= SAME_LIMIT_MPS


def _ticks(record: Record) -> Iterator[tuple[Advisory, Truth]]:
    for each in record.advisories:
        truth = record.truth_at(each.time_s)
        if truth is not None:
            yield each.message, truth


def _mean(values: Iterator[float]) -> float | None:
    found = list(values)
    return math.fsum(found) / len(found) if found else None
