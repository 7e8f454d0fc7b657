"""How near it came: time to collision, post-encroachment time, near-collisions, collisions, headway, true RSS."""

import math
from bisect import bisect_left
from collections.abc import Iterator
from statistics import median
from typing import NamedTuple

from domain import rss
from domain.hearing import ACT_PAUSE_S
from evaluation.metrics.record import Record
from evaluation.metrics.spans import Span, spans
from proto.truth import TrueActor, Truth
from services.simulator.driver.profile import MEDIAN_REACTION_S

EGO_LENGTH_M, EGO_WIDTH_M = 4.6, 1.82
NEAR_TTC_S, NEAR_PET_S = 1.5, 1.0
"""A near-collision: van der Horst and Kraay 1986 (DOCTOR) call an encounter critical below these; SSAM (FHWA-HRT-08-051)
has the same 1.5 s for time to collision."""
CLOSING_MPS = 0.1
"""Below this closing speed there is no time to collision."""
CONFLICT_WITHIN_S = 20.0
"""Ours: a road user that is met later than this is not closing in. At 0.1 m/s a steady lead would be minutes away, and would make up
the mean."""
APART_S = 2.0
"""Two moments of conflict with one road user that lie nearer to each other are one near-collision."""
ACROSS_MPS = 1.0
"""Ours: slower than this across, a vehicle wavers in its lane."""
BEHIND_M = 50.0
"""Ours: what happens farther behind the ego is no encounter with it."""
FOLLOWS_WITHIN_S, FOLLOWS_FROM_MPS = 4.0, 5.0
"""Ours: farther behind, or slower, a car does not follow; the 4 s are about what Vogel 2003 parts following by."""
SHORT_HEADWAY_S = 1.0
RESPONSE_S, ACCEL_MAX_MPS2, LEAD_BRAKE_MPS2 = 0.7, 0.5, 8.0
"""Of true RSS: the paper's t_r; a cruising driver's acceleration (ours); what a lead may brake (ad-rss-lib). They are the
values of the calibrated profile as first shipped, written down here, so that no calibration moves what it is judged by."""
ONCOMING_MPS = 0.01
"""A lead's speed is told as a difference: what by rounding comes backwards stands, and does not drive at the ego."""
SEES_LATE_S = 0.3
"""An intervention counts as true where RSS is violated within this time of its start: about three pictures."""
ANSWERED_BEFORE_S = 1.0
"""Ours: an intervention that ended so shortly before a violation was on it."""


def ttc_s(gap_m: float | None, closing_mps: float | None) -> float | None:
    """The paper's time to collision, distance over closing speed; `None`: no road user is there or closes in."""
    if gap_m is None or closing_mps is None or closing_mps <= CLOSING_MPS:
        return None
    return max(0.0, gap_m) / closing_mps


def conflict_s(time_s: float | None) -> float | None:
    """A time to collision that means one."""
    return time_s if time_s is not None and time_s <= CONFLICT_WITHIN_S else None


def gap_m(actor: TrueActor) -> float:
    """Bumper to bumper, along the ego's axis."""
    return actor.x_m - (actor.length_m + EGO_LENGTH_M) / 2.0


def person_ahead(truth: Truth) -> TrueActor | None:
    """The nearest person ahead who is in the ego's path."""
    ahead = (a for a in truth.actors if a.kind == "pedestrian" and a.in_ego_path and a.x_m > 0.0)
    return min(ahead, key=lambda each: each.x_m, default=None)


def nearest_ttc_s(truth: Truth) -> float | None:
    """The shortest time to collision with a road user in the ego's path."""
    person = person_ahead(truth)
    found = (
        ttc_s(truth.gap_m, truth.closing_mps),
        ttc_s(gap_m(person), -person.vx_mps) if person is not None else None,
    )
    return min((each for each in found if each is not None), default=None)


def nearest_ttc_at(record: Record, time_s: float) -> float | None:
    """The same at an instant of the run, where it is no longer than a conflict."""
    truth = record.truth_at(time_s)
    return conflict_s(nearest_ttc_s(truth)) if truth is not None else None


def interventions(record: Record) -> tuple[Span, ...]:
    """Stretches in which the arbiter braked; an ACT that was withheld does not count."""
    acts = ((d.time_s, d.message.kind == "ACT" and not d.message.act_withheld) for d in record.decisions)
    return spans(acts, ACT_PAUSE_S)


