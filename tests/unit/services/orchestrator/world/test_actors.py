"""Every actor counts: none stands for all, and none hides another."""

from typing import Any

import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from domain import kinematics
from domain.ego_speed import Believed
from proto.perception import Track
from services.orchestrator.speech.candidates.candidates import candidates
from services.orchestrator.state import GapSeen
from services.orchestrator.target.target import target
from tests.unit.services.orchestrator.near import car, hazards, observed, seen
from tests.unit.services.orchestrator.support import START, replace

LEAD = car(8.0, -5.0)


@pytest.mark.parametrize(
    "other",
    [
        car(40.0, -30.0, 2, oncoming=True),
        car(90.0, -10.0, 2),
        car(8.5, -5.0, 2, confidence=0.2, age_s=0.1),
        car(6.0, -2.0, 2, oncoming=True, sigma_vx_mps=8.0),
    ],
)
@pytest.mark.parametrize("closing_mps", [0.0, 3.0, 5.0])
def test_another_car_frees_nobody_from_the_one_ahead(other: Track, closing_mps: float) -> None:
    alone = seen(replace(LEAD, vx_mps=-closing_mps))
    both = seen(replace(LEAD, vx_mps=-closing_mps), other)
    assert any(bound.why == "lead" for bound in target(alone).bounds)
    assert target(both).mps <= target(alone).mps
    assert hazards(both) >= hazards(alone)


@given(st.floats(4.6, 120.0), st.floats(0.0, 20.0), st.floats(0.0, 20.0), st.floats(0.0, 0.1))
def test_who_is_followed_a_little_farther_away_lifts_the_target_a_little(
    x_m: float, lead_mps: float, ego_mps: float, more_m: float
) -> None:
    near, far = (target(seen(car(each, lead_mps - ego_mps), speed_mps=ego_mps)).mps for each in (x_m, x_m + more_m))
    assert near <= far + 1e-9
    assert far - near <= more_m


def test_nobody_is_to_speed_up_right_behind_a_car_that_crawls() -> None:
    crawling = seen(car(11.35, -0.86, length_m=5.6), speed_mps=3.06)
    assert target(crawling).mps < 4.0


distances, speeds = st.floats(-5.0, 60.0), st.floats(-40.0, 10.0)


@st.composite
def actors(draw: st.DrawFn) -> tuple[Track, ...]:
    """Cars, riders and people, seen well or badly."""
    return tuple(
        car(
            draw(distances),
            draw(speeds),
            track_id,
            kind=draw(st.sampled_from(("vehicle", "vehicle", "pedestrian", "cyclist"))),
            y_m=draw(st.floats(-6.0, 6.0)),
            vy_mps=draw(st.floats(-3.0, 3.0)),
            oncoming=draw(st.booleans()),
            in_ego_path=draw(st.booleans()),
            confidence=draw(st.floats(0.0, 1.0)),
            age_s=draw(st.floats(0.0, 3.0)),
            unseen_s=draw(st.sampled_from((0.0, 0.5))),
            sigma_vx_mps=draw(st.floats(0.0, 5.0)),
        )
        for track_id in range(draw(st.integers(1, 5)))
    )


CRAWLING_MPS = 5.0

crawling = st.floats(1.0, CRAWLING_MPS, exclude_max=True)


def surely_next(track: Track) -> bool:
    """Whether a vehicle is certainly in the path before the bumper: the one thing that may hide another, for who crawls."""
    sure = track.confidence >= 0.7 and track.age_s >= 1.0 and track.unseen_s <= 0.3 and track.sigma_vx_mps <= 3.0
    return sure and track.kind != "pedestrian" and track.in_ego_path and track.x_m > 4.5


