"""What hides what, on flat ground."""

import math
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from services.simulator.scene.scene import Actor, Box, Pose, Scene, StaticWorld
from services.simulator.scene.scene import Road as FlatRoad
from services.simulator.truth.line_of_sight import LIT_M, Sight, boxes, share_in_sight

EGO = Pose(x_m=0.0, y_m=0.0)
CAR = Box(Pose(x_m=60.0, y_m=0.0), 4.6, 1.82, 1.45)
LORRY = (9.0, 2.5, 3.4)


def lorry(x_m: float, y_m: float) -> Box:
    return Box(Pose(x_m=x_m, y_m=y_m), *LORRY)


def test_on_an_open_road_all_of_a_car_is_in_sight() -> None:
    assert share_in_sight(EGO, CAR, boxes(())) == 1.0


def test_a_lorry_hides_a_car_and_no_longer_does_once_it_has_left_the_lane() -> None:
    shares = [share_in_sight(EGO, CAR, boxes([lorry(30.0, y / 4)])) for y in range(17)]
    assert shares[0] == 0.0
    assert shares == sorted(shares)
    assert shares[-1] == 1.0
    assert 0.2 < shares[5] < 0.8, "half of it is in sight while the lorry is on its way"


def test_a_parked_car_hides_a_child_but_not_a_lorry() -> None:
    parked = boxes([Box(Pose(x_m=50.0, y_m=0.0), 4.6, 1.82, 1.45)])
    assert share_in_sight(EGO, Box(Pose(x_m=54.0, y_m=0.0), 0.45, 0.55, 1.2), parked) == 0.0
    assert share_in_sight(EGO, lorry(60.0, 0.0), parked) > 0.5


def test_what_stands_behind_hides_nothing() -> None:
    assert share_in_sight(EGO, CAR, boxes([lorry(80.0, 0.0), lorry(-20.0, 0.0)])) == 1.0


@given(st.floats(-math.pi, math.pi), st.floats(5.0, 55.0), st.floats(-6.0, 6.0))
def test_turning_the_world_changes_nothing_and_more_bodies_hide_more(turn: float, x_m: float, y_m: float) -> None:
    def turned(body: Box) -> Box:
        c, s, pose = math.cos(turn), math.sin(turn), body.pose
        place = Pose(x_m=pose.x_m * c - pose.y_m * s, y_m=pose.x_m * s + pose.y_m * c, yaw_rad=pose.yaw_rad + turn)
        return Box(place, body.length_m, body.width_m, body.height_m)

    house, lead = lorry(x_m, y_m), Box(Pose(x_m=x_m, y_m=-y_m), 4.6, 1.8, 1.45)
    plain = share_in_sight(EGO, CAR, boxes([house]))
    assert share_in_sight(Pose(x_m=0.0, y_m=0.0, yaw_rad=turn), turned(CAR), boxes([turned(house)])) == pytest.approx(
        plain, abs=0.051
    )
    assert share_in_sight(EGO, CAR, boxes([house, lead])) <= plain


def test_at_night_only_what_is_lit_shows_from_afar() -> None:
    def reaches(x_m: float, *, lit: bool, night: bool, **more: Any) -> bool:
        scene = Scene(static=StaticWorld(road=FlatRoad()), ego=EGO, **more)
        body = Box(Pose(x_m=x_m, y_m=0.0), 0.45, 0.55, 1.75)
        return Sight(boxes(()), scene, 200.0, night).reaches(None, body, lit)

    assert reaches(150.0, lit=False, night=False)
    assert reaches(150.0, lit=True, night=True)
    assert not reaches(LIT_M + 5.0, lit=False, night=True)
    assert not reaches(210.0, lit=True, night=False), "fog"
    van = Actor(id=1, kind="van", pose=Pose(x_m=70.0, y_m=0.0), length_m=5.4, width_m=2.0, height_m=2.3)
    assert not reaches(150.0, lit=False, night=False, actors=(van,))