def is_false(record: Record, intervention: Span) -> bool:
    """Whether truth shows no RSS violation about the start of an intervention."""
    start = intervention.from_s
    return not any(violates_rss(truth) for truth in record.truths_between(start - SEES_LATE_S, start + SEES_LATE_S))


def rss_violations(record: Record) -> tuple[Span, ...]:
    """Stretches in which truth violates RSS."""
    return spans(((truth.time_s, violates_rss(truth)) for truth in record.truths), APART_S)


def rss_unanswered(record: Record) -> tuple[Span, ...]:
    """Those in which, and shortly before which, no intervention was under way."""
    braked = interventions(record)
    return tuple(
        span for span in rss_violations(record) if not any(span.overlaps(each, ANSWERED_BEFORE_S) for each in braked)
    )


def violates_rss(truth: Truth, speed_mps: float | None = None) -> bool:
    """Whether the true gap to the lead, or to a person in the path, is below the RSS distance at the true friction.

    At the ego's own speed, or at the one that is given.
    """
    ego = rss.Longitudinal(
        rho_s=RESPONSE_S,
        accel_max_mps2=ACCEL_MAX_MPS2,
        brake_min_mps2=braking_mps2(truth),
    )
    speed, person = truth.speed_mps if speed_mps is None else speed_mps, person_ahead(truth)
    if truth.gap_m is not None and truth.closing_mps is not None:
        lead_mps = truth.speed_mps - truth.closing_mps
        least = (
            rss.same_direction_m(speed, max(lead_mps, 0.0), ego, LEAD_BRAKE_MPS2)
            if lead_mps > -ONCOMING_MPS
            else rss.opposite_direction_m(speed, -lead_mps, ego, ego)
        )
        if truth.gap_m < least:
            return True
    return person is not None and gap_m(person) < rss.stopping_distance_m(speed, ego)


def braking_mps2(truth: Truth) -> float:
    """The deceleration that true grip and brakes allow."""
    return truth.mu * rss.GRAVITY_MPS2 * truth.brake_share


def median_stop_m(speed_mps: float, truth: Truth) -> float:
    """The median driver's way to a halt: the driver reacts, then brakes as grip and car allow."""
    driver = rss.Longitudinal(rho_s=MEDIAN_REACTION_S, accel_max_mps2=0.0, brake_min_mps2=braking_mps2(truth))
    return rss.stopping_distance_m(speed_mps, driver)


def collisions(record: Record) -> int:
    """How often the ego began to touch a road user, at most once: truth's `collision` stays on for the rest of the run."""
    return len(spans((truth.time_s, truth.collision) for truth in record.truths)[:1])


def contact_speed_mps(record: Record) -> tuple[float, ...]:
    """The ego's speed in the truth before it began to touch a road user."""
    pairs = zip(record.truths, record.truths[1:], strict=False)
    return tuple(before.speed_mps for before, after in pairs if after.collision and not before.collision)[:1]


def near_collisions(record: Record) -> tuple[int, int]:
    """How many by time to collision, and how many more by post-encroachment time alone; a collision does not count."""
    by_ttc = spans(((t.time_s, _near(t)) for t in record.truths), APART_S)
    struck = next((truth.time_s for truth in record.truths if truth.collision), math.inf)
    by_ttc = tuple(span for span in by_ttc if span.to_s < struck - APART_S)
    by_pet = [
        at_s
        for at_s, pet in encroachments(record)
        if pet < NEAR_PET_S and not any(span.overlaps(Span(at_s, at_s), APART_S, APART_S) for span in by_ttc)
    ]
    return len(by_ttc), len([at_s for at_s in by_pet if at_s < struck])


def _near(truth: Truth) -> bool:
    time = nearest_ttc_s(truth)
    return time is not None and time < NEAR_TTC_S


def encroachments(record: Record) -> Iterator[tuple[float, float]]:
    """(instant, post-encroachment time) of each road user that crossed the ego's path, ahead of the ego or behind it."""
    yield from _ahead(record)
    yield from _behind(record)


