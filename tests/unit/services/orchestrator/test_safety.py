"""Safety properties of the tick with the real arbiter, end to end in pure form (design 6)."""

from collections.abc import Callable
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from domain.ego_speed import CHANGE_MPS2, JITTER_MPS
from proto.scene import Fact
from services.orchestrator.observations.inputs import Observations
from services.orchestrator.target.lost import RISES_MPS2
from tests.safety import safety
from tests.unit.services.orchestrator.judge import arbiter
from tests.unit.services.orchestrator.scenes import acts, next_seen, one, scenes, target
from tests.unit.services.orchestrator.support import (
    EXPERTS,
    KMH,
    SECOND,
    TICK,
    Drive,
    Played,
    actor,
    end_sign,
    health,
    limit_sign,
    replace,
)


def change(seen: Observations, topic: str, **fields: Any) -> Observations:
    """The same observations with fields of one message replaced."""
    stamped = getattr(seen, topic)
    return replace(seen, **{topic: replace(stamped, message=replace(stamped.message, **fields))})


# -- known worse -------------------------------------------------------------------------------------------------------


def less_grip(seen: Observations, x: float) -> Observations:
    assert seen.conditions is not None
    now = seen.conditions.message
    return change(
        seen, "conditions", mu_low=max(0.05, now.mu_low * x), mu_high=max(0.05, now.mu_high * x),
        speed_factor=max(0.1, now.speed_factor * x), following_factor=now.following_factor / max(0.3, x),
    )  # fmt: skip


def worse_car(seen: Observations, x: float) -> Observations:
    assert seen.degradation is not None
    now = seen.degradation.message
    assert now.h is not None
    assert now.brake_envelope is not None
    return change(seen, "degradation", h=1.0 - (1.0 - now.h) * x, brake_envelope=now.brake_envelope * x)


def nearer_lead(seen: Observations, x: float) -> Observations:
    assert seen.tracks is not None
    nearer = tuple(
        replace(t, x_m=4.6 + (t.x_m - 4.6) * x if t.x_m > 4.6 else t.x_m) for t in seen.tracks.message.tracks
    )
    return change(seen, "tracks", tracks=nearer)


@pytest.mark.parametrize("worse", [less_grip, worse_car, nearer_lead])
@safety(few=25, ways=3)
@given(drive=scenes(), x=st.floats(0.05, 1.0))
def test_known_worse_never_raises_the_target_and_never_lowers_r(
    worse: Callable[[Observations, float], Observations], drive: Drive, x: float
) -> None:
    before = one(drive, next_seen(drive))
    changed = worse(next_seen(drive), x)
    assert changed.conditions is not None
    assert changed.degradation is not None
    weather, car = changed.conditions.message, changed.degradation.message
    ask = Played(
        {**drive.ask.table, "assess_weather": lambda a: weather, "vehicle_health": lambda a: health(car.h or 0.0)},
        arbiter=arbiter(),
    )
    after = one(drive, changed, ask)
    assert target(after) <= target(before) + 1e-9
    assert after.decision.metrics.r >= before.decision.metrics.r - 1e-9


# -- less information --------------------------------------------------------------------------------------------------


def _gone(topic: str) -> Callable[[Observations, float], Observations]:
    return lambda seen, x: replace(seen, **{topic: None}, unhealthy=(topic,))


def _older(topic: str) -> Callable[[Observations, float], Observations]:
    def older(seen: Observations, x: float) -> Observations:
        stamped = getattr(seen, topic)
        return replace(seen, **{topic: replace(stamped, stamp_ns=stamped.stamp_ns - int(x * 5e9))})

    return older


def _doubt_actors(seen: Observations, x: float) -> Observations:
    assert seen.tracks is not None
    return change(
        seen,
        "tracks",
        tracks=tuple(replace(t, confidence=t.confidence * x) for t in seen.tracks.message.tracks),
    )


def _out_of_lane(seen: Observations, x: float) -> Observations:
    assert seen.tracks is not None
    tracks = tuple(replace(t, in_ego_path=False, y_m=t.y_m + 50 * x) for t in seen.tracks.message.tracks)
    return change(seen, "tracks", tracks=tracks, lead_track_id=None)