@settings(max_examples=300, deadline=None)
@given(tracks=actors(), speed_mps=st.none() | st.floats(0.0, 35.0) | crawling)
def test_an_actor_more_never_raises_the_target_and_removes_no_hazard_but_behind_the_next_car_of_a_queue(
    tracks: tuple[Track, ...], speed_mps: float | None
) -> None:
    fewer, more = seen(*tracks[1:], speed_mps=speed_mps), seen(*tracks, speed_mps=speed_mps)
    assert target(more).mps <= target(fewer).mps + 1e-9
    lost = hazards(fewer) - hazards(more)
    crawls = speed_mps is not None and speed_mps < CRAWLING_MPS
    assert not lost or (lost == {"lead"} and crawls and surely_next(tracks[0]))


@settings(max_examples=300, deadline=None)
@given(speed_mps=crawling, beyond_m=st.floats(0.0, 1.9), closing_mps=st.floats(1.0, 9.0))
def test_the_next_car_of_a_queue_hides_nobody_beside_or_before_it(
    speed_mps: float, beyond_m: float, closing_mps: float
) -> None:
    other = car(9.0, -closing_mps, 2)
    alone, both = seen(other, speed_mps=speed_mps), seen(car(9.0 - beyond_m, 0.0), other, speed_mps=speed_mps)
    assert hazards(both) >= hazards(alone)


@pytest.mark.parametrize(
    "doubted",
    [
        {"x_m": 0.5}, {"x_m": 4.5}, {"confidence": 0.69}, {"age_s": 0.9}, {"unseen_s": 0.4}, {"sigma_vx_mps": 4.0},
        {"in_ego_path": False},
    ],
)  # fmt: skip
def test_a_car_that_may_not_be_before_us_hides_nobody_in_a_queue(doubted: dict[str, object]) -> None:
    other = car(14.0, -6.0, 2)
    assert hazards(seen(car(8.0, 0.0), other, speed_mps=3.0)) == set()
    assert hazards(seen(replace(car(8.0, 0.0), **doubted), other, speed_mps=3.0)) == {"lead"}


@given(x_m=st.floats(5.0, 60.0), clearance_m=st.floats(0.01, 0.24), ego_mps=st.floats(3.0, 30.0))
def test_a_parked_car_that_leaves_room_lowers_the_target_like_any_and_is_no_hazard(
    x_m: float, clearance_m: float, ego_mps: float
) -> None:
    parked = car(x_m, -ego_mps, y_m=-2.0, clearance_m=clearance_m)
    assert hazards(seen(parked, speed_mps=ego_mps)) == set()
    in_the_way = replace(parked, clearance_m=-0.5)
    assert target(seen(parked, speed_mps=ego_mps)) == target(seen(in_the_way, speed_mps=ego_mps))


@pytest.mark.parametrize("clearance_m", [-0.3, 0.0, None])
def test_one_that_leaves_none_or_of_which_that_is_unknown_is_a_hazard(clearance_m: float | None) -> None:
    assert "lead" in hazards(seen(car(20.0, -13.0, clearance_m=clearance_m)))


def test_one_that_cuts_in_is_a_hazard_while_there_is_room() -> None:
    assert "lead" in hazards(seen(car(12.0, -6.0, clearance_m=0.2)))


@given(x_m=st.floats(-3.0, 4.4), closing_mps=st.floats(1.5, 20.0), vy_mps=st.floats(0.0, 1.9))
def test_whose_near_end_is_beside_us_with_room_between_is_passed_and_lowers_the_target_all_the_same(
    x_m: float, closing_mps: float, vy_mps: float
) -> None:
    beside = car(x_m, -closing_mps, y_m=-2.4, vy_mps=vy_mps, clearance_m=0.4)
    assert hazards(seen(beside)) == set()
    assert target(seen(beside)).mps <= target(seen()).mps
    if x_m > 0.0:
        assert "lead" in hazards(seen(replace(beside, clearance_m=-0.1))), "it leaves no room"
        assert "lead" in hazards(seen(replace(beside, vx_mps=-13.0, vy_mps=6.0))), "it crosses"


