"""When a hazard begins, in the truth of a drive."""

from collections.abc import Iterable

import msgspec
import pytest

from services.orchestrator.events import ETA
from services.simulator.car.tyres import aquaplaning_mps
from services.simulator.scenario.plan import Scenario
from services.simulator.truth import hazard_sources
from services.simulator.truth.hazards import HazardLog, HazardSource
from services.simulator.truth.snapshot import Snapshot
from services.simulator.world import World
from tests.unit.services.simulator._scenes import scenario


def drive(plan: Scenario, seconds: float, seed: int = 1) -> list[Snapshot]:
    world = World(plan, seed)
    return [world.step() for _ in range(round(seconds * 20))]


def onsets(snapshots: Iterable[Snapshot]) -> dict[str, float]:
    return {each.kind: each.onset_s for snapshot in snapshots for each in snapshot.fact.hazards}


def source(begins: bool = True, key: int = 1) -> HazardSource:
    return HazardSource(kind="pedestrian", key=key, distance_m=20.0, begins=begins)


def test_thresholds_are_those_of_the_assistants_events() -> None:
    assert ETA["closing_lead"] == hazard_sources.CLOSING_PER_S
    assert ETA["stop_required"] == hazard_sources.NEEDED_MPS2


def test_a_hazard_begins_when_its_threshold_is_crossed_and_it_is_in_sight_and_comes_once() -> None:
    log, seen = HazardLog(), [False]

    def note(now: list[HazardSource], time_s: float) -> list[float]:
        return [each.onset_s for each in log.note(now, lambda _: seen[0], time_s)]

    assert note([source()], 1.0) == [], "hidden"
    seen[0] = True
    assert note([source(begins=False)], 2.0) == [], "below its threshold"
    assert note([source()], 3.0) == [3.0]
    seen[0] = False
    assert note([source(begins=False), source(key=2)], 4.0) == [3.0], "it stays on while it is there"
    assert note([], 5.0) == []
    seen[0] = True
    assert note([source(), source(key=2)], 6.0) == [6.0], "the first is over for good; another is another"


def test_a_braking_lead_is_a_hazard_below_four_seconds_to_collision() -> None:
    lead = "[[vehicles]]\nat_m = 60\nspeed_kmh = 60\nkeeps_kmh = 60\nhalts = [{ at_m = 250, hazard = true }]"
    snapshots = drive(scenario(rest=lead, speed=60), 18.0)
    (first,) = [m for m in snapshots if m.fact.hazards and m.time_s == m.fact.hazards[0].onset_s]
    gap, closing = first.fact.gap_m, first.fact.closing_mps
    assert gap is not None
    assert closing is not None
    assert first.fact.hazards[0].kind == "lead_brakes"
    assert gap / closing == pytest.approx(4.0, abs=0.4)


def test_a_cut_in_is_a_hazard_once_it_reaches_into_the_lane_and_closes() -> None:
    cut_in = """
[[vehicles]]
at_m = 80
lane = 2
speed_kmh = 110
heeds_limits = false
lane_change = { to_lane = 1, when_ego_at_m = 250, paces_m = 55, then_kmh = 75, at_gap_m = 36, hazard = true }
"""
    snapshots = drive(motorway(cut_in, 110), 24.0)
    at_s = onsets(snapshots)["cut_in"]
    onset = next(snapshot for snapshot in snapshots if snapshot.time_s == at_s)
    assert onset.ego.s_m > 250.0
    assert onset.fact.gap_m is not None
    assert onset.fact.gap_m < 36.0
    before = [snapshot.fact.gap_m for snapshot in snapshots if snapshot.ego.s_m < 250.0]
    assert set(before) == {None}, "it drives beside, not ahead"


def test_a_car_that_keeps_pace_before_the_ego_does_not_wait_for_it() -> None:
    pacing = """
[[vehicles]]
at_m = 32
lane = 1
speed_kmh = 0
heeds_limits = false
lane_change = { to_lane = 2, when_ego_at_m = 600, paces_m = 2 }
"""
    snapshots = drive(motorway(pacing, 0), 60.0)
    assert snapshots[-1].ego.s_m > 100.0, "behind one that waits, both would stand for good"


def test_nobody_cuts_in_where_another_drives() -> None:
    crowded = """
[[vehicles]]
at_m = 80
lane = 2
speed_kmh = 20
keeps_kmh = 20
heeds_limits = false
lane_change = { to_lane = 1, when_ego_at_m = 30 }
[[vehicles]]
kind = "van"
at_m = 81
lane = 1
speed_kmh = 20
keeps_kmh = 20
heeds_limits = false
halts = [{ at_m = 150, hold_s = 6 }]
"""
    world, changing = World(motorway(crowded, 20), 1), list[float]()
    for _ in range(600):
        world.step()
        assert not any(car.crashed for car in world.traffic.cars), "they would stand for good"
        changing += [
            world.time_s for car in world.traffic.parts if car.target_lane_index[2] == 1 and car.lane_index[2] == 2
        ]
    assert changing, "it does so once the other has stayed behind"


