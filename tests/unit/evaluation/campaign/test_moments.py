"""The worst moments of a run, one of a kind, and those that a report has room for."""

from typing import Any

import msgspec
import pytest

from evaluation.campaign import moments
from evaluation.campaign.moments import KINDS, Moment, shown, worst_moments
from evaluation.campaign.plan import Row
from evaluation.campaign.store import Kept
from evaluation.metrics import Record
from evaluation.metrics.conflicts import EGO_LENGTH_M
from evaluation.report import report
from tests.unit.evaluation.evaluate.made import kept, table
from tests.unit.evaluation.metrics.logs import decided, hazard, person, said, steady, truths


def of(record: Record) -> dict[str, Moment]:
    return {moment.kind: moment for moment in worst_moments(record)}


def test_a_quiet_drive_has_none() -> None:
    assert worst_moments(Record(truths=steady(5.0))) == worst_moments(Record()) == ()


@pytest.mark.parametrize(("infraction", "line"), [("red_light", "a red light"), ("no_stop", "a stop line")])
def test_the_fastest_line_that_was_run_is_one(infraction: str, line: str) -> None:
    def at(time_s: float) -> dict[str, Any]:
        return {"speed_mps": 10.0 if time_s < 5.0 else 15.0, "infraction": infraction if time_s in (2.0, 7.0) else ""}

    found = of(Record(truths=truths(10.0, at)))["stop line run"]
    assert (found.time_s, found.what, found.badness) == (7.0, f"{line} run at 54 km/h", 15.0)


def test_a_hazard_without_a_word_in_time_is_one_and_an_answered_one_is_none() -> None:
    def at(time_s: float) -> dict[str, Any]:
        walker = (hazard("pedestrian", 2.0),) if 2.0 <= time_s <= 3.5 else ()
        cut_in = (hazard("cut_in", 6.0),) if 6.0 <= time_s <= 7.0 else ()
        return {"speed_mps": 10.0 if time_s < 5.0 else 15.0, "hazards": (*walker, *cut_in)}

    word = said(2.5, topic="person", hazard="pedestrian", urgency="warning")
    lead = said(6.5, topic="lead", hazard="closing_lead", urgency="warning")
    truth = truths(10.0, at)
    assert of(Record(truths=truth))["unanswered hazard"].time_s == 6.0, "the faster one"
    found = of(Record(truths=truth, advisories=(lead,)))["unanswered hazard"]
    assert (found.time_s, found.what) == (2.0, "pedestrian for 1.5 s, from 36 km/h, and no word in time")
    assert "unanswered hazard" not in of(Record(truths=truth, advisories=(word, lead)))


def test_the_longest_rss_violation_in_which_nothing_braked_is_one() -> None:
    # RSS asks for 26.44 m at 20 m/s behind 15 m/s
    def at(time_s: float) -> dict[str, Any]:
        near = 2.0 <= time_s <= 5.0 or 8.0 <= time_s <= 9.0
        return {"speed_mps": 20.0, "gap_m": 26.0 if near else 27.0, "closing_mps": 5.0}

    truth = truths(12.0, at)
    found = of(Record(truths=truth))["unanswered RSS violation"]
    assert (found.time_s, found.what) == (2.0, "3.0 s below the RSS distance, from 72 km/h, and nothing braked")
    acts = tuple(decided(time_s, "ACT") for time_s in (3.0, 8.5))
    assert of(Record(truths=truth, decisions=acts[:1]))["unanswered RSS violation"].time_s == 8.0
    assert "unanswered RSS violation" not in of(Record(truths=truth, decisions=acts))


@pytest.mark.parametrize(("leaves_s", "told"), [(4.2, "0.8 s"), (3.1, "1.9 s"), (2.9, "")])
def test_the_smallest_post_encroachment_time_is_one(leaves_s: float, told: str) -> None:
    # At 10 m/s; somebody leaves the path 50 m on, where the front is after 5.0 s
    def at(time_s: float) -> dict[str, Any]:
        x_m = 50.0 + EGO_LENGTH_M / 2 - 10.0 * time_s
        walker = person(x_m, 10.0, in_path=time_s <= leaves_s and x_m > 0.0)
        return {"speed_mps": 10.0, "actors": (walker,)}

    found = of(Record(truths=truths(8.0, at))).get("smallest post-encroachment time")
    if not told:
        assert found is None
        return
    assert found is not None
    assert found.time_s == leaves_s
    assert found.what == f"{told} between two in one place, at 36 km/h"


def test_a_report_shows_the_worst_of_each_kind_before_the_second_of_any() -> None:
    assert shown([["a", "b", "c", "d"], ["e"], []]) == [["a", "b", "c"], ["e"], []]
    many = shown([[f"{kind} {at}" for at in range(5)] for kind in KINDS])
    assert [len(of_kind) for of_kind in many] == [2, 2, 1, 1, 1, 1, 1]
    assert sum(map(len, many)) == moments.MOST == 9


def test_a_report_has_no_more_moments_than_it_has_room_for_and_the_gravest_first() -> None:
    def made(row: Row, number: int) -> Kept:
        bad = tuple(Moment(kind=kind, time_s=1.0, tick=1, what="x", badness=float(number)) for kind in KINDS)
        return msgspec.structs.replace(kept(), moments=bad)

    chosen = report.worst([table("results", made, 4)])
    assert list(dict.fromkeys(moment.kind for _, _, moment in chosen)) == list(KINDS)
    assert len(chosen) == 9
    assert chosen[0][2].badness == 3.0


def test_of_a_kind_our_own_come_first_and_each_the_worst_before_the_less_bad() -> None:
    def made(row: Row, number: int) -> Kept:
        ours = row.key == "urb-rain/DriveMCP"
        badness = {0: 1.0, 1: 5.0}[number] if ours else 9.0 - number if row.key == "urb-rain/VLM-Direct" else None
        bad = () if badness is None else (Moment(kind="collision", time_s=1.0, tick=1, what="x", badness=badness),)
        return msgspec.structs.replace(kept(), moments=bad)

    chosen = report.worst([table("results", made, 2)])
    assert [(row.row.spec.method, moment.badness) for row, _, moment in chosen] == [
        ("DriveMCP", 5.0), ("DriveMCP", 1.0), ("VLM-Direct", 9.0),
    ]  # fmt: skip
