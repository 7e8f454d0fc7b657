"""Who was in the way and is nowhere now bounds the target for a while; who is far away is not shouted about."""

from collections.abc import Sequence

import pytest
from hypothesis import given
from hypothesis import strategies as st

from proto.perception import Track
from tests.unit.services.orchestrator.support import FEW, Drive, actor


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


def test_an_actor_that_is_seen_to_leave_the_path_is_not_missed() -> None:
    drive = behind(actor(8.0, 0.0))
    before_mps = drive.target_mps
    drive.tracks = (actor(8.0, 0.0, y_m=5.0, in_ego_path=False),)
    assert next_mps(drive) > before_mps + 1.0
    drive.tracks = ()
    assert next_mps(drive) > before_mps + 1.0


@pytest.mark.parametrize(("gap_m", "speed_mps", "told"), [(90.0, 8.0, False), (60.0, 30.0, True)])
def test_a_person_far_away_is_spoken_of_only_where_it_is_urgent(gap_m: float, speed_mps: float, told: bool) -> None:
    drive = behind(person(gap_m, vx_mps=-speed_mps), speed_mps=speed_mps)
    assert any("person" in text for text in drive.spoken()) is told


@pytest.mark.parametrize("hardly", [{"age_s": 0.3}, {"confidence": 0.3}])
def test_an_actor_that_was_hardly_seen_is_not_missed(hardly: dict[str, float]) -> None:
    drive = behind(actor(8.0, 0.0, **hardly))
    before_mps = drive.target_mps
    drive.tracks = ()
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


@pytest.mark.parametrize("who", [doubted(0, confidence=0.7), doubted(0, first_m=30.0)])
def test_a_person_who_is_certain_or_near_is_braked_for_at_once(who: Track) -> None:
    assert warned_after(behind(speed_mps=17.0), [(who,)]) == 0


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
