"""Who was in the way and is nowhere now bounds the target for a while; who is far away is not shouted about."""

from collections.abc import Sequence

import pytest
from hypothesis import given
from hypothesis import strategies as st

from domain.ego_speed import CHANGE_MPS2, JITTER_MPS
from proto.perception import Track
from services.orchestrator.target.lost import RISES_MPS2
from services.orchestrator.world.actors import FLOOR
from tests.safety import safety
from tests.unit.services.orchestrator.judge import arbiter
from tests.unit.services.orchestrator.support import FEW, SECOND, Drive, Played, actor, replace


def person(gap_m: float, **fields: object) -> Track:
    return actor(gap_m, 8.0, **{"kind": "pedestrian", "length_m": 0.5, "x_m": gap_m + 2.5, **fields})


def cyclist(gap_m: float, closing_mps: float) -> Track:
    return actor(gap_m, closing_mps, kind="cyclist", length_m=1.8, width_m=0.6, x_m=gap_m + 3.15)


kinds = st.sampled_from(["vehicle", "pedestrian", "cyclist"])


def next_mps(drive: Drive) -> float:
    drive.tick()
    return drive.target_mps


def behind(*tracks: Track, speed_mps: float = 8.0) -> Drive:
    drive = Drive(speed_mps=speed_mps)
    drive.tracks = tracks
    drive.ticks(5)
    return drive


@pytest.mark.parametrize("who", [actor(8.0, 0.0), person(15.0), cyclist(14.0, 1.0)])
def test_an_actor_that_vanishes_lifts_nothing_for_three_seconds(who: Track) -> None:
    drive = behind(who)
    before_mps = drive.target_mps
    drive.tracks = ()
    for _ in range(29):
        assert next_mps(drive) == pytest.approx(before_mps)
    drive.ticks(5)
    assert drive.target_mps > before_mps + 1.0


@pytest.mark.parametrize("blind_ticks", [1, 40, 100])
@pytest.mark.parametrize("who", [actor(8.0, 0.0), person(15.0), cyclist(14.0, 1.0)])
def test_the_time_of_a_blindness_does_not_count(who: Track, blind_ticks: int) -> None:
    """A perception that comes back sees nothing at first."""
    drive = behind(who)
    before_mps = drive.target_mps
    drive.tracks = None
    for _ in range(blind_ticks):
        assert next_mps(drive) <= before_mps + 1e-6
    drive.tracks = ()
    for _ in range(28):
        assert next_mps(drive) == pytest.approx(before_mps)
    drive.ticks(5)
    assert drive.target_mps > before_mps + 1.0


def test_a_clock_that_leaps_ahead_frees_of_no_actor() -> None:
    drive = behind(actor(8.0, 0.0))
    before_mps = drive.target_mps
    drive.tracks = ()
    drive.now_ns += 3600 * SECOND
    for _ in range(19):
        assert next_mps(drive) <= before_mps + 1e-6


def test_an_actor_that_is_seen_beside_the_path_for_half_a_second_is_not_missed() -> None:
    drive = behind(actor(8.0, 0.0))
    before_mps = drive.target_mps
    drive.tracks = (actor(8.0, 0.0, y_m=5.0, in_ego_path=False),)
    for _ in range(5):
        assert next_mps(drive) == pytest.approx(before_mps)
    assert next_mps(drive) > before_mps + 1.0
    drive.tracks = ()
    assert next_mps(drive) > before_mps + 1.0


def test_a_lead_that_really_drives_off_is_followed_after_half_a_second() -> None:
    drive = behind(actor(8.0, 0.0))
    before_mps = drive.target_mps
    drive.tracks = (actor(16.0, -1.0),)
    drive.ticks(5)
    assert drive.target_mps < before_mps + 2.0
    drive.ticks(2)
    assert drive.target_mps > before_mps + 2.0


