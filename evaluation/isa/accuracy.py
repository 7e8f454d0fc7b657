"""How often the right limit is shown, and how late: by distance, and by change of the limit. Pure."""

from collections.abc import Iterator
from itertools import pairwise

import msgspec

from evaluation.metrics.law import inferred_mps, same_limit
from evaluation.metrics.record import Record
from proto.truth import Truth

SHOWN_WITHIN_S = 2.0
"""After its sign is passed (Regulation (EU) 2021/1958, Annex I, 3.4.2.2.1)."""
WET_MM_H = 0.1


class Accuracy(msgspec.Struct, frozen=True, kw_only=True):
    """What was shown, in one run or in several."""

    metres: dict[str, float] = {}
    """Driven, by group."""
    right_m: dict[str, float] = {}
    """Of them, with the right limit shown."""
    changes: int = 0
    """Changes of the limit that lasted for at least 2 s."""
    changes_right: int = 0
    """Of them, those shown 2 s later."""
    delays_s: tuple[float, ...] = ()
    """From a change to its limit, of those that were shown before the next one."""


def accuracy(record: Record) -> Accuracy:
    """Of one run."""
    metres: dict[str, float] = {}
    right_m: dict[str, float] = {}
    with_shown = list(shown(record))
    for (before, _), (now, held) in pairwise(with_shown):
        way_m = max(0.0, now.distance_m - before.distance_m)
        for group in groups(now):
            metres[group] = metres.get(group, 0.0) + way_m
            right_m[group] = right_m.get(group, 0.0) + way_m * same_limit(held, now.law_limit_mps)
    delays = [_delay_s(with_shown, at, until) for at, until in _changes(with_shown)]
    return Accuracy(
        metres=metres,
        right_m=right_m,
        changes=len(delays),
        changes_right=sum(each is not None and each <= SHOWN_WITHIN_S for each in delays),
        delays_s=tuple(each for each in delays if each is not None),
    )


def groups(truth: Truth) -> Iterator[str]:
    """The groups that an instant counts for; the road by its limit, for truth tells no kind of road."""
    yield "all"
    limit = truth.law_limit_mps
    yield "above 100 km/h" if limit is None or limit > 28.0 else "up to 50 km/h" if limit < 14.0 else "51 to 100 km/h"
    yield "dark" if truth.dark else "light"
    yield "rain" if (truth.rain_mm_h or 0.0) > WET_MM_H else "no rain"


def shown(record: Record) -> Iterator[tuple[Truth, float | None]]:
    """Each truth with the limit that is shown then."""
    advisories = iter(record.advisories)
    upcoming, held = next(advisories, None), None
    for truth in record.truths:
        while upcoming is not None and upcoming.time_s <= truth.time_s + 1e-6:
            held, upcoming = inferred_mps(upcoming.message), next(advisories, None)
        yield truth, held


def _changes(shown: list[tuple[Truth, float | None]]) -> Iterator[tuple[float, float]]:
    """When the true limit changed, and when it changed next; those that lasted for 2 s."""
    at = [
        now.time_s
        for (before, _), (now, _) in pairwise(shown)
        if not same_limit(before.law_limit_mps, now.law_limit_mps)
    ]
    end_s = shown[-1][0].time_s if shown else 0.0
    for this, following in pairwise((*at, end_s)):
        if following - this >= SHOWN_WITHIN_S:
            yield this, following


def _delay_s(shown: list[tuple[Truth, float | None]], at_s: float, until_s: float) -> float | None:
    """From a change to the first instant with its limit; `None`: the next change came before."""
    within = (each for each in shown if at_s <= each[0].time_s < until_s)
    return next((truth.time_s - at_s for truth, held in within if same_limit(held, truth.law_limit_mps)), None)
