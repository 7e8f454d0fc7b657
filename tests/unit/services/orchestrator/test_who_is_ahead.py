"""Who was in the way and is nowhere now bounds the target for a while; who is far away is not shouted about."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from proto.perception import Track
from tests.unit.services.orchestrator.support import FEW, Drive, actor


def person(gap_m: float, **fields: object) -> Track:
    return actor(gap_m, 8.0, **{"kind": "pedestrian", "length_m": 0.5, "x_m": gap_m + 2.5, **fields})


def next_mps(drive: Drive) -> float:
    drive.tick()
    return drive.target_mps


def behind(*tracks: Track, speed_mps: float = 8.0) -> Drive:
    drive = Drive(speed_mps=speed_mps)
    drive.tracks = tracks
    drive.ticks(5)
    return drive


@pytest.mark.parametrize("who", [actor(8.0, 0.0), person(15.0)])
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
    st.lists(st.tuples(st.floats(3.0, 60.0), st.floats(-3.0, 8.0)), min_size=1, max_size=4),
    st.lists(st.booleans(), min_size=4, max_size=4),
)
def test_no_actor_that_vanishes_raises_the_target(found: list[tuple[float, float]], kept: list[bool]) -> None:
    tracks = tuple(actor(gap, closing, track_id=n) for n, (gap, closing) in enumerate(found, 1))
    drive = behind(*tracks)
    before_mps = drive.target_mps
    drive.tracks = tuple(track for track, stays in zip(tracks, kept, strict=False) if stays)
    for _ in range(10):
        assert next_mps(drive) <= before_mps + 1e-6
