"""The road's reference line: places and their projections are each other's inverse."""

import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from services.simulator.road.spine import Bend, build_spine

SPINE = build_spine((Bend(200), Bend(120, 1 / 150), Bend(100), Bend(150, -1 / 200), Bend(200)))


@given(s=st.floats(2, 765), d=st.floats(-12, 12))
@settings(max_examples=80, deadline=None)
def test_a_place_projects_back_to_where_it_came_from(s: float, d: float) -> None:
    found_s, found_d = SPINE.project(*SPINE.place(s, d))
    assert found_s == pytest.approx(s, abs=0.12)
    assert found_d == pytest.approx(d, abs=0.03)


def test_an_arc_turns_by_length_over_radius_and_left_is_positive() -> None:
    assert SPINE.yaw(330) == pytest.approx(120 / 150, abs=1e-9)
    assert SPINE.place(320, 0.0)[1] > 5.0
    assert SPINE.length_m == pytest.approx(770)


def test_beyond_its_ends_the_line_goes_on_straight() -> None:
    assert SPINE.place(-10.0, 2.0) == pytest.approx((-10.0, 2.0))
    x, y = SPINE.place(780.0)
    ex, ey = SPINE.place(770.0)
    assert math.hypot(x - ex, y - ey) == pytest.approx(10.0)