@given(x_m=st.floats(8.0, 40.0), closing_mps=st.floats(11.0, 20.0), steady_s=st.floats(0.0, 0.299))
def test_a_vehicle_that_was_lost_or_leapt_lowers_the_target_at_once_and_is_shouted_about_like_a_new_one(
    x_m: float, closing_mps: float, steady_s: float
) -> None:
    again = car(x_m, -closing_mps, clearance_m=-1.0, steady_s=steady_s)
    watched = replace(again, steady_s=0.3)
    assert hazards(seen(again)) == set()
    assert "lead" in hazards(seen(watched))
    assert "lead" in hazards(seen(replace(again, steady_s=None)))
    assert target(seen(again)) == target(seen(watched))


@given(
    gap_m=st.floats(3.0, 30.0), beyond_m=st.floats(8.0, 40.0), speed_mps=st.floats(6.0, 40.0), closing_mps=st.floats(8.0, 40.0),
    confidence=st.floats(0.15, 1.0), age_s=st.floats(0.3, 4.0), oncoming=st.booleans(),
)  # fmt: skip
def test_what_shows_behind_the_car_before_us_lowers_the_target_and_is_shouted_about_only_where_it_surely_is(
    gap_m: float, beyond_m: float, speed_mps: float, closing_mps: float, confidence: float, age_s: float, oncoming: bool
) -> None:
    """A box on the roof of the one before us, or beside it, may be nothing."""
    before = car(gap_m + 4.5, 0.0, track_id=8)
    thing = car(
        gap_m + beyond_m + 4.5, -closing_mps, confidence=confidence, age_s=age_s, oncoming=oncoming, clearance_m=-1.0
    )
    if confidence < 0.7 or age_s < 2.0:
        assert hazards(seen(before, thing, speed_mps=speed_mps)) == set()
    assert target(seen(before, thing, speed_mps=speed_mps)).mps <= target(seen(before, speed_mps=speed_mps)).mps


def test_with_an_unknown_speed_of_our_own_nobody_counts_as_parked() -> None:
    assert "lead" in hazards(seen(car(20.0, -13.0, clearance_m=0.2), speed_mps=None))


@pytest.mark.parametrize("confidence", [0.5, 0.69, 0.7, 0.95])
@pytest.mark.parametrize("age_s", [0.5, 1.0, 2.0])
@pytest.mark.parametrize("looks", [2, 3])
def test_who_comes_towards_us_in_our_lane_is_a_hazard_once_that_is_certain_and_no_matter_of_a_look_or_two(
    confidence: float, age_s: float, looks: int
) -> None:
    coming = car(60.0, -30.0, oncoming=True, confidence=confidence, age_s=age_s, clearance_m=-1.0)
    ticks = range(looks)
    gaps = tuple(GapSeen(track_id=1, x_m=60.0 + 3.0 * ago, stamp_ns=START - ago * 10**8, well=True) for ago in ticks)
    state = replace(seen(coming), gaps=gaps)
    assert ("lead" in hazards(state)) == (confidence >= 0.7 and age_s >= 1.0 and looks >= 3)
    assert target(seen(coming)).mps <= target(seen()).mps


@given(st.floats(0.45, 0.99), st.floats(0.3, 3.0), st.floats(-9.0, 9.0), st.floats(10.0, 30.0))
def test_a_vehicle_that_is_doubted_is_told_of_once_it_is_known_and_lowers_the_target_before(
    confidence: float, age_s: float, vy_mps: float, x_m: float
) -> None:
    thing = car(x_m, -13.0, confidence=confidence, age_s=age_s, vy_mps=vy_mps)
    told = confidence >= 0.7 or age_s >= 1.0 or abs(vy_mps) >= 2.0
    assert ("lead" in hazards(seen(thing))) is told
    assert target(seen(thing)).mps < target(seen()).mps
    assert target(seen(thing)).mps == target(seen(replace(thing, confidence=0.99, age_s=3.0))).mps


ROOM = st.one_of(st.none(), st.floats(-1.0, 6.0))
"""Beside the way that our lane takes, m; None: the way is unknown."""


