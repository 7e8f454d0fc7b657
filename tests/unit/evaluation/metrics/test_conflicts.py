"""Time to collision, post-encroachment time, interventions against true RSS, headway: by hand."""

import math
from typing import Any

import msgspec
import pytest
from msgspec import structs

from evaluation.metrics import RATES, Record, conflicts, measure
from services.simulator.traffic.cars import EGO_BODY
from tests.unit.evaluation.metrics.logs import decided, hazard, person, steady, truths


def test_the_ego_is_the_simulators() -> None:
    assert (EGO_BODY.length_m, EGO_BODY.width_m) == (conflicts.EGO_LENGTH_M, conflicts.EGO_WIDTH_M)


def test_time_to_collision_is_distance_over_closing_speed_and_none_where_nobody_closes_in() -> None:
    assert conflicts.ttc_s(30.0, 10.0) == 3.0
    assert conflicts.ttc_s(30.0, 0.05) is None
    assert conflicts.ttc_s(30.0, -3.0) is None
    assert conflicts.ttc_s(None, 10.0) is None


def closing(gap_m: float, closing_mps: float, seconds: float) -> Record:
    """Closes in on a lead at a steady rate, then falls back."""

    def at(time_s: float) -> dict[str, Any]:
        nearer = time_s <= seconds
        gap = gap_m - closing_mps * min(time_s, seconds)
        return {"speed_mps": 15.0, "gap_m": gap, "closing_mps": closing_mps if nearer else -1.0}

    return Record(truths=truths(seconds + 5.0, at))


def test_a_near_collision_is_a_time_to_collision_below_one_and_a_half_seconds() -> None:
    # 30 m at 10 m/s: after 1.45 s 15.5 m (1.55 s), after 1.6 s 14 m (1.4 s)
    assert measure(closing(30.0, 10.0, 1.45)).near_collisions == 0
    assert measure(closing(30.0, 10.0, 1.6)).near_collisions == 1


def test_a_collision_is_no_near_collision() -> None:
    def at(time_s: float) -> dict[str, Any]:
        gap = max(0.0, 30.0 - 10.0 * time_s)
        return {"speed_mps": 15.0, "gap_m": gap, "closing_mps": 10.0, "collision": gap == 0.0}

    found = measure(Record(truths=truths(5.0, at)))
    assert (found.collisions, found.near_collisions) == (1, 0)


def crossing(leaves_s: float, place_m: float = 50.0) -> Record:
    """At 10 m/s; somebody stands in the path at a place of the front bumper's way, till a time, then beside it."""

    def at(time_s: float) -> dict[str, Any]:
        x_m = place_m + conflicts.EGO_LENGTH_M / 2 - 10.0 * time_s
        walker = person(x_m, 10.0, in_path=time_s <= leaves_s and x_m > 0.0)
        return {"speed_mps": 10.0, "actors": (walker,)}

    return Record(truths=truths(8.0, at))


def test_post_encroachment_time_is_from_leaving_the_path_to_the_egos_arrival_there() -> None:
    # the front is at 50 m after 5.0 s; who leaves at 4.2 s is missed by 0.8 s, who leaves at 3.0 s by 2.0 s
    assert [pet for _, pet in conflicts.encroachments(crossing(4.2))] == pytest.approx([0.8])
    assert [pet for _, pet in conflicts.encroachments(crossing(3.0))] == pytest.approx([2.0])


def test_a_vehicle_counts_where_it_crosses_and_not_where_it_leads() -> None:
    def record(across_mps: float) -> Record:
        def at(time_s: float) -> dict[str, Any]:
            x_m = 50.0 + conflicts.EGO_LENGTH_M / 2 - 10.0 * time_s
            car = person(x_m, 10.0, in_path=time_s <= 4.2)
            return {"speed_mps": 10.0, "actors": (structs.replace(car, kind="vehicle", vy_mps=across_mps),)}

        return Record(truths=truths(8.0, at))

    assert [pet for _, pet in conflicts.encroachments(record(6.0))] == pytest.approx([0.8])
    assert list(conflicts.encroachments(record(0.5))) == []


def crossed_behind(enters_s: float, radius_m: float = math.inf) -> Record:
    """At 10 m/s past a place 50 m on, and from there on round a bend to the left; a car comes across at 8 m/s from the right.

    It is in the ego's path as soon as its middle is (4.6 + 1.82) / 2 = 3.21 m beside it.
    """

    def at(time_s: float) -> dict[str, Any]:
        past_m = 10.0 * time_s - 50.0
        turned = max(0.0, past_m) / radius_m
        ahead_m, aside_m = (
            (radius_m * math.sin(turned), radius_m * (1.0 - math.cos(turned))) if turned else (past_m, 0.0)
        )
        x_m, y_m = -ahead_m, -3.21 + 8.0 * (time_s - enters_s) - aside_m
        c, s = math.cos(turned), math.sin(turned)
        body = structs.replace(
            person(c * x_m + s * y_m, in_path=False), kind="vehicle", length_m=4.6, width_m=1.82,
            y_m=c * y_m - s * x_m, vx_mps=s * 8.0 - 10.0, vy_mps=c * 8.0,
        )  # fmt: skip
        return {"speed_mps": 10.0, "heading_rad": turned, "actors": (body,)}

    return Record(truths=truths(9.0, at))


