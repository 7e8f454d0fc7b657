"""Lanes beside the spine, and the change from one side to the other."""

import numpy as np
import pytest

from services.simulator.road.cross_section import CrossSection, lane_line
from services.simulator.road.spine import Bend, build_spine

SPINE = build_spine((Bend(900),))


def section(**changes: object) -> CrossSection:
    return CrossSection(SPINE, 1, 3.25, 0.0, **changes)  # type: ignore[arg-type]


def test_one_keeps_right_before_the_border_and_left_after_it() -> None:
    road = section(changeover_m=400.0)
    before, after = road.offset_m(np.array([100.0, 700.0]), "forward", 0)
    assert (before, after) == pytest.approx((-1.625, 1.625))
    assert (road.keeps(100.0), road.keeps(700.0)) == ("right", "left")


def test_oncoming_lanes_lie_opposite_and_cross_only_at_the_changeover() -> None:
    road = section(changeover_m=400.0)
    s = np.arange(0.0, 900.0, 5.0)
    forward, oncoming = road.offset_m(s, "forward", 0), road.offset_m(s, "oncoming", 0)
    assert np.allclose(forward, -oncoming)
    close = s[np.abs(forward - oncoming) < 3.0]
    assert close.min() > 375.0
    assert close.max() < 425.0


def test_the_carriageway_is_wide_enough_for_its_lanes_everywhere() -> None:
    road = section(changeover_m=400.0)
    s = np.arange(0.0, 900.0, 1.0)
    assert np.all(np.abs(road.offset_m(s, "forward", 0)) + 1.4 < [road.reach_m(each) for each in s.tolist()])


def test_the_changeover_can_be_driven_at_town_speed() -> None:
    line = lane_line(section(changeover_m=400.0), "forward", 0)
    assert line.curvature_ahead(300.0, 200.0) < 1 / 25


def test_on_a_motorway_lanes_count_from_the_median_outwards() -> None:
    road = CrossSection(SPINE, 3, 3.6, 4.0)
    offsets = [float(road.offset_m(np.array([50.0]), "forward", lane)[0]) for lane in range(3)]
    assert offsets == pytest.approx([-3.8, -7.4, -11.0])
