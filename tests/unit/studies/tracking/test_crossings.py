"""When who crosses is seen to come into the path, on pictures made by hand; and the drives up to the junctions."""

from collections.abc import Sequence

import msgspec
import pytest

from evaluation.scenarios.names import Place
from proto.perception import Track
from proto.truth import TrueHazard
from proto.vehicle import Ego
from studies.tracking.crossings import BEFORE_M, PEOPLE, Crossing, approaches, judged, sheet
from studies.tracking.recording import Step
from studies.tracking.seeing import View
from tests.unit.studies.tracking.views import actor, track, view

HAZARD = TrueHazard(kind="priority", onset_s=1.0, actor_id=481)


def at(time_s: float, *tracks: Track) -> View:
    crossing = msgspec.structs.replace(actor(481, 20.0, -15.0), vy_mps=8.0)
    return view((crossing,), (), tracks, at_s=time_s)


def steps_of(views: Sequence[View], hazards: tuple[TrueHazard, ...] = (HAZARD,)) -> list[Step]:
    return [
        Step(
            stamp_ns=each.stamp_ns,
            ego=Ego(),
            truth=msgspec.structs.replace(each.truth, hazards=hazards if each.truth.time_s >= 1.0 else ()),
        )
        for each in views
    ]


def crossing_track(track_id: int, x_m: float, y_m: float, *, in_path: bool = True) -> Track:
    return msgspec.structs.replace(track(track_id, x_m, y_m), vy_mps=7.0, in_ego_path=in_path)


def test_it_is_late_by_the_time_from_onset_to_its_first_track_in_the_path() -> None:
    views = [
        at(1.0),
        at(1.2, crossing_track(7, 20.5, -14.0, in_path=False)),
        at(1.4, crossing_track(8, 60.0, 4.0)),
        at(1.6, crossing_track(7, 20.5, -14.0)),
        at(1.8, crossing_track(7, 20.5, -14.0)),
    ]
    found = judged("a", steps_of(views), views)
    assert found is not None
    assert found.late_s == pytest.approx(0.6)
    assert found.false == 1, "the one that is of nobody"


def test_whom_nothing_tells_is_never_seen_and_with_nobody_coming_there_is_nothing_to_judge() -> None:
    views = [at(1.0), at(1.2)]
    found = judged("a", steps_of(views), views)
    assert found is not None
    assert found.late_s is None
    assert judged("a", steps_of(views, ()), views) is None


def test_the_table_counts_those_in_time_and_takes_never_for_the_latest() -> None:
    rows = [Crossing(place="a", onset_s=1.0, late_s=late, false=1) for late in (0.2, 0.4, None)]
    assert sheet(rows).rows[-1] == ("3: median", "", "0.40; 2 within 0.5", 3)
    assert "never" in sheet(rows).rows[-2]


def test_each_junction_at_which_a_car_comes_is_driven_up_to() -> None:
    plans = dict(approaches(Place("urb-rain", "development", 2)))
    assert list(plans) == ["urb-rain/development/2 0", "urb-rain/development/2 1"]
    for plan in plans.values():
        assert any(line.at_m == pytest.approx(plan.ego.at_m + BEFORE_M) for line in plan.yields if line.cars)


STEPPING = TrueHazard(kind="pedestrian", onset_s=1.0, actor_id=7)


def walked(time_s: float, vy_mps: float, *tracks: Track) -> View:
    person = msgspec.structs.replace(actor(7, 20.0, -4.0), kind="pedestrian", vy_mps=vy_mps)
    return view((person,), (), tracks, at_s=time_s)


def person_track(track_id: int, y_m: float, vy_mps: float, **fields: object) -> Track:
    seen = {"kind": "pedestrian", "vy_mps": vy_mps, "age_s": 2.0, "confidence": 0.9, "in_ego_path": False, **fields}
    return msgspec.structs.replace(track(track_id, 20.0, y_m), **seen)


def test_a_person_comes_where_his_track_crosses_and_one_who_stands_and_seems_to_is_false() -> None:
    views = [
        walked(0.8, 0.0, person_track(3, -4.0, 1.5)),
        walked(1.0, 1.4, person_track(4, -4.0, 0.1)),
        walked(1.2, 1.4, person_track(4, -3.9, 1.2, age_s=0.1)),
        walked(1.4, 1.4, person_track(4, -3.8, 1.2), person_track(5, 9.0, -1.5), person_track(6, 2.0, 0.0)),
    ]
    found = judged("a", steps_of(views, (STEPPING,)), views, PEOPLE)
    assert found is not None
    assert found.late_s == pytest.approx(0.4)
    assert found.false == 1, "the one of a person who stood"


def test_each_who_steps_out_is_driven_up_to_and_who_crosses_at_his_light_is_not() -> None:
    plans = [plan for _, plan in approaches(Place("urb-rain", "development", 7), PEOPLE)]
    assert len(plans) == 2
    for plan in plans:
        stepping = [each.at_m for each in plan.crossers if each.when_ego_within_m is not None]
        assert any(at_m == pytest.approx(plan.ego.at_m + BEFORE_M) for at_m in stepping)
