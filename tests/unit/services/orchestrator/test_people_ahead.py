"""People before us: who is told of, and who is not."""

import math

import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from proto.messages import Kind
from proto.perception import Track
from proto.speech import Memory, News, Spoken, Warned
from services.orchestrator.speech.candidates.candidates import candidates
from services.orchestrator.state import State
from services.orchestrator.target.target import target
from services.orchestrator.world.actors import crosses
from tests.unit.services.orchestrator.judge import arbiter
from tests.unit.services.orchestrator.near import car, hazards, observed, seen
from tests.unit.services.orchestrator.support import START, Drive, Played, actor, replace


def test_a_ghost_before_a_person_does_not_silence_the_warning() -> None:
    person = car(18.0, -12.0, kind="pedestrian", length_m=0.5)
    ghost = replace(person, track_id=2, x_m=14.0, confidence=0.2, age_s=0.1, sigma_vx_mps=8.0)
    assert hazards(seen(person)) == {"person"}
    assert hazards(seen(person, ghost)) == {"person"}


def test_the_most_urgent_person_is_warned_of_and_not_the_nearest() -> None:
    walker = car(30.0, -0.5, kind="pedestrian", length_m=0.5)
    rider = car(34.0, -20.0, 2, kind="cyclist", length_m=1.8)
    state = seen(walker, rider, speed_mps=3.0)
    told = next(m for m in candidates(state, target(state), ()) if m.topic == "person")
    assert (told.news.track_id, told.urgency) == (2, "alarm")


STANDER = car(25.0, -3.0, kind="pedestrian", length_m=0.5)


def words_on_a_person(state: State, *, told_s: float | None = None, braking_mps2: float | None = None) -> set[str]:
    """How urgently, after a word on a person so long ago, while the ego slows down by so much."""
    ego = replace(state.world.ego, acceleration_mps2=None if braking_mps2 is None else observed(-braking_mps2))
    spoken = (
        ()
        if told_s is None
        else (Spoken(kind=Kind.PERSON, news=News(what="warning", track_id=9), stamp_ns=START - round(told_s * 1e9)),)
    )
    state = replace(state, world=replace(state.world, ego=ego), memory=Memory(spoken=spoken))
    return {m.urgency for m in candidates(state, target(state), ()) if m.topic == "person"}


@given(st.floats(0.0, 30.0), st.floats(4.0, 100.0))
def test_a_person_for_whom_comfortable_braking_is_enough_lowers_the_target_alone(ego_mps: float, x_m: float) -> None:
    state = seen(replace(STANDER, x_m=x_m, vx_mps=-ego_mps), speed_mps=ego_mps)
    gap_m = x_m - 0.25 - 2.25
    comfortable = ego_mps**2 <= 2.0 * 1.5 * max(0.5, gap_m - 1.0) and gap_m > 4.0 * ego_mps
    assert (words_on_a_person(state) == set()) is comfortable
    assert target(state).mps <= target(seen(speed_mps=ego_mps)).mps


@given(st.floats(4.0, 60.0), st.floats(0.0, 20.0), st.floats(-3.0, 9.0), st.floats(0.0, 9.0))
def test_neither_standing_nor_braking_silences_a_warning_of_a_person(
    x_m: float, closing_mps: float, braking_mps2: float, told_s: float
) -> None:
    for ego_mps in (0.0, 10.0):
        state = seen(replace(STANDER, x_m=x_m, vx_mps=-closing_mps), speed_mps=ego_mps)
        before = words_on_a_person(state)
        assert (words_on_a_person(state, told_s=told_s, braking_mps2=braking_mps2) == set()) is (before == set())


@given(st.floats(6.0, 40.0), st.floats(-3.0, 9.0) | st.none(), st.floats(0.0, 30.0) | st.none())
def test_who_was_told_of_a_person_and_brakes_enough_for_this_one_hears_no_alarm(
    x_m: float, braking_mps2: float | None, told_s: float | None
) -> None:
    state = seen(replace(STANDER, x_m=x_m, vx_mps=-14.0), speed_mps=14.0)
    gap_m = x_m - 0.25 - 2.25
    needed_mps2 = 14.0**2 / (2.0 * (gap_m - 1.0))
    told = told_s is not None and told_s < 10.0
    heeds = told and braking_mps2 is not None and braking_mps2 >= needed_mps2
    soon_s = 2.0 if told else 2.8
    urgency = "alarm" if gap_m < soon_s * 14.0 and not heeds else "warning"
    assert words_on_a_person(state, told_s=told_s, braking_mps2=braking_mps2) == {urgency}


def test_a_person_whom_the_arbiter_told_of_by_itself_was_told_of() -> None:
    warned = Warned(hazard="pedestrian", stamp_ns=START - 200_000_000, alarm=False)
    told = Memory(hazards=(warned,))
    for memory, ttc_s, urgency in ((Memory(), 2.6, "alarm"), (told, 2.6, "warning"), (told, 1.9, "alarm")):
        state = seen(replace(STANDER, x_m=14.0 * ttc_s + 2.5, vx_mps=-14.0), speed_mps=14.0)
        state = replace(state, memory=memory)
        assert {m.urgency for m in candidates(state, target(state), ()) if m.topic == "person"} == {urgency}