@given(
    st.floats(0.45, 0.99),
    st.floats(0.3, 3.0),
    st.floats(-9.0, 9.0),
    st.floats(0.0, 4.0),
    ROOM,
    st.booleans(),
    st.floats(0.0, 0.5),
    st.floats(0.0, 2.0),
    st.floats(0.0, 1.0),
)
def test_who_is_surer_or_longer_known_is_never_less_of_a_hazard(
    confidence: float,
    age_s: float,
    vy_mps: float,
    sigma_mps: float,
    clearance_m: float | None,
    oncoming: bool,
    surer: float,
    longer_s: float,
    share: float,
) -> None:
    thing = car(
        20.0, -20.0, confidence=confidence, age_s=age_s, vy_mps=vy_mps, sigma_vy_mps=sigma_mps,
        clearance_m=clearance_m, oncoming=oncoming,
    )  # fmt: skip
    surely = replace(
        thing, confidence=min(1.0, confidence + surer), age_s=age_s + longer_s, sigma_vy_mps=share * sigma_mps
    )
    assert hazards(seen(thing)) <= hazards(seen(surely))
    assert hazards(seen(thing)) <= hazards(seen(replace(thing, sigma_vy_mps=None))), (
        "what is not told makes no one silent"
    )


@given(st.floats(2.1, 9.0), st.floats(0.1, 4.0), st.sampled_from([-1.0, 1.0]), st.floats(0.45, 0.99), ROOM)
def test_who_may_only_seem_to_come_from_the_side_is_waited_for_and_lowers_the_target(
    across_mps: float, sigma_mps: float, side: float, confidence: float, clearance_m: float | None
) -> None:
    young = car(
        15.0, -13.0, confidence=confidence, age_s=0.5, vy_mps=side * across_mps, sigma_vy_mps=sigma_mps,
        clearance_m=clearance_m,
    )  # fmt: skip
    surely, aside = across_mps >= 4.0 * sigma_mps, clearance_m is not None and clearance_m > 0.0
    assert ("lead" in hazards(seen(young))) is (surely or (confidence >= 0.7 and not aside))
    assert target(seen(young)) == target(seen(replace(young, sigma_vy_mps=0.0)))


@pytest.mark.parametrize(("ego_mps", "told"), [(0.0, False), (0.9, False), (1.0, True), (None, True)])
def test_who_stands_is_not_told_to_brake_for_a_vehicle(ego_mps: float | None, told: bool) -> None:
    assert ("lead" in hazards(seen(car(8.0, -3.5), speed_mps=ego_mps))) is told


@given(ego_mps=st.floats(1.0, 6.0), gap_m=st.floats(2.5, 20.0), share=st.floats(0.0, 1.0))
def test_who_creeps_up_to_a_queue_hears_nothing_while_comfortable_braking_is_enough(
    ego_mps: float, gap_m: float, share: float
) -> None:
    closing_mps = share * ego_mps
    comfortable = closing_mps**2 <= 2.0 * 1.5 * (gap_m - 1.0)
    told = "lead" in hazards(seen(car(gap_m + 4.5, -closing_mps), speed_mps=ego_mps))
    assert not (told and comfortable)
    braking = seen(replace(car(gap_m + 4.5, -closing_mps), ax_mps2=-6.0), speed_mps=ego_mps)
    soon = closing_mps > 1.5 and gap_m / closing_mps < 2.4
    meets = kinematics.ttc_s(gap_m - 1.0, ego_mps, ego_mps - closing_mps, -1.5, -6.0) is not None
    assert not (soon and meets) or "lead" in hazards(braking), "a vehicle that brakes hard is another thing"


@pytest.mark.parametrize(("speed_mps", "warned"), [(2.2, False), (8.0, True), (None, True)])
def test_in_a_crawling_queue_the_next_car_hides_the_others_from_the_words_and_not_from_the_target(
    speed_mps: float | None, *, warned: bool
) -> None:
    behind_it = car(20.0, -9.0, 2)
    state = seen(car(10.0, 0.0), behind_it, speed_mps=speed_mps)
    assert ("lead" in hazards(state)) is warned
    alone = seen(car(10.0, 0.0), speed_mps=speed_mps)
    assert target(state).mps <= target(alone).mps


