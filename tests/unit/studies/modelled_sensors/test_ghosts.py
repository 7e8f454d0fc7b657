"""Boxes of nothing: gathered from recorded drives, drawn again."""

import math

import msgspec
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from drivemcp.paths import data
from evaluation.modelled_sensors.boxes import Eye
from evaluation.modelled_sensors.card import Card, read_card
from evaluation.modelled_sensors.hosted import CARD
from evaluation.modelled_sensors.sight import Lens, things
from evaluation.modelled_sensors.way import Way
from proto.perception import Box, Boxes
from services.simulator.session import CAMERAS
from studies.modelled_sensors.clutter import clutter
from studies.modelled_sensors.imagined import imagine
from studies.modelled_sensors.pairing import Stray, looks
from studies.modelled_sensors.recording import Recording
from studies.modelled_sensors.tune import as_haunted
from tests.unit.studies.modelled_sensors.support import NS, SPEC, car, drawn, truth


@pytest.mark.parametrize("too", [True, False])
def test_a_motorcyclist_who_is_found_as_a_person_is_no_box_of_nothing(*, too: bool) -> None:
    step = truth(1.0, car(1, 20.0))
    (thing,) = [each for each in things(step, Lens(CAMERAS["front"])) if each.key == "actor/1"]
    x0, y0, x1, y1 = thing.box
    vehicle = Box(x0_px=x0, y0_px=y0, x1_px=x1, y1_px=y1, kind="vehicle", score=0.96)
    twice = msgspec.structs.replace(vehicle, kind="pedestrian", score=0.8)
    elsewhere = msgspec.structs.replace(twice, x0_px=20.0, x1_px=30.0)
    boxes = Boxes(camera="front", frame=1, boxes=(*((vehicle,) if too else ()), twice, elsewhere))
    (picture,) = looks(Recording(spec=SPEC, truths=[(NS, step)], boxes=[(NS, boxes)]))
    assert [each.box for each in picture[1]] == [elsewhere]


@pytest.mark.parametrize(("x_m", "stray"), [(3.0, []), (30.0, [1])])
def test_who_is_so_near_that_the_model_has_no_thing_for_him_is_no_box_of_nothing(x_m: float, stray: list[int]) -> None:
    walker = msgspec.structs.replace(car(1, x_m, 1.5), kind="pedestrian", length_m=0.45, width_m=0.55)
    tall = Box(x0_px=146.0, y0_px=134.0, x1_px=226.0, y1_px=348.0, kind="pedestrian", score=0.99, range_m=3.0)
    seen = Recording(
        spec=SPEC, truths=[(NS, truth(1.0, walker))], boxes=[(NS, Boxes(camera="front", frame=1, boxes=(tall,)))]
    )
    (picture,) = looks(seen)
    assert [1 for _ in picture[1]] == stray


