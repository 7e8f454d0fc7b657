"""The arbiter's own reading: road users in the way, pedals, friction, and the ego's speed, which does not leap."""

from hypothesis import given
from hypothesis import strategies as st
from msgspec.structs import replace

from domain.ego_speed import CHANGE_MPS2, JITTER_MPS, MOST_MPS
from proto.perception import Track, Tracks
from proto.vehicle import Degradation, Ego
from proto.weather import Conditions
from services.arbiter.assessment.assess import View
from services.arbiter.assessment.reading import Latest, Pedals, believed, in_path, read
from tests.safety import safety

SECOND = 1_000_000_000
AGE_S = 0.25
WET = Conditions(
    precipitation="rain", rain_mm_h=4.0, visibility_m=None, mu_low=0.3, mu_high=0.6, risk_level="high", speed_factor=0.9,
    following_factor=1.5, confidence=0.9,
)  # fmt: skip


def told(speed_mps: float | None, at_ns: int, before: Latest | None = None) -> Latest:
    """The next reading of the car's speed, after what was believed of the one before."""
    speed = believed(before, before.ego[1]) if before is not None and before.ego is not None else None
    return Latest(ego=(Ego(speed_mps=speed_mps, acceleration_mps2=0.0, brake_pedal=0.3), at_ns), speed=speed)


def speed_mps(latest: Latest, now_ns: int) -> float | None:
    return read(latest, now_ns, AGE_S).view.ego_speed_mps


@safety(few=200)
@given(st.floats(0.0, 60.0), st.floats(allow_nan=True, allow_infinity=True) | st.floats(-200.0, 200.0))
def test_a_speed_that_leaps_is_not_believed_and_hides_no_pedal(ego_mps: float, leap_mps: float) -> None:
    first = told(ego_mps, SECOND)
    now_ns = SECOND + SECOND // 10
    second = told(leap_mps, now_ns, first)
    possible = abs(leap_mps - ego_mps) <= JITTER_MPS + CHANGE_MPS2 * 0.1 and abs(leap_mps) <= MOST_MPS
    assert speed_mps(second, now_ns) == (leap_mps if possible else ego_mps)
    assert read(second, now_ns, AGE_S).pedals.brake == 0.3


def test_the_believed_speed_ages_and_one_that_stands_is_believed_in_the_end() -> None:
    latest, found = told(10.0, SECOND), []
    for tick in range(1, 20):
        now_ns = SECOND + tick * SECOND // 10
        latest = told(30.0, now_ns, latest)
        found.append(speed_mps(latest, now_ns))
    assert found[:2] == [10.0, 10.0]
    assert found[2:12] == [None] * 10
    assert found[12:] == [30.0] * 7


def test_without_a_speed_none_is_read_and_a_clock_set_back_forgets() -> None:
    first = told(10.0, 3600 * SECOND)
    assert speed_mps(told(None, 3600 * SECOND + 1, first), 3600 * SECOND + 1) is None
    back = replace(first, ego=(Ego(speed_mps=30.0), SECOND), speed=believed(first, 3600 * SECOND))
    assert speed_mps(back, SECOND) == 30.0


def seen(*actors: Track, lead_track_id: int | None = None) -> Tracks:
    return Tracks(camera="front", frame=1, tracks=actors, lead_track_id=lead_track_id)


def test_each_pedal_and_the_wheel_are_read_as_they_are() -> None:
    ego = Ego(speed_mps=10.0, brake_pedal=0.1, accelerator_pedal=0.2, steering_angle_rad=-0.3)
    assert read(Latest(ego=(ego, SECOND)), SECOND, AGE_S).pedals == Pedals(
        brake=0.1, accelerator=0.2, steering_rad=-0.3
    )
    stale_ns = SECOND + int(AGE_S * 1e9) + SECOND // 100
    assert read(Latest(ego=(ego, SECOND)), stale_ns, AGE_S).pedals == Pedals()
    assert read(Latest(), SECOND, AGE_S).pedals == Pedals()


