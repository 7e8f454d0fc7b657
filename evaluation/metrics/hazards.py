"""True hazards and the words for them: response time, time to collision at first escalation, hazards never told."""

import math
from collections.abc import Iterator, Mapping
from typing import NamedTuple

from evaluation.metrics.conflicts import conflict_s, gap_m, median_stop_m, person_ahead, ttc_s
from evaluation.metrics.record import At, Record
from proto.decision import Advisory
from proto.truth import TrueHazard, Truth
from services.simulator.driver import ADVICE_HOLDS_S, WARNING_HOLDS_S

ESCALATES = ("warning", "alarm")
_LEAD = frozenset({"closing_lead", "slow_traffic", "lead"})
_PERSON = frozenset({"pedestrian", "person"})
WORDS: Mapping[str, frozenset[str]] = {
    "pedestrian": _PERSON,
    "lead_brakes": _LEAD,
    "stopped_lead": _LEAD,
    "congestion_tail": _LEAD,
    "cut_in": _LEAD,
    "stop_line": frozenset({"red_light", "stop_sign", "stop"}),
    "priority": frozenset({"priority", "give_way", "right_of_way", "yield"}) | _LEAD,
    "school_zone": frozenset({"limit", "ahead", "overspeed", "school", "children"}),
    "deep_water": frozenset({"friction", "deep_water", "low_friction"}),
}
"""A true hazard's kind, and the hazards or topics of messages that name it. Another kind is named by its own name alone."""
OF_SOMEBODY_AHEAD = frozenset(kind for kind, words in WORDS.items() if words == _LEAD)


SLOWER = frozenset({"deep_water", "school_zone"})
"""Hazards that call for less speed and no stop: a word that asks for it is in time as long as they are on."""


class Episode(NamedTuple):
    """A hazard from its onset to when it was over."""

    kind: str
    onset_s: float
    over_s: float


class Answer(NamedTuple):
    """What was said about a hazard. None: nothing was, or too late, or nobody closed in."""

    episode: Episode
    response_s: float | None
    """Onset to the first effective warning or intervention."""
    ttc_s: float | None
    """At the first escalation."""


def episodes(record: Record) -> tuple[Episode, ...]:
    """All hazards of a run; the same kind and onset is the same hazard."""
    found: dict[tuple[str, float], float] = {}
    for truth in record.truths:
        for hazard in on_now(truth):
            found[hazard.kind, hazard.onset_s] = truth.time_s
    return tuple(Episode(kind, onset_s, over_s) for (kind, onset_s), over_s in sorted(found.items()))


def on_now(truth: Truth) -> tuple[TrueHazard, ...]:
    """The hazards that are on; from a truth that tells but the oldest, that one."""
    if truth.hazards or not truth.hazard or truth.hazard_onset_s is None:
        return truth.hazards
    return (TrueHazard(kind=truth.hazard, onset_s=truth.hazard_onset_s),)


def answers(record: Record) -> tuple[Answer, ...]:
    """What was said about each hazard."""
    return tuple(_answer(record, episode) for episode in episodes(record))


def names(advisory: Advisory, kind: str) -> bool:
    """Whether a message is about a hazard of that kind."""
    return bool({advisory.hazard, advisory.topic} & WORDS.get(kind, frozenset({kind})))


def _answer(record: Record, episode: Episode) -> Answer:
    about = [each for each in record.spoken if _in_time(each, episode) and names(each.message, episode.kind)]
    effective = (each for each in about if _effective(record, each, episode.kind))
    first = next(effective, None)
    return Answer(
        episode,
        max(0.0, first.time_s - episode.onset_s) if first is not None else None,
        next(_escalation_ttcs(record, about, episode.kind), None),
    )


def _in_time(said: At[Advisory], episode: Episode) -> bool:
    """While the hazard is on, or so shortly before that the simulated driver still keeps to what was said."""
    warns = said.message.hazard or said.message.urgency in ESCALATES
    # Of limits many are told: long before a school they are about another place.
    holds_s = WARNING_HOLDS_S if warns or episode.kind in SLOWER else ADVICE_HOLDS_S
    return episode.onset_s - holds_s <= said.time_s <= episode.over_s


def _effective(record: Record, said: At[Advisory], kind: str) -> bool:
    """An intervention, or a word early enough for the median driver: he reacts, brakes as the grip allows, and it holds.

    Where the truth tells no distance, any word while the hazard is on counts.
    """
    truth = record.truth_at(said.time_s)
    if truth is None or said.message.kind == "ACT":
        return truth is not None
    if kind in SLOWER:
        asked = [mps for mps in (said.message.target_mps, said.message.ahead_mps) if mps is not None]
        return min(asked, default=math.inf) < truth.speed_mps and (kind != "school_zone" or _of_school(truth, said))
    gap, closing = distance(truth, kind)
    if gap is None or closing <= 0.0:
        return True
    return median_stop_m(closing, truth) <= gap


def _of_school(truth: Truth, said: At[Advisory]) -> bool:
    """A limit that is told before the school is another one's; the school's own is `ahead` until one is there."""
    to_school = next((each.distance_m for each in on_now(truth) if each.kind == "school_zone"), None)
    return said.message.topic not in ("limit", "overspeed") or (to_school is not None and to_school <= 0.0)


def _escalation_ttcs(record: Record, about: list[At[Advisory]], kind: str) -> Iterator[float | None]:
    """Times to collision at the escalations, the first one first; the first counts even if nobody closed in."""
    for each in about:
        if each.message.kind == "ACT" or (each.message.urgency in ESCALATES and each.message.hazard):
            truth = record.truth_at(each.time_s)
            yield conflict_s(ttc_s(*distance(truth, kind))) if truth is not None else None


def distance(truth: Truth, kind: str) -> tuple[float | None, float]:
    """(gap in m, closing speed in m/s) to the hazard; a gap of None: the truth does not tell it."""
    told = next((each.distance_m for each in on_now(truth) if each.kind == kind), None)
    if kind in OF_SOMEBODY_AHEAD:
        gap = truth.gap_m if truth.gap_m is not None else told
        return gap, truth.closing_mps if truth.closing_mps is not None else truth.speed_mps
    person = person_ahead(truth) if kind == "pedestrian" else None
    if person is not None:
        return gap_m(person), -person.vx_mps
    return told, truth.speed_mps
