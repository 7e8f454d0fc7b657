"""Lanes from the map or as a corridor, and who leads in them."""

import math

import msgspec
import pytest
from hypothesis import given
from hypothesis import strategies as st

from proto.perception import Track
from proto.sensors import LanePath, MapView, StopLine
from services.perception.lanes.lead_vehicle import lead_of, place
from services.perception.lanes.model import lane_model


def straight(lane_id: str, y_m: float, *, is_ego: bool = False, oncoming: bool = False) -> LanePath:
    return LanePath(lane_id=lane_id, points=((-10.0, y_m), (150.0, y_m)), width_m=3.5, is_ego=is_ego, oncoming=oncoming)


ROAD = MapView(
    segment_id="s1",
    lanes=(straight("left", 3.5, oncoming=True), straight("ego", 0.0, is_ego=True), straight("right", -3.5)),
    stop_lines=(StopLine(distance_m=60.0, kind="light"), StopLine(distance_m=25.0)),
    junction_distance_m=70.0,
    road_class="urban",
)
BEND_M = 120.0
BEND = MapView(
    segment_id="s2",
    lanes=tuple(
        LanePath(
            lane_id=name,
            points=tuple(
                ((BEND_M - off) * math.sin(a / 20), BEND_M - (BEND_M - off) * math.cos(a / 20)) for a in range(21)
            ),
            width_m=3.5,
            is_ego=name == "ego",
        )
        for name, off in (("ego", 0.0), ("inner", 3.5))
    ),
)


def car(track_id: int, x_m: float, y_m: float, vy_mps: float = 0.0, kind: str = "vehicle", **more: bool) -> Track:
    return Track(track_id=track_id, kind=kind, x_m=x_m, y_m=y_m, vx_mps=0.0, vy_mps=vy_mps, width_m=1.8, **more)  # type: ignore[arg-type]


def lead(view: MapView | None, *tracks: Track) -> int | None:
    model = lane_model(view)
    return lead_of([place(track, model) for track in tracks])


def test_a_nearer_vehicle_in_the_next_lane_does_not_lead() -> None:
    assert lead(ROAD, car(1, 12.0, -3.5), car(2, 40.0, 0.1)) == 2


def test_a_vehicle_cutting_in_leads_before_it_has_arrived() -> None:
    cutting = car(1, 15.0, -2.6, vy_mps=1.2)
    assert lead(ROAD, cutting, car(2, 40.0, 0.0)) == 1
    assert lead(ROAD, msgspec.structs.replace(cutting, vy_mps=-1.2), car(2, 40.0, 0.0)) == 2


def test_one_hardly_believed_leads_only_where_nobody_surer_does() -> None:
    faded = msgspec.structs.replace(car(1, 15.0, 0.0), confidence=0.1)
    sure = msgspec.structs.replace(car(2, 40.0, 0.0), confidence=0.9)
    assert lead(ROAD, faded, sure) == 2
    assert lead(ROAD, faded) == 1


def test_lateral_noise_in_the_next_lane_is_no_cut_in() -> None:
    assert lead(ROAD, car(1, 15.0, -3.2, vy_mps=0.3), car(2, 40.0, 0.0)) == 2


def test_in_a_bend_the_lead_is_found_along_the_lane_not_straight_ahead() -> None:
    along = 0.45
    ahead = car(1, BEND_M * math.sin(along), BEND_M - BEND_M * math.cos(along))
    straight_on = car(2, 30.0, 0.0)
    assert lead(BEND, ahead, straight_on) == 1
    assert lead(None, straight_on) == 2


def test_oncoming_vehicles_and_people_do_not_lead() -> None:
    assert lead(ROAD, car(1, 20.0, 0.0, oncoming=True), car(2, 25.0, 0.0, kind="pedestrian")) is None


def test_what_lies_behind_does_not_lead() -> None:
    assert lead(ROAD, car(1, -6.0, 0.0)) is None