def test_boxes_of_nothing_that_follow_each_other_are_one_ghost_that_moves() -> None:
    def stray(k: int, x0: float) -> Stray:
        box = Box(x0_px=x0, y0_px=170.0, x1_px=x0 + 20.0, y1_px=190.0, kind="vehicle", score=0.5)
        return Stray("front", NS + k * NS // 10, box, 10.0, 0.0, "built_up")

    runs = [[stray(k, 100.0 + 2.0 * k) for k in range(11) if k != 5] + [stray(40, 120.0)]]
    minutes = [1.0, 0.0, 1.0, 2.0, 0.0]
    told_by = clutter(runs, "front", {"built_up": minutes, "open": minutes})
    assert not any(each.ghosts for each in told_by["open"])
    paces = told_by["built_up"]
    assert [len(each.ghosts) for each in paces] == [0, 0, 2, 0, 0], "at 10 m/s"
    told = paces[2]
    assert told.per_minute == 2.0
    moved, single = told.ghosts
    assert [each.after_s for each in moved.boxes] == [round(0.1 * k, 3) for k in range(11) if k != 5]
    assert [each.box[0] for each in moved.boxes] == [100.0 + 2.0 * k for k in range(11) if k != 5]
    assert len(single.boxes) == 1
    assert [each.driven_m for each in moved.boxes] == [round(1.0 * k, 3) for k in range(11) if k != 5]


def test_posts_deceive_where_the_road_is_built_up_as_often_as_they_did_there() -> None:
    ghost = Stray("front", NS, _post(30.0), 12.0, 0.0, "built_up")
    minutes = [0.0, 0.0, 1.0, 0.0, 0.0]
    told = clutter([[ghost]], "front", {"built_up": minutes, "open": minutes})
    often = {where: tuple(msgspec.structs.replace(each, per_minute=300.0) for each in told[where]) for where in told}
    haunted = msgspec.structs.replace(read_card(data(CARD)), clutter={"front": often})
    for limit_mps, there in ((13.9, True), (27.8, False), (None, False)):
        steps = (msgspec.structs.replace(truth(k / 10), speed_mps=12.0, law_limit_mps=limit_mps) for k in range(40))
        eye = Eye(haunted, "front", 1)
        found = [each for k, step in enumerate(steps) for each in eye.look(step, NS + k * NS // 10)]
        assert bool(found) is there


def test_boxes_of_nothing_come_so_much_oftener_as_fall_on_what_is_there(card: Card) -> None:
    there = msgspec.structs.replace(truth(0.0, car(1, 12.0), car(2, 9.0, 3.5)), law_limit_mps=13.9, speed_mps=12.0)
    steps = [(NS + k * NS // 10, there) for k in range(600)]
    oftener = {
        name: {
            where: tuple(msgspec.structs.replace(each, per_minute=1.6 * each.per_minute) for each in at_pace)
            for where, at_pace in places.items()
        }
        for name, places in card.clutter.items()
    }
    haunted = imagine(drawn(steps), msgspec.structs.replace(card, clutter=oftener), 9)
    found = as_haunted(card, [haunted]).clutter["front"]["built_up"]
    for new, old in zip(found, card.clutter["front"]["built_up"], strict=True):
        assert 1.3 * old.per_minute <= new.per_minute < 2.0 * max(old.per_minute, 0.1), "told from pictures alone"


@given(speed_mps=st.floats(8.5, 15.5), slowing_mps2=st.floats(0.0, 3.0))
def test_what_deceived_a_moving_camera_stays_where_it_stood_however_fast_the_ego_goes(
    speed_mps: float, slowing_mps2: float
) -> None:
    """A post 40 m ahead, seen at 12 m/s; it used to walk towards who drove slower than that."""
    depths = [40.0 - 1.2 * k for k in range(25)]
    strays = [Stray("front", NS + k * NS // 10, _post(depth_m), 12.0, 0.0, "open") for k, depth_m in enumerate(depths)]
    paces = clutter([strays], "front", {"open": [0.0, 0.0, 1.0, 0.0, 0.0]})
    often = tuple(msgspec.structs.replace(each, per_minute=30.0) for each in paces["open"])
    eye = Eye(msgspec.structs.replace(read_card(data(CARD)), clutter={"front": {"open": often}}), "front", 1)
    driven_m, seen = 0.0, 0
    began: list[float] = []
    for k in range(100):
        speed = max(speed_mps - slowing_mps2 * k / 10, 8.1)
        driven_m += 0.1 * speed if k else 0.0
        found = eye.look(msgspec.structs.replace(truth(k / 10), speed_mps=speed), NS + k * NS // 10)
        for each in found:
            depth_m = 600.0 / (each.detection.y1_px - each.detection.y0_px)
            if depth_m > 39.5:
                began.append(driven_m)
            assert any(abs(depth_m - (40.0 - (driven_m - start_m))) <= 0.6 + 0.1 for start_m in began)
            seen += 1
    assert seen > 5


@settings(max_examples=30, deadline=None)
@given(
    recorded_radps=st.floats(-0.4, 0.4), heading_rad=st.floats(-3.1, 3.1), now_radps=st.floats(-0.4, 0.4),
)  # fmt: skip
def test_what_deceived_a_camera_turns_with_the_road_and_not_with_the_ego(
    recorded_radps: float, heading_rad: float, now_radps: float
) -> None:
    """So far away that only turns count, to a thousandth. It used to be drawn where it was in the picture, and walked across the
    lane of who turned otherwise than when it was recorded."""
    lens = Lens(CAMERAS["front"])

    def stray(k: int) -> Stray:
        turned_rad = 0.1 * k * recorded_radps
        u = lens.aside(320.0, turned_rad)
        box = Box(
            x0_px=u - 5.0, y0_px=165.0, x1_px=u + 5.0, y1_px=190.0, kind="pedestrian", score=0.6,
            range_m=1e6, range_source="lidar",
        )  # fmt: skip
        return Stray("front", NS + k * NS // 10, box, 12.0, heading_rad + turned_rad, "open")

    paces = clutter([[stray(k) for k in range(8)]], "front", {"open": [0.0, 0.0, 1.0, 0.0, 0.0]})
    assert [len(each.boxes) for each in paces["open"][2].ghosts] == [8], "one, however quickly the ego turned"
    often = tuple(msgspec.structs.replace(each, per_minute=30.0) for each in paces["open"])
    eye = Eye(msgspec.structs.replace(read_card(data(CARD)), clutter={"front": {"open": often}}), "front", 1)
    bearings: list[float] = []
    began: list[float] = []
    for k in range(100):
        turned_rad = 0.1 * k * now_radps
        told = msgspec.structs.replace(truth(k / 10), speed_mps=12.0, heading_rad=heading_rad - 1.0 + turned_rad)
        for each in eye.look(told, NS + k * NS // 10):
            middle = (each.detection.x0_px + each.detection.x1_px) / 2
            bearings.append(turned_rad - math.atan((middle - 320.0) / CAMERAS["front"].focal_px))
            began.append(turned_rad)
            assert any(abs(bearings[-1] - start_rad) < 1e-3 for start_rad in began)
    assert len(bearings) > 5


@settings(max_examples=30, deadline=None)
@given(
    recorded_radps=st.floats(-0.4, 0.4), heading_rad=st.floats(-3.1, 3.1), now_radps=st.floats(-0.4, 0.4),
    aside_m=st.floats(-8.0, 8.0),
)  # fmt: skip
def test_what_deceived_a_camera_stays_by_the_road_whatever_bend_it_was_recorded_in(
    recorded_radps: float, heading_rad: float, now_radps: float, aside_m: float
) -> None:
    """It was drawn as if it stood infinitely far away: seen from a bend, it walked into the lane of who drove straight on."""
    lens = Lens(CAMERAS["front"])
    ahead_m, step_m = 50.0, 1.2

    def stray(k: int, at: Way) -> Stray:
        x_m, y_m = _from(at, ahead_m, aside_m)
        (u0, foot), (_, top) = lens.pixel(x_m, y_m + 0.3, 0.0), lens.pixel(x_m, y_m, 1.75)
        u1 = lens.pixel(x_m, y_m - 0.3, 0.0)[0]
        box = Box(
            x0_px=u0, y0_px=top, x1_px=u1, y1_px=foot, kind="pedestrian", score=0.6,
            range_m=lens.depth_m(x_m, lens.camera.z_m), range_source="lidar",
        )  # fmt: skip
        return Stray("front", NS + k * NS // 10, box, 12.0, heading_rad + at.heading_rad, "open")

    recorded = [Way()]
    for k in range(1, 8):
        recorded.append(recorded[-1].on(step_m, 0.1 * k * recorded_radps))
    strays = [stray(k, at) for k, at in enumerate(recorded)]
    paces = clutter([strays], "front", {"open": [0.0, 0.0, 1.0, 0.0, 0.0]})
    assert [len(each.boxes) for each in paces["open"][2].ghosts] == [8], "one, however quickly the ego turned"
    often = tuple(msgspec.structs.replace(each, per_minute=30.0) for each in paces["open"])
    eye = Eye(msgspec.structs.replace(read_card(data(CARD)), clutter={"front": {"open": often}}), "front", 1)
    way, seen = Way(heading_rad=heading_rad - 1.0), 0
    places: list[tuple[float, float]] = []
    for k in range(100):
        way = way.on(step_m, heading_rad - 1.0 + 0.1 * k * now_radps) if k else way
        told = msgspec.structs.replace(truth(k / 10), speed_mps=12.0, heading_rad=way.heading_rad)
        found = eye.look(told, NS + k * NS // 10)
        c, s = math.cos(way.heading_rad), math.sin(way.heading_rad)
        places.append((way.x_m + ahead_m * c - aside_m * s, way.y_m + ahead_m * s + aside_m * c))
        for each in found:
            middle = (each.detection.x0_px + each.detection.x1_px) / 2
            bearing_rad = -math.atan((middle - 320.0) / lens.focal_px)
            seen += 1
            assert any(
                abs(bearing_rad - math.atan2(y, x - lens.camera.x_m)) < 0.004
                for x, y in (_from(way, *place) for place in places[-len(strays) :])
            )
    assert seen > 5


def _from(at: Way, x_m: float, y_m: float) -> tuple[float, float]:
    """What stands at a place of the ground, ahead and to the left of who is there."""
    dx, dy, c, s = x_m - at.x_m, y_m - at.y_m, math.cos(at.heading_rad), math.sin(at.heading_rad)
    return dx * c + dy * s, dy * c - dx * s


def _post(depth_m: float) -> Box:
    middle, high = 320.0 + 1200.0 / depth_m, 600.0 / depth_m
    return Box(
        x0_px=middle - 0.2 * high, y0_px=190.0 - high, x1_px=middle + 0.2 * high, y1_px=190.0,
        kind="pedestrian", score=0.6,
    )  # fmt: skip