def test_in_a_crawling_queue_the_next_car_itself_is_warned_of() -> None:
    assert "lead" in hazards(seen(LEAD, car(20.0, -1.0, 2), speed_mps=4.0))


def test_a_car_that_is_hardly_seen_hides_nobody() -> None:
    assert "lead" in hazards(seen(car(10.0, 0.0, confidence=0.3), car(14.0, -6.0, 2), speed_mps=4.0))


@pytest.mark.parametrize(
    ("road", "speed_mps", "told"), [("motorway", 12.0, True), ("urban", 12.0, False), ("rural", 25.0, True)]
)
def test_the_end_of_a_queue_is_told_early_at_speed_and_at_any_speed_on_a_motorway(
    road: str, speed_mps: float, told: bool
) -> None:
    state = seen(car(60.0, -10.0), speed_mps=speed_mps)
    environment = replace(state.world.environment, road_type=observed(road))
    state = replace(state, world=replace(state.world, environment=environment))
    assert ("lead" in hazards(state)) is told


@given(
    gap_m=st.floats(3.0, 80.0),
    closing_mps=st.floats(1.0, 30.0),
    lead_brakes_mps2=st.floats(0.0, 6.0),
    braking_mps2=st.none() | st.floats(-2.0, 9.0),
)
def test_a_driver_who_brakes_as_hard_as_a_car_needs_hears_of_it_only_as_an_alarm(
    gap_m: float, closing_mps: float, lead_brakes_mps2: float, braking_mps2: float | None
) -> None:
    coming = seen(car(gap_m + 4.5, -closing_mps, ax_mps2=-lead_brakes_mps2), speed_mps=30.0)
    slows = None if braking_mps2 is None else observed(-braking_mps2)
    ego = replace(coming.world.ego, acceleration_mps2=slows)
    braking = replace(coming, world=replace(coming.world, ego=ego))
    need_mps2 = closing_mps**2 / (2.0 * max(gap_m - 1.0, 0.5)) + lead_brakes_mps2
    assert hazards(braking) <= hazards(coming)
    assert target(braking).mps <= target(coming).mps
    if gap_m / closing_mps < 2.0 or braking_mps2 is None or braking_mps2 < min(0.5, need_mps2):
        assert hazards(braking) == hazards(coming)
    elif braking_mps2 > max(0.5, need_mps2):
        assert hazards(braking) == set()


@given(
    hider_m=st.floats(6.0, 20.0),
    clearance_m=st.floats(0.01, 0.24),
    oncoming=st.booleans(),
    speed_mps=st.floats(2.0, 30.0),
    age_s=st.floats(0.3, 1.9),
)
def test_a_vehicle_that_the_ego_passes_hides_none_that_is_in_the_way(
    hider_m: float, clearance_m: float, oncoming: bool, speed_mps: float, age_s: float
) -> None:
    hider = car(
        hider_m, -speed_mps - 5.0 * oncoming, 2, y_m=-2.0, clearance_m=clearance_m, oncoming=oncoming
    )  # fmt: skip
    standing = car(4.5 + 1.0 + 2.4 * speed_mps, -speed_mps, age_s=age_s, clearance_m=-1.0)
    crossing = replace(standing, vy_mps=speed_mps + 2.1, sigma_vy_mps=0.1, y_m=-8.0, clearance_m=6.0)
    for other in (standing, crossing):
        alone, both = seen(other, speed_mps=speed_mps), seen(hider, other, speed_mps=speed_mps)
        assert hazards(both) >= hazards(alone)


@given(
    near_m=st.floats(10.0, 40.0),
    beyond_m=st.floats(2.0, 40.0),
    closing_mps=st.floats(4.0, 10.0),
    braking_mps2=st.floats(0.5, 9.0),
)
@example(near_m=25.0, beyond_m=37.0, closing_mps=10.0, braking_mps2=2.3)
def test_a_driver_who_brakes_enough_for_the_next_car_hears_of_the_one_beyond_that_needs_more(
    near_m: float, beyond_m: float, closing_mps: float, braking_mps2: float
) -> None:
    beyond = car(near_m + beyond_m + 4.5, -20.0, 2, age_s=3.0, clearance_m=-1.0)
    following = car(near_m + 4.5, -closing_mps, clearance_m=-1.0)

    def told(*tracks: Track) -> set[str]:
        state = seen(*tracks, speed_mps=20.0)
        ego = replace(state.world.ego, acceleration_mps2=observed(-braking_mps2))
        return hazards(replace(state, world=replace(state.world, ego=ego)))

    assert told(following, beyond) >= told(beyond)