def test_the_own_acceleration_is_read_while_it_is_fresh() -> None:
    latest = Latest(ego=(Ego(speed_mps=10.0, acceleration_mps2=-1.5), SECOND))
    assert read(latest, SECOND, AGE_S).view.ego_acceleration_mps2 == -1.5
    assert read(latest, 2 * SECOND, AGE_S).view.ego_acceleration_mps2 is None


def test_a_deceleration_is_none_while_no_speed_bears_it_out() -> None:
    for speed in (None, 500.0):
        first = told(10.0, SECOND)
        for tick in range(1, 20):
            now_ns = SECOND + tick * SECOND // 10
            before = believed(first, SECOND)
            latest = Latest(ego=(Ego(speed_mps=speed, acceleration_mps2=-6.0), now_ns), speed=before)
            view = read(latest, now_ns, AGE_S).view
            assert view.ego_acceleration_mps2 is None or view.ego_speed_mps is not None
    assert read(Latest(ego=(Ego(acceleration_mps2=2.0), SECOND)), SECOND, AGE_S).view.ego_acceleration_mps2 == 2.0


def test_friction_and_health_stay_as_last_read_and_tracks_do_not() -> None:
    lead, aside = (
        Track(track_id=number, kind="vehicle", x_m=20.0, y_m=0.0, vx_mps=0.0, vy_mps=0.0, in_ego_path=number == 1)
        for number in (1, 2)
    )
    latest = Latest(
        tracks=(seen(lead, aside, replace(aside, track_id=3, x_m=10.0), replace(lead, track_id=4, x_m=-3.0)), SECOND),
        conditions=(WET, SECOND),
        degradation=(Degradation(h=0.4, brake_envelope=0.7), SECOND),
    )  # fmt: skip
    now = read(latest, SECOND + SECOND // 10, AGE_S)
    assert [track.track_id for track in now.view.actors] == [1]
    assert [track.track_id for track in now.neighbours] == [3, 4]
    assert now.lateral_neighbours_known
    assert now.tracks_age_s == 0.1
    assert now.ego_age_s is None
    later = read(latest, 100 * SECOND, AGE_S)
    assert (later.view.actors, later.neighbours, later.lateral_neighbours_known) == ((), (), False)
    for reading in (now, later):
        assert (reading.view.h, reading.view.brake_envelope) == (0.4, 0.7)
        assert (reading.view.mu_low, reading.view.mu_high, reading.view.following_factor) == (0.3, 0.6, 1.5)
    empty = read(Latest(), SECOND, AGE_S).view
    assert empty == View()


def test_the_lead_that_perception_names_is_in_the_way_wherever_its_lane_is() -> None:
    named = Track(track_id=9, kind="vehicle", x_m=20.0, y_m=2.0, vx_mps=0.0, vy_mps=0.0, in_ego_path=False)
    assert in_path(seen(named, lead_track_id=9)) == (named,)
    assert in_path(seen(named)) == ()
    assert in_path(seen(replace(named, x_m=0.0), lead_track_id=9)) == ()
    assert in_path(None) == ()


def test_people_beside_the_path_that_walk_towards_it_are_read_apart_from_those_in_it() -> None:
    def beside(number: int, y_m: float, vy_mps: float, **fields: object) -> Track:
        given = {"kind": "pedestrian", "x_m": 20.0, "vx_mps": -10.0, **fields}
        return Track(track_id=number, y_m=y_m, vy_mps=vy_mps, **given)  # type: ignore[arg-type]

    people = (
        beside(1, 4.0, -1.4),
        beside(2, -4.0, 1.4),
        beside(3, 4.0, 1.4),
        beside(4, 4.0, -0.6),
        beside(5, 4.0, -1.4, in_ego_path=True),
        beside(6, 4.0, -1.4, kind="vehicle"),
        beside(7, 4.0, -1.4, x_m=-20.0),
    )
    now = read(Latest(tracks=(seen(*people), SECOND)), SECOND, AGE_S)
    assert [track.track_id for track in now.coming] == [1, 2]
    assert [track.track_id for track in now.view.actors] == [5]
    assert read(Latest(tracks=(seen(*people), SECOND)), 2 * SECOND, AGE_S).coming == ()