def _ahead(record: Record) -> Iterator[tuple[float, float]]:
    """The road user went first: the place is where it was last in the path. The time is from then until the ego's front is there."""
    inside: dict[int, tuple[float, float]] = {}
    for truth in record.truths:
        crossing = {actor.actor_id: actor for actor in truth.actors if crosses(actor, truth)}
        for number, (left_s, place_m) in list(inside.items()):
            actor = crossing.get(number)
            if actor is None or not actor.in_ego_path or actor.x_m <= 0.0:
                del inside[number]
                reached_s = next((t.time_s for t in record.truths if t.distance_m >= place_m), None)
                if reached_s is not None and reached_s >= left_s:
                    yield left_s, reached_s - left_s
        for actor in crossing.values():
            if actor.in_ego_path and actor.x_m > 0.0:
                inside[actor.actor_id] = truth.time_s, truth.distance_m + max(0.0, actor.x_m - EGO_LENGTH_M / 2.0)


def _behind(record: Record) -> Iterator[tuple[float, float]]:
    """The ego went first: the place is where the road user first comes into the ego's path.

    The time is from when the ego's rear left that place.
    """
    ways_m = [truth.distance_m for truth in record.truths]
    beside: set[int] = set()
    for truth in record.truths:
        for actor in (each for each in truth.actors if abs(each.x_m) < BEHIND_M):
            met = _met(actor, truth, _reached(record, ways_m, truth.distance_m + actor.x_m))
            if met is None:
                continue
            if met.inside and actor.actor_id in beside and actor.x_m <= -EGO_LENGTH_M / 2.0:
                left_s = _reached(record, ways_m, met.place_m + EGO_LENGTH_M / 2.0).time_s
                yield left_s, truth.time_s - left_s
            (beside.discard if met.inside else beside.add)(actor.actor_id)


def _reached(record: Record, ways_m: list[float], way_m: float) -> Truth:
    """When the ego's middle came so far, or nearest to it."""
    return record.truths[min(bisect_left(ways_m, way_m), len(ways_m) - 1)]


class _Met(NamedTuple):
    """Where on the ego's way a road user is that crosses it, and whether the road user is in the ego's path there."""

    place_m: float
    inside: bool


def _met(actor: TrueActor, truth: Truth, there: Truth) -> _Met | None:
    """The place as seen from where the ego was `there`, as the ego may have turned since; None: the road user does not cross."""
    turned_rad = math.remainder((truth.heading_rad or 0.0) - (there.heading_rad or 0.0), math.tau)
    c, s, way_m = math.cos(turned_rad), math.sin(turned_rad), truth.distance_m - there.distance_m
    vx_mps, vy_mps = actor.vx_mps + truth.speed_mps, actor.vy_mps
    if not _across(actor.kind, c * vx_mps - s * vy_mps, s * vx_mps + c * vy_mps):
        return None
    along_m = way_m * math.cos(turned_rad / 2.0) + c * actor.x_m - s * actor.y_m
    aside_m = way_m * math.sin(turned_rad / 2.0) + s * actor.x_m + c * actor.y_m
    reach_m = actor.width_m if actor.kind == "pedestrian" else actor.length_m
    return _Met(there.distance_m + along_m, abs(aside_m) < (EGO_WIDTH_M + reach_m) / 2.0)


def crosses(actor: TrueActor, truth: Truth) -> bool:
    """A person, or a vehicle that drives across the ego's way rather than along it."""
    return _across(actor.kind, actor.vx_mps + truth.speed_mps, actor.vy_mps)


def _across(kind: str, along_mps: float, across_mps: float) -> bool:
    return kind == "pedestrian" or abs(across_mps) > max(abs(along_mps), ACROSS_MPS)


def headways_s(record: Record) -> list[float]:
    """Gap over speed at each instant in which the ego follows a vehicle."""
    return [
        truth.gap_m / truth.speed_mps
        for truth in record.truths
        if truth.gap_m is not None
        and truth.speed_mps >= FOLLOWS_FROM_MPS
        and truth.gap_m / truth.speed_mps <= FOLLOWS_WITHIN_S
    ]


def headway_median_s(record: Record) -> float | None:
    """Median headway while following."""
    found = headways_s(record)
    return median(found) if found else None


def short_headway_share(record: Record) -> float | None:
    """Share of the time of following in which the headway is below 1 s."""
    found = headways_s(record)
    return sum(each < SHORT_HEADWAY_S for each in found) / len(found) if found else None
