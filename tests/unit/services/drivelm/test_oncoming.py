"""Which side traffic keeps to is told by who is seen to come, not by a bend, a map or a parked car."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from drivemcp.config import ServiceConfig
from drivemcp.node import Node
from drivemcp.service import Service
from drivemcp.testing import bus
from proto import topics
from proto.perception import Track, Tracks
from services.drivelm.country.country_belief import oncoming_cue, seen_to_come
from services.drivelm.front_end import FrontEnd
from services.drivelm.service import Bindings, DrivelmConfig
from tests.unit.services.drivelm.approach import Scripted, says

EGO_MPS, THEIRS_MPS, LANE_M = 15.0, 15.0, 3.5


def _track(x_m: float, y_m: float, ground_mps: float, across_mps: float = 0.0, track_id: int = 1) -> Track:
    """A vehicle that a map, or its speed, makes an oncoming one."""
    return Track(
        track_id=track_id, kind="vehicle", x_m=x_m, y_m=y_m, vx_mps=ground_mps - EGO_MPS, vy_mps=across_mps, age_s=2.0,
        confidence=0.9, oncoming=True,
    )  # fmt: skip


def _in_bend(radius_m: float, along_m: float, side: int = 1, track_id: int = 1) -> Track:
    """Who comes along the lane on our left (side 1) or right (-1), so far along a bend to the right (radius below 0: to the left)."""
    turned = along_m / radius_m
    reach_m = radius_m + side * LANE_M
    return _track(
        reach_m * math.sin(turned), reach_m * math.cos(turned) - radius_m, -THEIRS_MPS * math.cos(turned),
        THEIRS_MPS * math.sin(turned), track_id,
    )  # fmt: skip


def _build(config: ServiceConfig, node: Node) -> None:
    Bindings(DrivelmConfig(home="DEU"), node, FrontEnd(Scripted(lambda q, n: says("other")), home="DEU"))


def _told(tracks: tuple[Track, ...], ego_mps: float | None = EGO_MPS) -> str:
    """The side that traffic keeps to, as told after these tracks."""
    with bus() as b:
        b.start(Service("drivelm", ServiceConfig, _build))
        said = b.collect(topics.FACTS)
        b.probe.publish(topics.TRACKS, Tracks(camera="front", frame=1, tracks=tracks, ego_speed_used_mps=ego_mps))
        sides = [
            fact.reading for message in said.wait_count(2) for fact in message.facts if fact.kind == "traffic_side"
        ]
        return sides[-1] if sides else ""


def test_who_comes_on_a_straight_road_tells_the_side() -> None:
    many = range(1, 16)
    assert _told(tuple(_track(40.0, -5.0, -THEIRS_MPS, track_id=each) for each in many)) == "left"
    assert _told(tuple(_track(40.0, 5.0, -THEIRS_MPS, track_id=each) for each in many)) == "right"


@pytest.mark.parametrize(
    ("tracks", "ego_mps"),
    [
        (tuple(_in_bend(150.0, 45.0 + each, track_id=each) for each in range(1, 16)), EGO_MPS),
        (tuple(_track(20.0 + each, -4.0, 0.0, track_id=each) for each in range(1, 16)), EGO_MPS),
        (tuple(_track(40.0, -5.0, -THEIRS_MPS, track_id=each) for each in range(1, 16)), None),
    ],
    ids=["a bend to the right", "parked in what the map calls an oncoming lane", "our speed is unknown"],
)
def test_a_bend_a_map_and_an_unknown_speed_change_no_side(tracks: tuple[Track, ...], ego_mps: float | None) -> None:
    assert all(track.y_m < -1.5 for track in tracks), "they are where left-hand traffic would come"
    assert _told(tracks, ego_mps) == "right"


@given(
    st.floats(20.0, 5000.0), st.sampled_from((-1, 1)), st.sampled_from((-1, 1)), st.floats(1.0, 200.0),
)  # fmt: skip
def test_in_no_bend_does_anyone_tell_of_the_other_side(radius_m: float, bend: int, side: int, along_m: float) -> None:
    track = _in_bend(bend * radius_m, min(along_m, 1.5 * radius_m), side)
    if seen_to_come(track, EGO_MPS) and (cue := oncoming_cue(track.y_m)):
        assert ("DEU" in cue) == (side == 1)
