"""What a drive counts as, by hand."""

import pytest

from evaluation.metrics import Record
from studies.calibrate.score import PARTS, Counts, counts, objective, parts, pooled
from tests.unit.evaluation.metrics.logs import decided, hazard, said, steady, ticked, truths


def test_a_braking_for_nothing_is_false_and_one_below_the_rss_distance_is_not() -> None:
    acts = tuple(decided(at_s, "ACT") for at_s in (5.0, 5.1, 5.2))
    free = counts(Record(truths=steady(10.0), decisions=acts))
    # at 20 m/s and mu 0.8 a lead that stands 12 m ahead is nearer than any RSS distance
    near = counts(Record(truths=steady(10.0, gap_m=12.0, closing_mps=20.0), decisions=acts))
    assert (free.interventions, free.false_interventions) == (1, 1)
    assert (near.interventions, near.false_interventions) == (1, 0)


def test_a_near_collision_that_nobody_brakes_for_counts_and_one_that_is_braked_for_does_not() -> None:
    def at(time_s: float) -> dict[str, object]:
        return {
            "speed_mps": 15.0,
            "gap_m": max(5.0, 60.0 - 10.0 * time_s),
            "closing_mps": 10.0 if time_s < 5.5 else -1.0,
        }

    drive = truths(10.0, at)
    # 15 m at 10 m/s from 4.5 s on: below 1.5 s to collision
    assert counts(Record(truths=drive)).unbraked == 1
    assert counts(Record(truths=drive, decisions=(decided(4.0, "ACT"),))).unbraked == 0
    assert counts(Record(truths=drive, decisions=(decided(0.5, "ACT"),))).unbraked == 1, "that was another one"


def test_a_warning_of_somebody_who_is_not_there_is_a_false_alarm() -> None:
    warned = (said(5.0, urgency="warning", hazard="closing_lead", topic="lead"),)
    assert counts(Record(truths=steady(10.0), advisories=warned)).false_alarms == 1
    assert counts(Record(truths=steady(10.0, gap_m=40.0, closing_mps=10.0), advisories=warned)).false_alarms == 0
    on = steady(10.0, hazards=(hazard("cut_in", 4.0, 40.0),))
    assert counts(Record(truths=on, advisories=warned)).false_alarms == 0


def test_a_hazard_that_is_never_named_is_missed_and_counts_as_late() -> None:
    drive = steady(10.0, hazards=(hazard("stopped_lead", 2.0, 150.0),))
    silent = counts(Record(truths=drive))
    told = counts(Record(truths=drive, advisories=(said(3.0, hazard="closing_lead", urgency="warning"),)))
    assert (silent.hazards, silent.missed, silent.response_s) == (1, 1, 5.0)
    assert told.missed == 0
    assert told.response_s == pytest.approx(1.0)


def test_events_are_scored_against_truth() -> None:
    fast = steady(10.0, 24.0)
    ticks = tuple(ticked(step / 10, ("overspeed",)) for step in range(1, 100))
    assert counts(Record(truths=fast, traces=ticks)).hits == 1
    assert counts(Record(truths=steady(10.0), traces=ticks)).false_events == 1


def test_drives_are_added_and_rates_are_of_all_of_them() -> None:
    one = Counts(km=2.0, hazards=3, missed=1, false_interventions=2, nags=1, messages=10, hits=4, misses=1)
    total = pooled([one, Counts(km=3.0, hazards=1, messages=5, false_events=1)])
    found = parts(total, 2.0)
    assert total.km == 5.0
    assert found["missed_hazards"] == 0.25
    assert found["false_interventions"] == 4.0
    assert found["messages"] == 30.0
    assert found["events"] == pytest.approx(1 - 8 / 10)
    assert set(found) == {part.name for part in PARTS}
    assert objective(found) == pytest.approx(sum(part.weight * found[part.name] for part in PARTS))


def test_each_part_makes_the_objective_worse() -> None:
    nothing = {part.name: 0.0 for part in PARTS}
    for part in PARTS:
        assert part.weight > 0.0
        assert part.reason
        assert objective({**nothing, part.name: 1.0}) == part.weight