@pytest.mark.parametrize("kind", ["vehicle", "pedestrian"])
@pytest.mark.parametrize("sure", [0.9, 0.15])
def test_a_confidence_that_sinks_below_the_floor_lifts_nothing(kind: str, sure: float) -> None:
    who = actor(8.0, 0.0, kind=kind, confidence=sure)
    drive = behind(who)
    before_mps = drive.target_mps
    drive.tracks = (replace(who, confidence=0.149),)
    for _ in range(5):
        assert next_mps(drive) == pytest.approx(before_mps)


@pytest.mark.parametrize(("gap_m", "speed_mps", "told"), [(90.0, 8.0, False), (60.0, 30.0, True)])
def test_a_person_far_away_is_spoken_of_only_where_it_is_urgent(gap_m: float, speed_mps: float, told: bool) -> None:
    drive = behind(person(gap_m, vx_mps=-speed_mps), speed_mps=speed_mps)
    assert any("person" in text.lower() for text in drive.spoken()) is told


@pytest.mark.parametrize("hardly", [{"age_s": 0.3}, {"confidence": 0.3}])
def test_an_actor_that_was_hardly_seen_is_missed_for_half_a_second(hardly: dict[str, float]) -> None:
    drive = behind(actor(8.0, 0.0, **hardly))
    before_mps = drive.target_mps
    drive.tracks = ()
    for _ in range(5):
        assert next_mps(drive) == pytest.approx(before_mps)
    assert next_mps(drive) > before_mps + 1.0


@FEW
@given(
    st.lists(st.tuples(st.floats(3.0, 60.0), st.floats(-3.0, 8.0), kinds), min_size=1, max_size=4),
    st.lists(st.booleans(), min_size=4, max_size=4),
)
def test_no_actor_that_vanishes_raises_the_target(found: list[tuple[float, float, str]], kept: list[bool]) -> None:
    tracks = tuple(actor(gap, closing, kind=kind, track_id=n) for n, (gap, closing, kind) in enumerate(found, 1))
    drive = behind(*tracks)
    before_mps = drive.target_mps
    drive.tracks = tuple(track for track, stays in zip(tracks, kept, strict=False) if stays)
    for _ in range(10):
        assert next_mps(drive) <= before_mps + 1e-6


anything = st.floats(-1e3, 1e3) | st.floats(allow_nan=True, allow_infinity=True)


@st.composite
def doubts(draw: st.DrawFn, track: Track) -> tuple[Track, ...]:
    """What may be told of an actor in the ticks after it was seen in the way: anything, or nothing."""
    told = draw(st.sampled_from(["nothing", "faded", "leapt", "no lane", "renumbered", "other kind", "all"]))
    if told == "nothing":
        return ()
    if told in ("faded", "all"):
        track = replace(track, confidence=draw(st.floats(0.0, FLOOR)))
    if told in ("leapt", "all"):
        track = replace(track, x_m=draw(anything), vx_mps=draw(anything), y_m=draw(anything), vy_mps=draw(anything))
        track = replace(track, oncoming=draw(st.booleans()), clearance_m=draw(st.none() | anything))
    if told in ("no lane", "all"):
        track = replace(track, in_ego_path=False)
    if told in ("renumbered", "all"):
        track = replace(track, track_id=draw(st.integers(-3, 99)))
    if told in ("other kind", "all"):
        track = replace(track, kind=draw(kinds))
    return (track,)


@safety(few=100)
@given(
    found=st.tuples(st.floats(0.5, 60.0), st.floats(-20.0, 30.0), kinds, st.floats(FLOOR, 1.0), st.floats(0.0, 3.0)),
    ego_mps=st.floats(0.0, 40.0),
    data=st.data(),
)
def test_no_doubt_of_an_actor_raises_the_target_within_half_a_second(
    found: tuple[float, float, str, float, float], ego_mps: float, data: st.DataObject
) -> None:
    gap_m, closing_mps, kind, confidence, age_s = found
    track = actor(gap_m, closing_mps, kind=kind, confidence=confidence, age_s=age_s)
    drive = behind(track, speed_mps=ego_mps)
    before_mps = drive.target_mps
    for tick in range(1, 5):
        drive.tracks = data.draw(doubts(track))
        assert next_mps(drive) <= before_mps + RISES_MPS2 * 0.1 * tick + 1e-6


