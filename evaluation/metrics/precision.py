"""Precision by kind of message: how many were true, and how many were needed, by truth and by what came of it.

True: truth has what the message names, about when it was said. Needed: true, and something depended on it, whatever the driver then
did. All bounds are ours. Matters of the reading, of the services and of third parties are not judged, for truth has no say in them.
"""

from collections.abc import Callable, Mapping, Sequence
from typing import NamedTuple

from evaluation.metrics.conflicts import nearest_ttc_s, violates_rss
from evaluation.metrics.hazards import on_now
from evaluation.metrics.law import TYPES, same_limit
from evaluation.metrics.record import At, Record
from evaluation.metrics.speech import CAUSE_MU, FOUNDED_S, founded
from evaluation.metrics.truth_events import TOLERANCES, changes, foreign_ahead
from proto.decision import Advisory
from proto.truth import Truth
from services.simulator.truth.hazard_words import names

SOON_S, LATER_S = 5.0, 10.0
"""A conflict comes so soon after a warning; a line, a limit or water so soon after advice."""
AHEAD_S = 30.0
"""A limit that is announced begins within this time."""
SHOWN_S = 2.0
"""A limit that is told is in force within this time, before or after."""
NEAR_TTC_S, BRAKES_MPS2, ICE_MU, STANDS_MPS = 4.0, 2.0, 0.4, 1.0
PLACE_M = 150.0
"""A place to give way at is so near."""


class Verdict(NamedTuple):
    """On one message."""

    right: bool
    needed: bool


class Precision(NamedTuple):
    """On all messages of a topic."""

    judged: int
    right: int
    needed: int


def precision(record: Record) -> dict[str, Precision]:
    """By topic; topics that are not judged are left out."""
    found: dict[str, list[Verdict]] = {}
    for each in record.spoken if record.truths else ():
        judge = _JUDGES.get(each.message.topic)
        verdict = judge(record, each) if judge is not None else None
        if verdict is not None:
            found.setdefault(each.message.topic, []).append(verdict)
    return {
        topic: Precision(
            len(verdicts), sum(each.right for each in verdicts), sum(each.right and each.needed for each in verdicts)
        )
        for topic, verdicts in sorted(found.items())
    }


def _about(record: Record, said: At[Advisory], before_s: float, after_s: float) -> Sequence[Truth]:
    return record.truths_between(said.time_s - before_s, said.time_s + after_s)


def _road_user(record: Record, said: At[Advisory]) -> Verdict:
    then = _about(record, said, 0.0, SOON_S)
    met = any(
        any(names(said.message, each.kind) for each in on_now(truth))
        or violates_rss(truth)
        or ((ttc_s := nearest_ttc_s(truth)) is not None and ttc_s < NEAR_TTC_S)
        for truth in then
    )
    right = any(founded(truth, said.message) for truth in _about(record, said, FOUNDED_S, FOUNDED_S))
    return Verdict(right, met or _brakes(then))


def _brakes(then: Sequence[Truth]) -> bool:
    return any(truth.acceleration_mps2 <= -BRAKES_MPS2 for truth in then)


def _stop(record: Record, said: At[Advisory]) -> Verdict:
    now, then = _about(record, said, FOUNDED_S, FOUNDED_S), _about(record, said, 0.0, LATER_S)
    shown = said.message.picture
    if shown is not None and shown.face == "green_light":
        return Verdict(any(t.light == "green" for t in now), any(t.speed_mps < STANDS_MPS for t in now))
    stops = any(t.stop_kind in ("red_light", "stop_sign") or t.light in ("red", "red_amber", "amber") for t in then)
    run = any(TYPES.get(t.infraction) == "failure_to_stop" for t in then)
    return Verdict(stops or run, run or _brakes(then) or any(t.speed_mps < STANDS_MPS for t in then))


def _give_way(record: Record, said: At[Advisory]) -> Verdict:
    now, then = _about(record, said, FOUNDED_S, FOUNDED_S), _about(record, said, 0.0, LATER_S)
    comes = any(t.stop_kind == "yield" or any(each.kind == "priority" for each in on_now(t)) for t in then)
    place = any(
        "yield" in str(sign["code"]).split("+") and 0.0 < float(sign["x_m"]) < PLACE_M for t in now for sign in t.signs
    )
    return Verdict(comes or place, comes)


def _limit(record: Record, said: At[Advisory]) -> Verdict | None:
    message = said.message
    if message.ahead_mps is not None:
        return _ahead(record, said)
    told_mps = message.told_limit_mps
    if told_mps is None:
        told_mps = message.legal_limit.mps if message.legal_limit is not None else message.asked_mps
    if told_mps is None:
        return None
    right = any(same_limit(told_mps, t.law_limit_mps) for t in _about(record, said, SHOWN_S, SHOWN_S))
    return Verdict(right, any(t.speed_mps > told_mps for t in _about(record, said, 0.0, LATER_S)))


def _ahead(record: Record, said: At[Advisory]) -> Verdict | None:
    ahead_mps, now = said.message.ahead_mps, record.truth_at(said.time_s)
    if ahead_mps is None or now is None:
        return None
    right = any(same_limit(ahead_mps, t.law_limit_mps) for t in _about(record, said, 0.0, AHEAD_S))
    return Verdict(right, now.speed_mps > ahead_mps)


def _border(record: Record, said: At[Advisory]) -> Verdict:
    before_s, after_s = TOLERANCES["jurisdiction_change"]
    at = changes([(t.time_s, t.jurisdiction) for t in record.truths])
    right = any(-before_s <= said.time_s - each <= after_s for each in at)
    return Verdict(right, right)


def _friction(record: Record, said: At[Advisory]) -> Verdict:
    then = _about(record, said, FOUNDED_S, LATER_S)
    met = any(each.kind == "deep_water" for t in then for each in on_now(t))
    return Verdict(met or any(t.mu < CAUSE_MU for t in then), met or any(t.mu < ICE_MU for t in then) or _brakes(then))


def _vehicle(record: Record, said: At[Advisory]) -> Verdict | None:
    now = record.truth_at(said.time_s)
    return None if now is None or now.faults is None else Verdict(bool(now.faults), bool(now.faults))


def _foreign(record: Record, said: At[Advisory]) -> Verdict:
    right = any(foreign_ahead(record, t) for t in _about(record, said, SHOWN_S, FOUNDED_S))
    return Verdict(right, right)


_JUDGES: Mapping[str, Callable[[Record, At[Advisory]], Verdict | None]] = {
    "person": _road_user,
    "lead": _road_user,
    "stop": _stop,
    "give_way": _give_way,
    "limit": _limit,
    "ahead": _ahead,
    "border": _border,
    "friction": _friction,
    "vehicle": _vehicle,
    "foreign": _foreign,
}
TOPICS = tuple(_JUDGES)