@given(st.floats(5.0, 100.0), st.floats(-5.0, 20.0), st.none() | st.floats(1.0, 20.0))
def test_a_car_ahead_lowers_the_target_though_the_speed_of_our_own_is_unknown(
    x_m: float, closing_mps: float, believed_mps: float | None
) -> None:
    ahead, measured = car(x_m, -closing_mps), 20.0 if believed_mps is None else believed_mps
    known, unknown = seen(ahead, speed_mps=measured), seen(ahead, speed_mps=None)
    before = None if believed_mps is None else Believed(believed_mps, START)
    unknown = replace(unknown, held=replace(unknown.held, speed=before))
    assert target(unknown).mps <= target(known).mps + 1e-9


@pytest.mark.parametrize(("clearance_m", "told"), [(-1.85, True), (None, True), (-0.5, True), (-0.01, False)])
def test_the_end_of_a_queue_is_told_early_of_what_fills_the_lane_and_of_what_leaves_no_room_when_it_is_near(
    clearance_m: float | None, told: bool
) -> None:
    standing = car(4.5 + 6.5 * 17.2, -17.2, clearance_m=clearance_m)
    assert ("lead" in hazards(seen(standing, speed_mps=17.2))) is told
    assert "lead" in hazards(seen(replace(standing, x_m=4.5 + 3.8 * 17.2), speed_mps=17.2))
    assert target(seen(standing, speed_mps=17.2)).mps < target(seen(speed_mps=17.2)).mps


@pytest.mark.parametrize(
    ("clearance_m", "over_ground_mps", "told"), [(0.3, 2.2, False), (0.3, 3.5, True), (-0.3, 2.2, True)]
)
def test_a_parked_car_beside_the_way_whose_speed_is_measured_a_little_wrong_is_no_hazard(
    clearance_m: float, over_ground_mps: float, told: bool
) -> None:
    parked = car(8.0, over_ground_mps - 7.0, clearance_m=clearance_m, y_m=-2.5, sigma_vx_mps=0.7)
    assert ("lead" in hazards(seen(parked, speed_mps=7.0))) is told


CUTS_IN: dict[str, Any] = {"vy_mps": 2.0, "y_m": -1.5, "clearance_m": -0.4}


@pytest.mark.parametrize(
    ("road", "gap_m", "closing_mps", "fields", "told"),
    [
        ("motorway", 23.0, 5.5, {}, True),
        ("motorway", 23.0, 5.5, {"vy_mps": 0.5}, False),
        ("motorway", 23.0, 5.5, {"vy_mps": -2.0}, False),
        ("motorway", 23.0, 5.5, {"sigma_vy_mps": 0.9}, False),
        ("motorway", 23.0, 2.5, {}, False),
        ("motorway", 35.0, 5.5, {}, False),
        ("rural", 23.0, 5.5, {}, False),
    ],
)
def test_a_slower_car_that_moves_into_the_lane_of_a_motorway_before_a_driver_reacts_is_told(
    road: str, gap_m: float, closing_mps: float, fields: dict[str, Any], told: bool
) -> None:
    cutting = car(gap_m + 4.5, -closing_mps, **{**CUTS_IN, **fields})
    state = seen(cutting, speed_mps=30.0)
    environment = replace(state.world.environment, road_type=observed(road))
    state = replace(state, world=replace(state.world, environment=environment))
    found = [each for each in candidates(state, target(state), ()) if each.hazard]
    assert [each.phrase for each in found] == ["lead"] * told
    assert all(each.urgency == "warning" and each.hazard == "closing_lead" for each in found)
