"""What truth says that a picture would show."""

import math

import msgspec
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from evaluation.modelled_sensors.sight import Lens, things
from proto.truth import TrueActor
from services.simulator.session import CAMERAS
from tests.unit.studies.modelled_sensors.support import car, truth


def test_a_nearer_car_hides_the_one_behind_it() -> None:
    lens = Lens(CAMERAS["front"])
    near, far = sorted(things(truth(0.0, car(1, 15.0), car(2, 40.0, 2.5)), lens), key=lambda each: each.depth_m)
    assert near.hidden == 0.0
    assert 0.6 < far.hidden < 0.8
    assert near.height_px > 2 * far.height_px
    covered = things(truth(0.0, car(1, 15.0), car(2, 40.0, 2.5), car(3, 15.2, 0.1)), lens)
    again = next(each for each in covered if each.key == far.key)
    assert again.hidden < 0.85, "two that stand on each other hide nothing twice"


@given(
    x_m=st.floats(20.0, 80.0),
    slope=st.floats(-0.5, 0.5),
    heading_rad=st.floats(-3.1, 3.1),
    speed_mps=st.floats(5.0, 20.0),
)
def test_a_box_is_as_wide_as_the_body_however_it_is_turned(
    x_m: float, slope: float, heading_rad: float, speed_mps: float
) -> None:
    camera, along, aside = CAMERAS["front"], math.cos(heading_rad), math.sin(heading_rad)
    bus = msgspec.structs.replace(
        car(1, x_m, slope * x_m), length_m=9.0, width_m=2.5, vx_mps=speed_mps * along - 20.0, vy_mps=speed_mps * aside
    )
    found = things(truth(0.0, bus), Lens(camera))
    shown = [
        camera.focal_px
        * (camera.y_m - bus.y_m - aside * far - along * wide)
        / (bus.x_m + along * far - aside * wide - camera.x_m)
        for far in (-4.5, 4.5)
        for wide in (-1.25, 1.25)
    ]
    left, right = camera.width_px / 2 + min(shown), camera.width_px / 2 + max(shown)
    assume(left > 0.0 and right < camera.width_px)
    (thing,) = found
    assert thing.box[0] == pytest.approx(left, abs=3.0)
    assert thing.box[2] == pytest.approx(right, abs=3.0)


def test_of_one_who_shows_his_end_alone_the_sides_are_those_of_his_end() -> None:
    lens = Lens(CAMERAS["front"])
    straight = msgspec.structs.replace(car(1, 40.0, 3.0), length_m=9.0)
    towards_us = msgspec.structs.replace(
        straight, vx_mps=-10.0 * math.cos(0.075) - 20.0, vy_mps=-10.0 * math.sin(0.075)
    )
    for bus in (straight, towards_us):
        (thing,) = things(truth(0.0, bus), lens)
        assert thing.sides_m is not None
        assert thing.sides_m[1] - thing.sides_m[0] == pytest.approx(bus.width_m, abs=0.03)


def test_who_is_wholly_hidden_does_not_show() -> None:
    queue = truth(0.0, car(1, 12.0), car(2, 22.0), car(3, 32.0))
    assert [each.key for each in things(queue, Lens(CAMERAS["front"]))] == ["actor/1"]


def test_who_stands_behind_a_house_does_not_show_and_who_comes_out_shows_in_part() -> None:
    lens, open_car = Lens(CAMERAS["front"]), car(1, 30.0, 8.0)

    def hidden(walled: float, *others: TrueActor) -> list[float]:
        found = things(truth(0.0, msgspec.structs.replace(open_car, walled=walled), *others), lens)
        return [each.hidden for each in found if each.key == "actor/1"]

    assert hidden(1.0) == []
    assert hidden(0.0) == [0.0]
    assert hidden(0.5) == [pytest.approx(0.5)]
    (covered,) = hidden(0.0, car(2, 15.0, 5.5))
    assert 0.0 < covered < 0.9
    assert hidden(0.5, car(2, 15.0, 5.5)) == [pytest.approx(1.0 - 0.5 * (1.0 - covered))]