@safety(few=25)
@given(
    found=st.tuples(st.floats(0.5, 60.0), st.floats(-20.0, 30.0), kinds, st.floats(0.5, 1.0)),
    doubted=st.lists(st.none() | st.tuples(st.floats(0.0, 0.149), anything), min_size=1, max_size=29),
)
def test_an_actor_that_was_seen_well_bounds_for_three_seconds_however_it_fades(
    found: tuple[float, float, str, float], doubted: list[tuple[float, float] | None]
) -> None:
    gap_m, closing_mps, kind, confidence = found
    track = actor(gap_m, closing_mps, kind=kind, confidence=confidence)
    drive = behind(track)
    before_mps = drive.target_mps
    for each in doubted:
        drive.tracks = () if each is None else (replace(track, confidence=each[0], x_m=each[1]),)
        assert next_mps(drive) <= before_mps + 1e-6


@safety(few=50)
@given(
    st.floats(1.0, 40.0),
    st.lists(st.floats(allow_nan=True, allow_infinity=True) | st.floats(-200.0, 200.0), min_size=1, max_size=9),
    st.tuples(st.floats(3.0, 60.0), st.floats(-5.0, 20.0), kinds),
)
def test_no_leap_of_the_egos_speed_raises_the_target(
    ego_mps: float, told: list[float], found: tuple[float, float, str]
) -> None:
    gap_m, closing_mps, kind = found
    drive = behind(actor(gap_m, closing_mps, kind=kind), speed_mps=ego_mps)
    before_mps = drive.target_mps
    for tick, mps in enumerate(told, 1):
        if abs(mps - ego_mps) <= JITTER_MPS + CHANGE_MPS2 * 0.1 * tick:
            continue  # no leap: a car can do so
        drive.speed_mps = mps
        assert next_mps(drive) <= before_mps + 1e-6
        ego = drive.history[-1][2].world.ego.speed_mps
        assert ego is None or ego.value == ego_mps


def test_a_speed_that_stands_is_believed_in_the_end() -> None:
    drive = Drive(speed_mps=10.0)
    drive.speed_mps = 30.0
    assert drive.ticks(10).world.ego.speed_mps is None
    ego = drive.ticks(5).world.ego.speed_mps
    assert ego is not None
    assert ego.value == 30.0


def warned_after(drive: Drive, ticks: Sequence[tuple[Track, ...]]) -> int | None:
    """In which of these ticks the person is first braked for aloud; None: in none."""
    for number, tracks in enumerate(ticks):
        drive.tracks = tracks
        if drive.tick().advisory.hazard == "pedestrian":
            return number
    return None


def doubted(number: int, confidence: float = 0.55, first_m: float = 60.0) -> Track:
    """A person who stands, as seen from 17 m/s in that tick."""
    gap_m = first_m - 1.7 * number
    return person(gap_m, vx_mps=-17.0, confidence=confidence, age_s=0.4 + 0.1 * number, sigma_vx_mps=1.5)


@pytest.mark.parametrize("seen", [[True], [True, True], [True, False, True], [True] + [False] * 7 + [True, True]])
def test_a_doubted_person_seen_in_a_tick_or_two_lowers_the_target_and_is_not_shouted_about(seen: list[bool]) -> None:
    drive = Drive(speed_mps=17.0, road="rural")
    free_mps = next_mps(drive)
    ticks = [(doubted(number, 0.55 if well else 0.4),) for number, well in enumerate(seen)]
    assert warned_after(drive, ticks) is None
    assert drive.target_mps < free_mps - 5.0


@pytest.mark.parametrize(("seen", "after"), [([True] * 3, 2), ([True, False] * 3, 4), ([True, True, False, True], 3)])
def test_a_doubted_person_is_braked_for_at_the_third_look(seen: list[bool], after: int) -> None:
    ticks = [(doubted(number, 0.55 if well else 0.4),) for number, well in enumerate(seen)]
    assert warned_after(behind(speed_mps=17.0), ticks) == after