@pytest.mark.parametrize("radius_m", [math.inf, 40.0])
def test_who_crosses_behind_the_ego_encroaches_as_well(radius_m: float) -> None:
    # the rear is past the place at 5.23 s, told at 5.25 s; he comes there at 6.0 s, or at 6.5 s
    near, far = (crossed_behind(enters_s, radius_m) for enters_s in (5.98, 6.48))
    assert list(conflicts.encroachments(near)) == [pytest.approx((5.25, 0.75), abs=0.051)]
    assert list(conflicts.encroachments(far)) == [pytest.approx((5.25, 1.25), abs=0.051)]
    found, none = measure(near), measure(far)
    assert (found.near_collisions, found.near_collisions_pet, none.near_collisions) == (1, 1, 0)


def test_who_follows_through_a_bend_crosses_nothing() -> None:
    def at(time_s: float) -> dict[str, Any]:
        # a circle of 20 m at 10 m/s, he 20 m behind: turned by 1 rad against the ego, so across it by 8.4 m/s
        body = structs.replace(
            person(-20.0 * math.sin(1.0)), kind="vehicle", length_m=4.6, y_m=20.0 * (1.0 - math.cos(1.0)),
            vx_mps=10.0 * math.cos(1.0) - 10.0, vy_mps=-10.0 * math.sin(1.0),
        )  # fmt: skip
        return {"speed_mps": 10.0, "heading_rad": 0.5 * time_s, "actors": (body,)}

    record = Record(truths=truths(8.0, at))
    assert conflicts.crosses(record.truths[100].actors[0], record.truths[100])
    assert list(conflicts.encroachments(record)) == []


def test_near_collisions_by_post_encroachment_alone_are_told_apart() -> None:
    # Left at 4.2 s: the time to collision fell to 0.8 s before, so that it is one by that. Left at 3.0 s: none.
    by_ttc = measure(crossing(4.2))
    assert (by_ttc.near_collisions, by_ttc.near_collisions_pet) == (1, 0)
    assert measure(crossing(3.0)).near_collisions == 0

    def at(time_s: float) -> dict[str, Any]:
        # at 4 m/s till 2 s, then 12 m/s. He leaves the path at 2 s, 8.4 m before the front (2.1 s): 0.7 s at 12 m/s.
        driven_m = 4.0 * min(time_s, 2.0) + 12.0 * max(0.0, time_s - 2.0)
        x_m = 16.4 + conflicts.EGO_LENGTH_M / 2 + 0.2 - driven_m
        speed = 4.0 if time_s <= 2.0 else 12.0
        return {"speed_mps": speed, "actors": (person(x_m, speed, in_path=time_s <= 2.0 and x_m > 0.0),)}

    alone = measure(Record(truths=truths(4.0, at)))
    assert (alone.near_collisions, alone.near_collisions_pet) == (1, 1)


def braked(*acts: float, gap_m: float = 40.0, mu: float = 0.8, withheld: str = "") -> Record:
    truth = steady(10.0, gap_m=gap_m, closing_mps=5.0, mu=mu)
    return Record(truths=truth, decisions=tuple(decided(at, "ACT", withheld) for at in acts))


def test_ticks_of_one_braking_are_one_intervention() -> None:
    assert measure(braked(1.0, 1.1, 1.2, 1.5, 5.0)).interventions == 2
    assert measure(braked(1.0, 1.1, withheld="no grant")).interventions == 0


def test_an_intervention_is_false_where_the_true_gap_is_safe() -> None:
    # RSS at 20 m/s behind 15 m/s on mu 0.8: response 0.7 s at +0.5 m/s2: (20 + 20.35) / 2 * 0.7 = 14.12 m; braking from
    # 20.35 with 7.848: 26.38 m; the lead's way from 15 with 8: 14.06 m. Together 26.44 m.
    assert measure(braked(1.0, gap_m=26.0)).false_interventions == 0
    assert measure(braked(1.0, gap_m=27.0)).false_interventions == 1
    # on mu 0.4 braking takes 52.77 m: 52.83 m
    assert measure(braked(1.0, gap_m=52.0, mu=0.4)).false_interventions == 0
    assert measure(braked(1.0, gap_m=53.5, mu=0.4)).false_interventions == 1