def test_a_person_on_the_lane_is_in_the_egos_path() -> None:
    placed = place(car(1, 20.0, 0.8, kind="pedestrian"), lane_model(ROAD))
    assert placed.track.in_ego_path
    assert placed.track.lane_id == "ego"


def test_a_vehicle_in_an_oncoming_lane_is_oncoming_and_its_lane_is_named() -> None:
    placed = place(car(1, 30.0, 3.4), lane_model(ROAD))
    assert placed.track.oncoming
    assert placed.track.lane_id == "left"


def test_beside_all_lanes_there_is_no_lane() -> None:
    assert place(car(1, 30.0, 14.0), lane_model(ROAD)).track.lane_id == ""


def test_the_message_names_the_next_stop_line_and_the_map() -> None:
    message = lane_model(ROAD).message()
    assert message.source == "map"
    assert message.stop_line_distance_m == 25.0
    assert (message.lane_count, message.road_class, message.junction_distance_m) == (2, "urban", 70.0)


def test_the_offset_is_positive_to_the_left_of_the_lanes_middle() -> None:
    shifted = MapView(segment_id="s", lanes=(straight("ego", -0.6, is_ego=True),))
    assert lane_model(shifted).message().lateral_offset_m == pytest.approx(0.6)


@pytest.mark.parametrize(
    "lanes",
    [
        (),
        (LanePath(lane_id="x", points=(), width_m=3.5),),
        (LanePath(lane_id="x", points=((0.0, 0.0),), width_m=3.5),),
        (LanePath(lane_id="x", points=((0.0, math.nan), (9.0, 0.0)), width_m=3.5),),
        (LanePath(lane_id="x", points=((0.0, 0.0), (9.0, 0.0)), width_m=0.0),),
    ],
)
def test_without_a_usable_lane_there_is_the_straight_corridor(lanes: tuple[LanePath, ...]) -> None:
    message = lane_model(MapView(segment_id="s", lanes=lanes)).message()
    assert message.source == "corridor"
    assert message.stop_line_distance_m is None


@given(lateral_mps=st.floats(-1.9, 1.9), ego_mps=st.floats(1.0, 40.0), aside_m=st.sampled_from([-2.8, 2.8]))
def test_a_parked_vehicle_does_not_cut_in_however_noisy_its_lateral_speed(
    lateral_mps: float, ego_mps: float, aside_m: float
) -> None:
    parked = msgspec.structs.replace(car(1, 30.0, aside_m), vx_mps=-ego_mps, vy_mps=lateral_mps)
    assert not place(parked, lane_model(None), ego_mps).track.in_ego_path


def test_a_vehicle_that_rolls_out_of_its_parking_place_cuts_in() -> None:
    starting = msgspec.structs.replace(car(1, 20.0, -2.8), vx_mps=-10.0 + 2.5, vy_mps=1.0)
    assert place(starting, lane_model(None), 10.0).track.in_ego_path


def test_without_the_egos_speed_a_lateral_speed_counts_in_full() -> None:
    parked = msgspec.structs.replace(car(1, 20.0, -2.8), vx_mps=-10.0, vy_mps=1.0)
    assert place(parked, lane_model(None)).track.in_ego_path


def test_the_clearance_is_the_room_between_the_bodies() -> None:
    assert place(car(1, 30.0, -2.85), lane_model(None)).track.clearance_m == pytest.approx(1.0)
    assert place(car(1, 30.0, 0.0), lane_model(None)).track.clearance_m == pytest.approx(-1.85)


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_a_vehicle_that_crosses_is_in_the_path_before_it_is_there(side: float) -> None:
    crossing = msgspec.structs.replace(car(1, 40.0, side * 15.0), vx_mps=-14.0, vy_mps=-side * 6.0)
    assert place(crossing, lane_model(None), 14.0).track.in_ego_path
    gone = msgspec.structs.replace(crossing, vy_mps=side * 6.0)
    assert not place(gone, lane_model(None), 14.0).track.in_ego_path
    waiting = msgspec.structs.replace(crossing, vy_mps=0.0)
    assert not place(waiting, lane_model(None), 14.0).track.in_ego_path