def _renumbered(seen: Observations, x: float) -> Observations:
    assert seen.tracks is not None
    tracks = tuple(replace(t, track_id=t.track_id + 100, age_s=x) for t in seen.tracks.message.tracks)
    return change(seen, "tracks", tracks=tracks, lead_track_id=None)


def _no_data(seen: Observations, x: float) -> Observations:
    """Numbers that no road can hold, up to the largest."""
    assert seen.tracks is not None
    absurd = 10.0 ** (3.01 + 305 * x)
    return change(seen, "tracks", tracks=tuple(replace(t, vx_mps=absurd) for t in seen.tracks.message.tracks))


def _speed_leaps(seen: Observations, x: float) -> Observations:
    assert seen.ego is not None
    leap_mps = JITTER_MPS + CHANGE_MPS2 * 0.1 + 1e-3 + 10.0 ** (-2 + 310 * x)
    return change(seen, "ego", speed_mps=(seen.ego.message.speed_mps or 0.0) + leap_mps)


def _speed_falls(seen: Observations, x: float) -> Observations:
    assert seen.ego is not None
    leap_mps = JITTER_MPS + CHANGE_MPS2 * 0.1 + 1e-3 + 10.0 ** (-2 + 310 * x)
    return change(seen, "ego", speed_mps=(seen.ego.message.speed_mps or 0.0) - leap_mps)


def _vaguer(seen: Observations, x: float) -> Observations:
    assert seen.tracks is not None
    tracks = tuple(
        replace(t, sigma_x_m=t.sigma_x_m + 3 * x, sigma_vx_mps=t.sigma_vx_mps + 3 * x)
        for t in seen.tracks.message.tracks
    )
    return change(seen, "tracks", tracks=tracks)


def _guessed_lens(seen: Observations, x: float) -> Observations:
    assert seen.tracks is not None
    return change(seen, "tracks", tracks=tuple(replace(t, range_spread=x) for t in seen.tracks.message.tracks))


def _wider(seen: Observations, x: float) -> Observations:
    assert seen.conditions is not None
    now = seen.conditions.message
    return change(seen, "conditions", mu_low=max(0.01, now.mu_low * x), mu_high=now.mu_high + (1.2 - now.mu_high) * x)


def _doubt_weather(seen: Observations, x: float) -> Observations:
    assert seen.conditions is not None
    return change(seen, "conditions", confidence=seen.conditions.message.confidence * x)


LESS: dict[str, Callable[[Observations, float], Observations]] = {
    **{f"no {topic}": _gone(topic) for topic in ("tracks", "ego", "road", "conditions", "degradation")},
    **{f"older {topic}": _older(topic) for topic in ("tracks", "ego", "road", "conditions", "degradation")},
    "speed unknown": lambda seen, x: change(seen, "ego", speed_mps=None),
    "acceleration unknown": lambda seen, x: change(seen, "ego", acceleration_mps2=None),
    "h unknown": lambda seen, x: change(seen, "degradation", h=None),
    "envelope unknown": lambda seen, x: seen,
    "doubted actors": _doubt_actors,
    "vaguer actors": _vaguer,
    "actors out of the lane": _out_of_lane,
    "actors renumbered": _renumbered,
    "actors without data": _no_data,
    "speed leaps": _speed_leaps,
    "speed falls": _speed_falls,
    "field of view guessed": _guessed_lens,
    "wider friction": _wider,
    "doubted weather": _doubt_weather,
    "watchdog": lambda seen, x: replace(seen, cause="watchdog", tracks=None),
}


@pytest.mark.parametrize("way", list(LESS))
@safety(few=25, ways=len(LESS))
@given(drive=scenes(), x=st.floats(0.0, 1.0))
def test_less_information_never_raises_the_target_nor_turns_speak_into_act(way: str, drive: Drive, x: float) -> None:
    before = one(drive, next_seen(drive))
    eyes = arbiter(before.request)
    for judge in (arbiter(), eyes):
        after = one(drive, LESS[way](next_seen(drive), x), Played(drive.ask.table, arbiter=judge))
        assert target(after) <= target(before) + 1e-9
        assert acts(before) or not acts(after)