KNOWN_AND_NEAR = replace(doubted(0, first_m=30.0), age_s=1.0)


@pytest.mark.parametrize("who", [doubted(0, confidence=0.7), doubted(0, 0.7, first_m=30.0), KNOWN_AND_NEAR])
def test_a_person_who_is_certain_or_known_and_near_is_braked_for_at_once(who: Track) -> None:
    assert warned_after(behind(speed_mps=17.0), [(who,)]) == 0


def test_an_alarm_of_a_new_and_doubted_person_waits_for_the_third_look_while_the_target_sinks() -> None:
    drive = Drive(speed_mps=17.0, road="rural")
    free_mps = next_mps(drive)
    looks = [(doubted(number, first_m=30.0),) for number in range(3)]
    assert warned_after(drive, looks[:1]) is None
    assert drive.target_mps < free_mps - 5.0
    assert warned_after(drive, looks[1:]) == 1
    assert drive.history[-1][2].fused.urgency == "alarm"


@safety(few=25)
@given(st.floats(0.45, 0.699), st.floats(4.0, 33.0), st.floats(0.3, 0.8), st.integers(1, 2))
def test_a_ghost_of_one_picture_or_two_alarms_nobody(
    confidence: float, gap_m: float, age_s: float, pictures: int
) -> None:
    drive = Drive(Played(arbiter=arbiter()), speed_mps=17.0)
    ticks: list[tuple[Track, ...]] = [
        (person(gap_m - 1.7 * number, vx_mps=-17.0, confidence=confidence, age_s=age_s + 0.1 * number),)
        for number in range(pictures)
    ]
    assert warned_after(drive, [*ticks, (), (), ()]) is None
    assert not any("person" in text.lower() for text in drive.spoken())


@FEW
@given(st.floats(0.45, 1.0), st.floats(20.0, 60.0), st.floats(8.0, 25.0))
def test_confirming_a_person_costs_no_more_than_two_ticks(confidence: float, gap_m: float, speed_mps: float) -> None:
    def after(least: float) -> int | None:
        tracks = [
            (person(gap_m - 0.1 * speed_mps * number, vx_mps=-speed_mps, confidence=least, age_s=1.0),)
            for number in range(8)
        ]
        return warned_after(behind(speed_mps=speed_mps), tracks)

    certain, unsure = after(1.0), after(confidence)
    if certain is not None:
        assert unsure is not None
        assert unsure <= certain + 2


def test_the_arbiter_is_asked_about_all_road_users_in_the_path() -> None:
    drive = Drive(speed_mps=8.0)
    tracks = (actor(20.0, 2.0), actor(35.0, 2.0), person(12.0), person(15.0))
    drive.tracks = tuple(replace(track, track_id=number) for number, track in enumerate(tracks))
    asked = drive.tick().request
    assert asked.lead is not None
    assert asked.pedestrian is not None
    assert {each.track_id for each in (asked.lead, asked.pedestrian, *asked.others)} == {0, 1, 2, 3}


@pytest.mark.parametrize("looks", [1, 2, 3, 4])
def test_an_oncoming_car_that_seems_to_drift_is_told_of_once_three_pictures_show_it_in_the_way(looks: int) -> None:
    drive = Drive(Played(arbiter=arbiter()), speed_mps=11.6)
    drifts = {"oncoming": True, "vy_mps": -1.1, "sigma_vy_mps": 0.95, "confidence": 0.75}
    for tick in range(9 + looks):
        in_it = tick >= 9
        gap_m, room_m = 80.0 - 3.5 * tick, -0.7 if in_it else 0.4
        drive.tracks = (actor(gap_m, 35.0, y_m=1.2 if in_it else 2.3, clearance_m=room_m, in_ego_path=in_it, **drifts),)
        drive.tick()
    assert bool(drive.spoken()) is (looks >= 3)
