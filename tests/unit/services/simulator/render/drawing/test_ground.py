"""Lanes, kerbs and markings as flat meshes."""

import numpy as np
import pytest

from services.simulator.render.drawing import ground
from services.simulator.scene.scene import Lane, Marking, Pose, Road, StopLine, Strip, Zebra

STRAIGHT = np.array([(float(x), 0.0) for x in range(0, 101, 10)])


def test_across_points_to_the_left_of_the_driving_direction() -> None:
    assert ground.across(STRAIGHT)[3] == pytest.approx([0.0, 1.0])


def test_a_lane_covers_its_width_around_its_centre_line() -> None:
    surface = [c for c in ground.chunks(Road(lanes=(Lane(centre_m=STRAIGHT, width_m=3.5),))) if not c.line]
    lateral = np.concatenate([c.mesh.vertices["pos"][:, 1] for c in surface])
    assert lateral.max() == pytest.approx(1.75, abs=0.05)
    assert lateral.min() == pytest.approx(-1.75, abs=0.05)


@pytest.mark.parametrize(("marking", "runs"), [("none", 0), ("solid", 1), ("edge", 1), ("double", 2)])
def test_markings_lie_on_the_lane_s_left_border(marking: Marking, runs: int) -> None:
    lines = [c for c in ground.chunks(Road(lanes=(Lane(centre_m=STRAIGHT, left=marking),))) if c.line]
    places = {round(float(y), 2) for c in lines for y in c.mesh.vertices["pos"][:, 1]}
    assert len(places) == runs
    assert all(abs(place - 1.75) < 0.25 for place in places)


def test_dashes_leave_gaps() -> None:
    lines = [c for c in ground.chunks(Road(lanes=(Lane(centre_m=STRAIGHT, left="dashed"),))) if c.line]
    painted = np.unique(np.concatenate([c.mesh.vertices["pos"][:, 0].round() for c in lines]))
    assert {0.0, 4.0, 12.0} <= set(painted.tolist())
    assert not {6.0, 8.0, 10.0} & set(painted.tolist())


def test_a_pavement_is_raised_behind_its_kerb() -> None:
    parts = ground.chunks(Road(strips=(Strip(surface="pavement", centre_m=STRAIGHT, width_m=2.0),)))
    assert max(float(c.mesh.vertices["pos"][:, 2].max()) for c in parts) == pytest.approx(ground.KERB_M)


def test_bars_lie_above_lanes_so_that_a_stop_line_shows() -> None:
    road = Road(
        lanes=(Lane(centre_m=STRAIGHT),),
        stop_lines=(StopLine(pose=Pose(x_m=50, y_m=0)),),
        zebras=(Zebra(pose=Pose(x_m=70, y_m=0), span_m=7.0),),
    )
    layers = {bool(c.line): int(c.mesh.vertices["meta"][0, 2]) for c in ground.chunks(road)}
    assert layers[True] > layers[False]