NEWS = (
    limit_sign("limit:30", track_id=20), limit_sign("limit:80", track_id=20), limit_sign("limit:130", track_id=20),
    end_sign("all_end"), end_sign("town_exit"), end_sign("border:GBR"), limit_sign("led:60", track_id=20),
)  # fmt: skip


@pytest.mark.parametrize("status", ["timeout", "unavailable", "busy", "tool_error", "protocol_error"])
@safety(few=25, ways=5)
@given(drive=scenes(), news=st.sampled_from(NEWS), missing=st.sets(st.sampled_from(sorted(EXPERTS))))
def test_missing_answers_never_raise_the_target_nor_enable_act(
    status: str, drive: Drive, news: Fact, missing: set[str]
) -> None:
    seen = next_seen(drive, news)
    stood = target(drive.history[-1][2])
    before = one(drive, seen)
    table = {tool: expert for tool, expert in drive.ask.table.items() if tool not in missing}
    after = one(drive, seen, Played(table, arbiter=arbiter(), status=status))
    assert target(after) <= max(target(before), stood) + 1e-9
    assert acts(before) or not acts(after)


@safety(few=25)
@given(drive=scenes(), gaps=st.lists(st.sampled_from(sorted(LESS)), min_size=1, max_size=12), x=st.floats(0.0, 1.0))
def test_a_longer_blindness_never_raises_the_target(drive: Drive, gaps: list[str], x: float) -> None:
    """Nothing new is seen, less and less arrives, no tool answers: the target never rises above where it stood.

    A second absurd speed, nearer to the first than to the one believed, is believed: then the bound of a lead rises as slowly as it may.
    """
    # A thousandth of a second at a time: nothing is passed meanwhile.
    soon_ns = 1_000_000
    stood = target(one(drive, replace(next_seen(drive), now_ns=drive.now_ns + soon_ns)))
    drive.ask.table = {}
    for count, way in enumerate(gaps, 1):
        seen = replace(LESS[way](next_seen(drive), x), now_ns=drive.now_ns + soon_ns)
        ticked = one(drive, seen)
        drive.state, drive.now_ns = ticked.state, seen.now_ns
        assert target(ticked) <= stood + RISES_MPS2 * 0.001 * count + 1e-9


@pytest.mark.parametrize("late_s", [0.2, 0.6, 0.9])
def test_an_older_picture_that_comes_late_begins_no_look_again(late_s: float) -> None:
    drive = Drive(speed_mps=2.0)
    drive.tracks, drive.lead = (actor(1.0, 0.0, confidence=0.25),), 5
    drive.ticks(10)
    stood = target(drive.history[-1][2])
    seen = next_seen(drive)
    assert seen.tracks is not None
    late = replace(seen.tracks, stamp_ns=seen.tracks.stamp_ns - round(late_s * 1e9))
    drive.tick(tracks=late)
    drive.tracks, drive.lead = (actor(1.0, 0.0, confidence=0.25, y_m=6.0, in_ego_path=False),), None
    assert target(drive.tick()) <= stood + 1e-9


@safety(few=25)
@given(scenes(), st.floats(0.0, 1.0), st.sampled_from(NEWS))
def test_contradictory_signs_end_at_or_below_the_lower(drive: Drive, confidence: float, news: Fact) -> None:
    alone = one(drive, next_seen(drive, news))
    stood = target(drive.history[-1][2])
    other = limit_sign("limit:20", track_id=30, confidence=confidence, believed=confidence > 0.5)
    both = one(drive, next_seen(drive, news, other))
    assert target(both) <= max(target(alone), stood) + 1e-9


# -- malformed -----------------------------------------------------------------------------------------------------------

number = st.one_of(st.floats(allow_nan=True, allow_infinity=True), st.sampled_from((-1.0, 0.0, 1e9)))


