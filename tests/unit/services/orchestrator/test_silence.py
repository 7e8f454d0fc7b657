"""A source that falls silent raises no target: what it told stands until it looks again, or until the ego has passed it."""

from typing import Literal, NamedTuple, get_args

import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from proto.perception import Lanes
from proto.scene import Fact
from proto.sensors import StopLine
from services.orchestrator.observations.inputs import Observations
from tests.safety import safety
from tests.unit.services.orchestrator.scenes import leads, one
from tests.unit.services.orchestrator.support import KMH, SECOND, TICK, Drive, actor, doubted, fact, limit_sign, replace

TOLD_BY = {
    "perception": ("tracks", "lanes"), "map": ("road",), "can": ("ego", "degradation"), "weather": ("conditions",),
    "gnss": ("position_m",), "drivelm": (), "rules": (),
}  # fmt: skip
"""What is missing where a service is silent."""
LineKind = Literal["stop_line", "light", "crossing", "yield_line"]
EYES = ("perception", "drivelm")


class Silence(NamedTuple):
    """Services that are silent for some ticks, and how long each of these is."""

    services: tuple[str, ...]
    frozen: bool
    """Whether their last messages are still there, ever older."""
    steps_ns: tuple[int, ...]

    @property
    def lasts_s(self) -> float:
        return sum(self.steps_ns) / SECOND


def silenced(drive: Drive, silence: Silence, last: Observations, step_ns: int, *facts: Fact) -> Observations:
    """What the next tick sees while services are silent."""
    drive.now_ns += step_ns
    heard = () if set(EYES) & set(silence.services) else facts
    seen = drive.observations(*heard)
    for service in silence.services:
        for field in TOLD_BY[service]:
            seen = replace(seen, **{field: getattr(last, field) if silence.frozen else None})
    cause = "watchdog" if "perception" in silence.services else "snapshot"
    return replace(seen, cause=cause, absent=tuple(sorted({*silence.services} & {"drivelm", "rules"})))


def go_silent(drive: Drive, silence: Silence, *facts: Fact) -> list[float]:
    """The targets meanwhile."""
    last = drive.history[-1][1]
    if "rules" in silence.services:
        rules = ("applicable_limit", "interpret_sign", "right_of_way", "lookup_rule")
        drive.ask.table = {tool: expert for tool, expert in drive.ask.table.items() if tool not in rules}
    targets = []
    for step_ns in silence.steps_ns:
        ticked = one(drive, silenced(drive, silence, last, step_ns, *facts))
        drive.state = ticked.state
        assert ticked.fused.target_mps is not None
        targets.append(ticked.fused.target_mps)
    return targets


def blind(service: str = "perception", *, seconds: int = 60, frozen: bool = True) -> Silence:
    return Silence((service,), frozen, (TICK,) * (10 * seconds))


# -- what a silence may not end --------------------------------------------------------------------------------------------


def doubted_at_an_unknown_place() -> Drive:
    drive = Drive(speed_mps=0.0)
    drive.ticks(20)
    drive.tick(doubted("limit:10", ("limit:40", 0.3), distance_m=None))
    drive.ticks(40)
    return drive


@pytest.mark.parametrize("frozen", [True, False])
@pytest.mark.parametrize("service", EYES)
def test_a_doubted_limit_bounds_as_long_as_its_road_is_not_looked_at(service: str, frozen: bool) -> None:
    drive = doubted_at_an_unknown_place()
    stood = drive.target_mps
    assert stood < 11.5
    assert max(go_silent(drive, blind(service, frozen=frozen))) <= stood + 1e-9


@pytest.mark.parametrize("service", EYES)
def test_a_doubted_limit_ends_once_pictures_come_back_without_it_though_the_ego_stands(service: str) -> None:
    drive = doubted_at_an_unknown_place()
    go_silent(drive, blind(service))
    low = drive.state.held.target_mps
    assert low is not None
    assert low < 11.0
    assert drive.ticks(20).fused.target_mps == pytest.approx(low, abs=1.4), "not at once"
    drive.ticks(100)
    assert drive.target_mps == pytest.approx(50 * KMH)


def test_a_doubted_limit_that_only_a_town_can_have_outlives_the_map_that_told_the_town() -> None:
    drive = Drive(speed_mps=0.0, road="")
    drive.road = "urban"
    drive.ticks(20)
    for _ in range(180):
        drive.tick(doubted("limit:10", distance_m=None))
    stood = drive.target_mps
    assert stood == pytest.approx(10 * KMH)
    targets = go_silent(drive, blind("map", seconds=20), doubted("limit:10", distance_m=None))
    assert max(targets) <= stood + 1e-9


def test_a_red_light_above_the_ego_is_not_lost_while_perception_is_silent() -> None:
    drive = Drive(speed_mps=0.0)
    drive.tick(fact("light", "light:red", track_id=4, distance_m=4.0))
    stood = drive.target_mps
    assert max(go_silent(drive, blind(seconds=5))) <= stood + 1e-9
    drive.ticks(15)
    assert drive.target_mps > stood, "cameras that work and show it no more have it above their view"


def test_a_red_light_somewhere_ahead_outlasts_a_silence_of_two_minutes() -> None:
    drive = Drive(speed_mps=0.0, road="rural")
    drive.tick(fact("light", "light:red", track_id=4, distance_m=None))
    stood = drive.target_mps
    targets = go_silent(drive, blind(seconds=120))
    drive.comes_to(6.0)
    assert max(*targets, *go_silent(drive, blind(seconds=3))) <= stood + 1e-9