@pytest.mark.parametrize("beside", ["", "[[vehicles]]\nat_m = 60\nlane = 2\nspeed_kmh = 80\nkeeps_kmh = 80\n"])
def test_a_lorry_that_the_ego_falls_behind_of_never_drives_into_what_stands(beside: str) -> None:
    world = World(motorway(lorry_before_who_stands(400, when_ego_at_m=900) + beside, 20), 1)
    for _ in range(600):
        world.step()
        assert not any(car.crashed for car in world.traffic.cars), "they would stand for good"
    (lorry,) = [car for car in world.traffic.cars if car.body.kind == "lorry"]
    assert lorry.lane_index[2] == 2, "it has left the lane"
    assert lorry.s_m > 420.0, "and drives on"


def lorry_before_who_stands(stands_at_m: float, *, when_ego_at_m: float) -> str:
    return f"""
[[vehicles]]
kind = "lorry"
at_m = 60
lane = 1
speed_kmh = 80
keeps_kmh = 80
lane_change = {{ to_lane = 2, when_ego_at_m = {when_ego_at_m} }}
[[vehicles]]
at_m = {stands_at_m}
lane = 1
speed_kmh = 0
stands_s = 8
"""


def motorway(rest: str, speed: float) -> Scenario:
    plan = scenario(rest=rest, lanes=3, road_class="motorway", speed=speed, length=1500)
    return msgspec.structs.replace(plan, ego=msgspec.structs.replace(plan.ego, lane=1))


def test_a_lorry_that_leaves_the_lane_lays_bare_what_stands_behind_it() -> None:
    snapshots = drive(motorway(lorry_before_who_stands(330, when_ego_at_m=215), 80), 25.0)
    onset = next(snapshot for snapshot in snapshots if snapshot.fact.hazards)
    (hazard,) = onset.fact.hazards
    assert hazard.kind == "stopped_lead"
    assert hazard.distance_m / onset.ego.speed_mps < 4.0
    assert onset.ego.s_m > 215.0
    assert snapshots[-1].ego.speed_mps > 1.0, "it drives on in the end"


def test_water_is_a_hazard_where_a_tyre_floats() -> None:
    def kinds(film_mm: float) -> dict[str, float]:
        rest = f"[[water]]\nfrom_m = 80\nto_m = 160\nfilm_mm = {film_mm}"
        return onsets(drive(scenario(rest=rest, speed=90), 6.0))

    assert aquaplaning_mps(6.0) < 90 / 3.6 < aquaplaning_mps(0.3)
    assert "deep_water" in kinds(6.0)
    assert kinds(0.3) == {}


def test_grip_is_lost_in_the_water_and_found_behind_it() -> None:
    rest = "[[water]]\nfrom_m = 80\nto_m = 160\nfilm_mm = 8.0"
    snapshots = drive(scenario(rest=rest, speed=95), 10.0)
    inside = [m.ego.mu for m in snapshots if 90 < m.ego.s_m < 155]
    outside = [m.ego.mu for m in snapshots if m.ego.s_m > 170]
    assert max(inside) < 0.5 * min(outside)


def test_a_school_s_limit_is_a_hazard_for_one_who_is_too_fast_for_it() -> None:
    rest = '[[signs]]\nat_m = 200\ncodes = ["children", "limit:30"]\n[[signs]]\nat_m = 400\ncodes = ["limit_end:30"]'
    fast = drive(scenario(rest=rest, speed=50, road_class="urban"), 20.0)
    onset = next(m for m in fast if m.fact.hazards)
    needed = (onset.ego.speed_mps**2 - (30 / 3.6) ** 2) / (2 * onset.fact.hazards[0].distance_m)
    assert onset.fact.hazards[0].kind == "school_zone"
    assert needed == pytest.approx(0.4, abs=0.05) or onset.fact.hazards[0].distance_m > 119


def test_who_has_joined_a_queue_is_its_tail() -> None:
    rest = """
[[queues]]
tail_m = 420
speed_kmh = 2
[[vehicles]]
at_m = 380
lane = 1
speed_kmh = 10
keeps_kmh = 10
"""
    world = World(motorway(rest, 120), 1)
    object.__setattr__(world.driver.profile, "reaction_s", 3.0)
    joined = next(iter(world.traffic.parts))
    snapshots = [world.step() for _ in range(240)]
    found = [hazard for snapshot in snapshots for hazard in snapshot.fact.hazards]
    assert {hazard.kind for hazard in found} == {"congestion_tail"}
    assert joined.number in {hazard.actor_id for hazard in found}
