"""The judge of the disturbed drives finds what it is for: silence, and targets that rise while information is missing."""

import pytest

from proto.truth import TrueActor, Truth
from tests.stack.chaos.allowed import allowed_mps
from tests.stack.chaos.judge import judge
from tests.stack.chaos.watcher import Seen


def seen(
    at_s: float, target_mps: float | None = 10.0, *degraded: str, why: str = "lead", allowed: float | None = 10.0
) -> Seen:
    """A tick, with what the truth allows."""
    return Seen(
        at_s=at_s, tick=int(at_s * 10), kind="SILENT", target_mps=target_mps, limit_mps=13.9, why=why,
        degraded=degraded, allowed_mps=allowed,
    )  # fmt: skip


BEFORE = [seen(tenth / 10) for tenth in range(80, 100)]


def test_silence_is_the_longest_time_without_a_tick_from_the_disturbance_on() -> None:
    verdict = judge("x", [*BEFORE, seen(10.2), seen(14.0), seen(15.0)], 10.0, 10.0, 16.0)
    assert verdict.silent_s == pytest.approx(3.8)
    assert judge("x", BEFORE, 10.0, 10.0, 16.0).silent_s == pytest.approx(6.0)


def test_a_target_that_rises_while_the_process_is_missing_is_told() -> None:
    after = [seen(10.5, 12.0, "perception/tracks"), seen(11.0, 13.0)]
    assert judge("x", [*BEFORE, *after], 10.0, 10.4, 12.0, "perception").rise_mps == pytest.approx(2.0)
    assert judge("x", [*BEFORE, *after], 10.0, 10.4, 12.0, "perception").back_s == pytest.approx(1.0)


@pytest.mark.parametrize("process", ["logger", "can"])
def test_a_target_may_rise_by_what_another_process_tells(process: str) -> None:
    after = [seen(10.5, 12.0, "perception/tracks", process)]
    assert judge("x", [*BEFORE, *after], 10.0, 10.4, 12.0, process).rise_mps == (2.0 if process == "can" else 0.0)
    after = [seen(10.5, 12.0, "perception/tracks")]
    assert judge("x", [*BEFORE, *after], 10.0, 10.4, 12.0, process).rise_mps == 0.0


def rise_mps(why: str, after: Seen) -> float:
    """What is told of a drive whose target was low for one reason, and then is what it is after."""
    before = [seen(tenth / 10, why=why) for tenth in range(80, 100)]
    return judge("x", [*before, after], 10.0, 10.4, 12.0, "perception").rise_mps


@pytest.mark.parametrize("why", ["law", "lead", "person", "red_light", "stop_sign"])
def test_a_target_may_rise_as_far_as_the_truth_allows_by_now(why: str) -> None:
    after = seen(10.5, 13.0, "perception/tracks", why="law", allowed=12.0)
    assert rise_mps(why, after) == pytest.approx(1.0)
    assert rise_mps(why, seen(10.5, 11.9, "perception/tracks", why="lead", allowed=12.0)) == 0.0


@pytest.mark.parametrize("why", ["law", "lead", "person"])
def test_a_target_that_rises_while_what_bounded_it_is_still_there_is_freed(why: str) -> None:
    assert rise_mps(why, seen(10.5, 13.9, "perception/tracks", why="law", allowed=6.0)) == pytest.approx(3.9)
    assert rise_mps(why, seen(10.5, 13.9, "perception/tracks", why="law", allowed=None)) == pytest.approx(3.9)


@pytest.mark.parametrize("why", ["doubt", "sight", "light_lost", "junction", "ahead"])
def test_no_truth_allows_what_was_doubted_or_unknown_to_free_the_target(why: str) -> None:
    assert rise_mps(why, seen(10.5, 13.9, "perception/tracks", why="law", allowed=30.0)) == pytest.approx(3.9)


def truth(**fields: object) -> Truth:
    """A road with a limit of 50 km/h, the ego at 10 m/s."""
    return Truth(**{
        "time_s": 1.0, "distance_m": 10.0, "speed_mps": 10.0, "acceleration_mps2": 0.0, "law_limit_mps": 13.9,
        "jurisdiction": "DEU", "mu": 0.8, "gap_m": None, "closing_mps": None, **fields,
    })  # type: ignore[arg-type]  # fmt: skip


def of(
    kind: str, x_m: float, y_m: float = 0.0, vx_mps: float = -10.0, vy_mps: float = 0.0, *, there: bool = True
) -> Truth:
    """That road with somebody ahead, who stands unless told otherwise."""
    return truth(actors=(TrueActor(
        actor_id=1, kind=kind, x_m=x_m, y_m=y_m, vx_mps=vx_mps, vy_mps=vy_mps, length_m=4.5, width_m=1.8, in_ego_path=there,
    ),))  # fmt: skip


@pytest.mark.parametrize(
    ("road", "mps"),
    [
        (truth(), 13.9),
        (truth(law_limit_mps=8.3), 8.3),
        (truth(law_limit_mps=None), 130 / 3.6),
        (truth(stop_kind="red_light", stop_distance_m=5.0), 4.0),
        (truth(stop_kind="yield", stop_distance_m=5.0), 25 / 3.6),
        (of("vehicle", 14.5), 2.0),
        (of("vehicle", 14.5, vx_mps=4.0), 11.8),
        (of("vehicle", 14.5, there=False), 13.9),
        (of("vehicle", -14.5), 13.9),
        (of("pedestrian", 11.5), 4.0),
        (of("pedestrian", 11.5, 4.0, there=False), 13.9),
        (of("pedestrian", 11.5, 4.0, vy_mps=-1.5, there=False), 4.0),
        (of("pedestrian", 11.5, 4.0, vy_mps=1.5, there=False), 13.9),
    ],
)
def test_the_truth_allows_what_limit_lines_and_road_users_bear(road: Truth, mps: float) -> None:
    assert allowed_mps(road) == pytest.approx(mps)