@safety(few=25)
@given(drive=scenes(), numbers=st.lists(number, min_size=12, max_size=12), lead=st.none() | st.integers(-5, 9))
def test_malformed_numbers_neither_break_the_tick_nor_raise_the_target(
    drive: Drive, numbers: list[float], lead: int | None
) -> None:
    stood = target(one(drive, next_seen(drive)))
    a, b, c, d, e, f, g, h, i, j, k, m = numbers
    broken = actor(10.0, 1.0, track_id=5)
    seen = next_seen(drive)
    seen = change(seen, "ego", speed_mps=a, acceleration_mps2=b, yaw_rate_radps=c)
    seen = change(seen, "conditions", mu_low=d, mu_high=e, speed_factor=f, following_factor=g, confidence=h)
    seen = change(seen, "degradation", h=i, brake_envelope=j)
    seen = change(seen, "tracks", tracks=(replace(broken, x_m=k, vx_mps=m, sigma_x_m=a),), lead_track_id=lead)
    ticked = one(drive, seen)
    assert 0.0 <= target(ticked) <= 130 * KMH + 1e-9
    held, before = ticked.state.held, drive.state.held
    better = held.conditions != before.conditions or held.degradation != before.degradation
    if not better and not drive.tracks and not drive.lines:
        assert target(ticked) <= max(stood, target(drive.history[-1][2])) + 1e-9


@safety(few=25)
@given(
    lie_mps2=st.floats(1.5, 1e6), ego_mps=st.floats(3.0, 30.0), gap_m=st.floats(3.0, 80.0), closes=st.floats(0.2, 1.0)
)
def test_an_accelerometer_that_lies_keeps_no_warning_back(
    lie_mps2: float, ego_mps: float, gap_m: float, closes: float
) -> None:
    told = []
    for mps2 in (-lie_mps2, None):
        drive = Drive(Played(arbiter=arbiter()), speed_mps=ego_mps, road="rural")
        drive.acceleration_mps2 = mps2
        drive.ticks(25)
        drive.tracks = (actor(gap_m, closes * ego_mps),)
        drive.lead = 5
        drive.ticks(3)
        told.append([(each.advisory.kind, each.advisory.directive) for _, _, each in drive.history[-3:]])
    assert told[0] == told[1]


@safety(few=25)
@given(
    lie_mps2=st.floats(1.5, 15.0),
    told_mps=st.none() | st.sampled_from((1e3, -1e3, float("nan"))),
    gap_m=st.floats(3.0, 80.0),
    closing_mps=st.floats(4.0, 14.0),
)
def test_no_deceleration_keeps_a_warning_back_while_no_speed_is_believed(
    lie_mps2: float, told_mps: float | None, gap_m: float, closing_mps: float
) -> None:
    told = []
    for mps2 in (-lie_mps2, None):
        drive = Drive(Played(arbiter=arbiter()), speed_mps=14.0, road="rural")
        drive.ticks(5)
        drive.speed_mps, drive.acceleration_mps2 = told_mps, mps2
        drive.ticks(10)
        drive.tracks = (actor(gap_m, closing_mps),)
        drive.lead = 5
        drive.ticks(3)
        told.append([(each.advisory.kind, each.advisory.directive) for _, _, each in drive.history[-3:]])
    assert told[0] == told[1]


@pytest.mark.parametrize("absurd", [{"range_spread": -0.9}, {"length_m": -90.0}, {"range_spread": 1e9}])
def test_a_size_or_a_share_below_none_moves_no_car_farther_away(absurd: dict[str, float]) -> None:
    drive = Drive()
    drive.tracks, drive.lead = (actor(20.0, 6.0),), 5
    drive.ticks(15)
    stood = drive.target_mps
    drive.tracks = tuple(replace(each, **absurd) for each in drive.tracks)
    for _ in range(25):
        drive.tick()
        assert drive.target_mps <= stood + 1e-9


def test_an_hour_old_or_coming_reading_of_the_car_is_none() -> None:
    for age_ns in (3600 * SECOND, -3600 * SECOND):
        drive = Drive()
        seen = drive.observations()
        assert seen.ego is not None
        ticked = drive.tick(ego=replace(seen.ego, stamp_ns=drive.now_ns + TICK - age_ns))
        assert ticked.world.ego.speed_mps is None