def test_of_false_interventions_those_in_a_hazard_are_told_apart() -> None:
    # the gap is safe; a hazard is on from 2 to 4 s
    def at(time_s: float) -> dict[str, Any]:
        now = (hazard("cut_in", 2.0),) if 2.0 <= time_s <= 4.0 else ()
        return {"speed_mps": 20.0, "gap_m": 40.0, "closing_mps": 5.0, "hazards": now}

    acts = tuple(decided(time_s, "ACT") for time_s in (1.0, 3.0, 6.0))
    found = measure(Record(truths=truths(10.0, at), decisions=acts))
    assert (found.false_interventions, found.false_while_hazard) == (3, 1)
    # it began before the hazard
    early = tuple(decided(1.8 + 0.1 * tick, "ACT") for tick in range(5))
    assert measure(Record(truths=truths(10.0, at), decisions=early)).false_while_hazard == 0
    # a true one is none of them
    near = Record(truths=steady(5.0, gap_m=20.0, closing_mps=5.0, hazards=(hazard("cut_in", 0.5),)), decisions=acts[:1])
    assert (measure(near).false_interventions, measure(near).false_while_hazard) == (0, 0)


def too_near(*stretches: tuple[float, float], acts: tuple[float, ...] = (), withheld: str = "") -> Record:
    """26 m behind 15 m/s at 20 m/s, 0.44 m less than RSS asks for; outside of the stretches 27 m."""

    def at(time_s: float) -> dict[str, Any]:
        near = any(from_s <= time_s <= to_s for from_s, to_s in stretches)
        return {"speed_mps": 20.0, "gap_m": 26.0 if near else 27.0, "closing_mps": 5.0}

    return Record(truths=truths(20.0, at), decisions=tuple(decided(time_s, "ACT", withheld) for time_s in acts))


def violations(record: Record) -> tuple[int | None, int | None]:
    found = measure(record)
    return found.rss_violations, found.rss_unanswered


def test_true_rss_violations_are_counted_whether_anything_braked_or_not() -> None:
    assert violations(too_near()) == (0, 0)
    assert violations(too_near((2.0, 3.0), (10.0, 11.0))) == (2, 2)
    # two seconds apart are one, more are two
    assert violations(too_near((2.0, 3.0), (5.0, 6.0))) == (1, 1)
    assert violations(too_near((2.0, 3.0), (5.1, 6.0))) == (2, 2)
    # 2 in 20 s at 20 m/s: 0.4 km
    found = msgspec.to_builtins(measure(too_near((2.0, 3.0), (10.0, 11.0))))
    row = RATES["rss_violations"]
    assert found[row.count] / found[row.exposure] * row.per == pytest.approx(50.0)
    assert violations(Record()) == (None, None)


@pytest.mark.parametrize(("act_s", "unanswered"), [(3.9, 1), (4.1, 0), (5.0, 0), (5.5, 0), (6.0, 0), (6.1, 1)])
def test_a_violation_is_answered_by_an_intervention_in_it_or_a_second_before(act_s: float, unanswered: int) -> None:
    assert violations(too_near((5.0, 6.0), acts=(act_s,))) == (1, unanswered)
    assert violations(too_near((5.0, 6.0), acts=(act_s,), withheld="no grant")) == (1, 1)


def test_an_intervention_that_goes_on_from_long_before_answers_a_violation() -> None:
    assert violations(too_near((5.0, 6.0), acts=tuple(1.0 + 0.1 * tick for tick in range(45)))) == (1, 0)


def test_a_person_in_the_path_within_the_stopping_distance_violates_rss() -> None:
    # 14.12 + 26.38 = 40.50 m to a halt; a person's gap is x - (0.4 + 4.6) / 2
    near, far = (steady(2.0, actors=(person(gap + 2.5, 20.0),)) for gap in (40.0, 41.0))
    acts = (decided(1.0, "ACT"),)
    assert measure(Record(truths=near, decisions=acts)).false_interventions == 0
    assert measure(Record(truths=far, decisions=acts)).false_interventions == 1


def test_time_to_collision_at_an_intervention() -> None:
    assert measure(braked(1.0, gap_m=26.0)).ttc_intervention_s == pytest.approx((5.2,))
    assert measure(braked(1.0, gap_m=99.9)).ttc_intervention_s == pytest.approx((19.98,))
    assert measure(braked(1.0, gap_m=100.1)).ttc_intervention_s == ()


def test_headway_counts_only_while_following() -> None:
    def at(time_s: float) -> dict[str, Any]:
        # a quarter at 0.8 s, half at 2 s, then too far to follow
        return {"speed_mps": 10.0, "gap_m": 8.0 if time_s <= 1.0 else 20.0 if time_s <= 3.0 else 60.0}

    found = measure(Record(truths=truths(4.0, at)))
    assert found.headway_median_s == pytest.approx(2.0)
    assert found.headway_short_share == pytest.approx(1 / 3)
    assert measure(Record(truths=steady(1.0, 3.0, gap_m=5.0))).headway_median_s is None