def test_a_person_seen_again_is_told_of_at_once() -> None:
    assert hazards(seen(replace(STANDER, x_m=15.0, vx_mps=-10.0, steady_s=0.0), speed_mps=10.0)) != set()


def test_one_that_crosses_is_a_hazard_while_there_is_room() -> None:
    assert "lead" in hazards(seen(car(30.0, -13.0, clearance_m=5.0, vy_mps=6.0)))


def walker(y_m: float, vy_mps: float, confidence: float) -> Track:
    return car(
        40.0, -15.0, kind="pedestrian", length_m=0.5, y_m=y_m, vy_mps=vy_mps, confidence=confidence, in_ego_path=False
    )


def test_who_surely_walks_to_the_road_is_told_of_three_seconds_before() -> None:
    assert crosses(walker(5.5, -1.4, 0.8)), "in the way in 2.9 s"
    assert not crosses(walker(5.5, -1.4, 0.6)), "a doubted one is waited for"
    assert not crosses(walker(4.0, -0.9, 0.8)), "who only sways is not walking"
    assert not crosses(walker(5.5, 1.4, 0.8)), "he walks away"
    new = replace(walker(5.5, -1.4, 0.8), age_s=0.4)
    assert not crosses(new), "where he was a second ago nobody knows: a post's range before a person made one walk"


@given(st.floats(-4.2, 4.2), st.floats(1.4, 3.0), st.floats(0.15, 1.0), st.floats(0.0, 1.0))
def test_who_is_two_seconds_from_the_path_is_told_of_however_new(
    y_m: float, speed_mps: float, confidence: float, age_s: float
) -> None:
    track = walker(y_m, -math.copysign(speed_mps, y_m), confidence)
    assert y_m == 0.0 or crosses(replace(track, age_s=age_s))


def test_in_a_bend_who_crosses_is_told_by_the_way_that_our_lane_takes() -> None:
    outside = walker(0.3, -0.55, 0.8)
    assert crosses(outside), "straight ahead, as far as anybody knows"
    assert not crosses(replace(outside, clearance_m=4.6)), "he stands outside the bend"
    inside = walker(8.0, -0.8, 0.8)
    assert not crosses(inside)
    for vy_mps in (0.8, -0.8):
        assert crosses(replace(inside, clearance_m=1.0, vy_mps=vy_mps)), (
            "the lane leads there; to which side is not told"
        )


@given(st.floats(-12.0, 12.0), st.floats(-3.0, 3.0), st.floats(0.15, 1.0))
def test_on_a_straight_road_the_way_of_our_lane_changes_nothing(y_m: float, vy_mps: float, confidence: float) -> None:
    plain = walker(y_m, vy_mps, confidence)
    room_m = abs(y_m) - (1.9 + plain.width_m) / 2.0
    assume(abs(room_m) > 1e-6)
    assert crosses(replace(plain, clearance_m=room_m)) == crosses(plain)


@given(st.floats(-12.0, 12.0), st.floats(-3.0, 3.0), st.floats(0.15, 1.0), st.floats(0.0, 0.85))
def test_who_is_surer_crosses_no_less(y_m: float, vy_mps: float, confidence: float, more: float) -> None:
    surer = min(1.0, confidence + more)
    assert crosses(walker(y_m, vy_mps, surer)) >= crosses(walker(y_m, vy_mps, confidence))


@pytest.mark.parametrize("others", [0, 25, 60])
def test_a_crowd_of_ghosts_keeps_no_warning_of_a_person_waiting(others: int) -> None:
    drive = Drive(Played(arbiter=arbiter()), speed_mps=12.0)
    drive.ticks(10)
    hazards = []
    for at in range(4):
        gap_m, age_s = 30.0 - 1.2 * at, 0.4 + 0.1 * at
        fields = {"kind": "pedestrian", "length_m": 0.6, "age_s": age_s}
        ghosts = tuple(
            actor(gap_m + 20.0 + number, 12.0, track_id=10 + number, confidence=0.2, **fields)
            for number in range(others)
        )
        drive.tracks = (actor(gap_m, 12.0, track_id=1, confidence=0.6, **fields), *ghosts)
        hazards.append(drive.tick().fused.hazard)
    assert hazards == ["", "", "pedestrian", "pedestrian"]


def test_a_row_of_vehicles_far_ahead_keeps_no_person_from_the_arbiter() -> None:
    drive = Drive(Played(arbiter=arbiter()), speed_mps=12.0)
    people = tuple(
        actor(gap_m, 12.0, kind="pedestrian", track_id=number, length_m=0.6) for number, gap_m in ((1, 10.0), (2, 12.0))
    )
    drive.tracks = (*people, *(actor(40.0 + 6.0 * number, 5.0, track_id=20 + number) for number in range(10)))
    drive.tick()
    asked = drive.ask.requests[-1]
    assert {1, 2} <= {track.track_id for track in (asked.pedestrian, *asked.others) if track is not None}