def test_a_faint_lead_that_vanished_from_the_last_picture_bounds_while_that_picture_is_the_last() -> None:
    drive = Drive(speed_mps=0.0)
    drive.tracks, drive.lead = (actor(10.0, 0.0, confidence=0.3, age_s=0.2),), 5
    drive.ticks(3)
    drive.tracks, drive.lead = (), None
    stood = drive.tick().fused.target_mps
    assert stood is not None
    assert stood < 5.0
    assert max(go_silent(drive, blind(seconds=30))) <= stood + 1e-9
    drive.ticks(8)
    assert drive.target_mps == pytest.approx(50 * KMH), "what is hardly seen is missed for half a second"


# -- the whole range -------------------------------------------------------------------------------------------------------


@st.composite
def roads(draw: st.DrawFn) -> tuple[Drive, tuple[Fact, ...]]:
    """A drive with all kinds of things ahead, and the facts that are told of them as long as they are seen."""
    road = draw(st.sampled_from(("", "urban", "rural", "motorway")))
    drive = Drive(speed_mps=draw(st.sampled_from((0.0, 0.3)) | st.floats(0.6, 20.0)), road=road)
    drive.road = draw(st.sampled_from(("unknown", "urban", "rural", "motorway")))
    drive.junction_m = draw(st.none() | st.floats(25.0, 150.0))
    if draw(st.booleans()):
        kind: LineKind = draw(st.sampled_from(get_args(LineKind)))
        drive.lines = (StopLine(distance_m=draw(st.floats(25.0, 100.0)), kind=kind),)
        if draw(st.booleans()):
            drive.lines = (
                *drive.lines,
                StopLine(distance_m=drive.lines[0].distance_m + draw(st.floats(0.1, 40.0)), kind="yield_line"),
            )
    if draw(st.booleans()):
        nearest = drive.lines[0] if drive.lines else None
        drive.sight = Lanes(
            ego_lane_id="a", lane_count=1, lane_width_m=3.5, lateral_offset_m=0.0, source=draw(st.sampled_from(("map", "corridor"))),
            road_class=drive.road, junction_distance_m=drive.junction_m,  # type: ignore[arg-type]
            stop_line_distance_m=nearest.distance_m if nearest is not None else None,
            stop_line_kind=nearest.kind if nearest is not None else "",
        )  # fmt: skip
    if draw(st.booleans()):
        drive.tick(limit_sign(draw(st.sampled_from(("limit:30", "limit:50", "limit:80"))), track_id=1))
    if draw(st.booleans()):
        drive.tracks, drive.lead = (draw(leads()),), 5
    at_m = st.none() | st.floats(25.0, 150.0)
    doubts = st.builds(
        doubted, st.sampled_from(("limit:10", "limit:30", "limit:60", "limit:100")), track_id=st.just(11), distance_m=at_m
    )  # fmt: skip
    signs = st.builds(
        fact, st.just("sign"), st.sampled_from(("stop", "yield", "town_entry", "calm_street")), track_id=st.just(12),
        distance_m=at_m,
    )  # fmt: skip
    limits = st.builds(
        limit_sign, st.sampled_from(("limit:20", "limit:60")), track_id=st.just(13), passed=st.just(False), distance_m=at_m
    )  # fmt: skip
    lights = st.builds(
        fact, st.just("light"), st.sampled_from(("light:red", "light:amber")), track_id=st.just(14), distance_m=at_m
    )  # fmt: skip
    facts = tuple(each for each in (draw(st.none() | some) for some in (doubts, signs, limits, lights)) if each)
    for _ in range(draw(st.integers(1, 20))):
        drive.tick(*facts)
    return drive, facts


steps = st.lists(st.sampled_from((TICK // 2, TICK, 3 * TICK, SECOND, 5 * SECOND)), min_size=1, max_size=30)


def within(drive: Drive, silence: Silence, before_s: float = 0.0) -> bool:
    """Whether nothing that was told to be 25 m ahead can be passed meanwhile, or before, when it was told of no more."""
    return (drive.speed_mps or 0.0) * (before_s + silence.lasts_s) < 20.0


@safety(few=60, ways=2)
@given(roads(), steps, st.booleans(), st.sets(st.sampled_from(sorted(TOLD_BY))), st.integers(0, 12))
def test_no_silence_of_perception_raises_the_target(
    scene: tuple[Drive, tuple[Fact, ...]], steps_ns: list[int], frozen: bool, others: set[str], vanished: int
) -> None:
    """Nor where an actor has just vanished, and whatever else is silent as well."""
    drive, _ = scene
    silence = Silence(tuple(sorted({"perception", *others})), frozen, tuple(steps_ns))
    assume(within(drive, silence, vanished * TICK / SECOND))
    if vanished:
        drive.tracks, drive.lead = (), None
        drive.ticks(vanished)
    stood = drive.target_mps
    assert max(go_silent(drive, silence)) <= stood + 1e-9, silence


@safety(few=60, ways=2)
@given(roads(), steps, st.booleans(), st.sets(st.sampled_from(sorted({*TOLD_BY} - {"perception"})), min_size=1))
def test_no_silence_of_another_source_raises_the_target_above_what_it_would_be(
    scene: tuple[Drive, tuple[Fact, ...]], steps_ns: list[int], frozen: bool, services: set[str]
) -> None:
    drive, facts = scene
    silence = Silence(tuple(sorted(services)), frozen, tuple(steps_ns))
    assume(within(drive, silence))
    stood, begun = drive.target_mps, (drive.state, drive.now_ns, drive.ask.table)
    targets = go_silent(drive, silence, *facts)
    drive.state, drive.now_ns, drive.ask.table = begun
    for mps, whole_mps in zip(targets, go_silent(drive, silence._replace(services=()), *facts), strict=True):
        assert mps <= max(stood, whole_mps) + 1e-9, silence
