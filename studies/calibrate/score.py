"""What a candidate is judged by: counts of a drive decided again, against its truth; parts with weights; one number."""

import math
from collections.abc import Iterable, Mapping
from typing import NamedTuple

import msgspec

from evaluation.metrics import Record
from evaluation.metrics.conflicts import (
    APART_S,
    NEAR_TTC_S,
    interventions,
    is_false,
    nearest_ttc_s,
    violates_rss,
)
from evaluation.metrics.hazards import answers, on_now
from evaluation.metrics.spans import spans
from evaluation.metrics.speech import CAUSE_TTC_S, nags
from evaluation.metrics.understanding import detected
from proto.truth import Truth

LATEST_S = 5.0
"""A hazard that was never answered counts as answered so late."""
ABOUT_S = 1.0
"""An alarm is founded where truth shows a cause within this time of it."""
BEFORE_S = 3.0
"""An intervention belongs to a near-collision if it began so shortly before."""
UNFIT = 1e3
"""Added for a candidate that the design refuses."""


class Counts(msgspec.Struct, frozen=True, kw_only=True):
    """Of one drive or of many: all can be added."""

    km: float = 0.0
    hazards: int = 0
    missed: int = 0
    response_s: float = 0.0
    """Summed over hazards."""
    interventions: int = 0
    false_interventions: int = 0
    unbraked: int = 0
    """True near-collisions by time to collision, RSS being violated, before which nothing braked."""
    false_alarms: int = 0
    nags: int = 0
    messages: int = 0
    hits: int = 0
    misses: int = 0
    false_events: int = 0


class Part(NamedTuple):
    """One part of the objective."""

    name: str
    unit: str
    weight: float
    reason: str


PARTS: tuple[Part, ...] = (
    Part("missed_hazards", "share", 20.0, "the worst that advice can do; one in twenty counts as one false intervention"),
    Part("response", "s", 4.0, "an early word is what the assistant is for"),
    Part("unbraked", "/10 km", 5.0, "as bad as five false interventions: there the car has to brake"),
    Part("impact", "m/s", 4.0, "of the scripted approaches: keeps guards from switching ACT off, where drives have nothing to brake for"),
    Part("false_interventions", "/10 km", 1.0, "the unit of all weights: a braking that nothing calls for"),
    Part("false_alarms", "/10 km", 0.3, "startles, and costs trust"),
    Part("nags", "/10 km", 0.1, "a repeat without news"),
    Part("messages", "/10 km", 0.02, "attention; a message is rarely wrong by itself"),
    Part("events", "1 - F1", 10.0, "a tenth of F1 counts as one false intervention"),
)  # fmt: skip
"""The weights are ours: an order of harm, not a measurement. The profile's file and the report repeat them."""


def counts(record: Record) -> Counts:
    """Of one drive."""
    told = answers(record)
    braked = interventions(record)
    scores = detected(record).values()
    return Counts(
        km=record.truths[-1].distance_m / 1e3,
        hazards=len(told),
        missed=sum(each.at_s is None for each in told),
        response_s=math.fsum(LATEST_S if each.at_s is None else min(LATEST_S, each.response_s or 0.0) for each in told),
        interventions=len(braked),
        false_interventions=sum(is_false(record, each) for each in braked),
        unbraked=_unbraked(record),
        false_alarms=_false_alarms(record),
        nags=nags(record),
        messages=len(record.spoken),
        hits=sum(each.hit for each in scores),
        misses=sum(each.missed for each in scores),
        false_events=sum(each.false for each in scores),
    )


def pooled(each: Iterable[Counts]) -> Counts:
    """The sums."""
    rows = list(each)
    return Counts(**{name: sum(getattr(row, name) for row in rows) for name in Counts.__struct_fields__})


def parts(total: Counts, impact_mps: float) -> dict[str, float]:
    """The parts, in their units."""
    per_10_km = 10.0 / max(total.km, 1e-9)
    counted = 2 * total.hits + total.misses + total.false_events
    return {
        "missed_hazards": total.missed / max(1, total.hazards),
        "response": total.response_s / max(1, total.hazards),
        "unbraked": total.unbraked * per_10_km,
        "impact": impact_mps,
        "false_interventions": total.false_interventions * per_10_km,
        "false_alarms": total.false_alarms * per_10_km,
        "nags": total.nags * per_10_km,
        "messages": total.messages * per_10_km,
        "events": 1.0 - 2 * total.hits / counted if counted else 0.0,
    }


def objective(found: Mapping[str, float]) -> float:
    """The weighted sum; smaller is better."""
    return math.fsum(part.weight * found[part.name] for part in PARTS)


def _unbraked(record: Record) -> int:
    near = spans(((truth.time_s, _near(truth)) for truth in record.truths), APART_S)
    braked = [each.from_s for each in interventions(record)]
    return sum(not any(span.from_s - BEFORE_S <= at_s <= span.to_s for at_s in braked) for span in near)


def _near(truth: Truth) -> bool:
    time = nearest_ttc_s(truth)
    return time is not None and time < NEAR_TTC_S and violates_rss(truth)


def _false_alarms(record: Record) -> int:
    """Warnings of a road user ahead for which truth knows neither a hazard nor an approach nor too small a gap."""
    warned = [each for each in record.spoken if each.message.hazard in _SOMEBODY]
    return sum(
        not any(_cause(truth) for truth in record.truths_between(each.time_s - ABOUT_S, each.time_s + ABOUT_S))
        for each in warned
    )


_SOMEBODY = frozenset({"closing_lead", "pedestrian", "person", "lead"})


def _cause(truth: Truth) -> bool:
    time = nearest_ttc_s(truth)
    return bool(on_now(truth)) or (time is not None and time < CAUSE_TTC_S) or violates_rss(truth)
