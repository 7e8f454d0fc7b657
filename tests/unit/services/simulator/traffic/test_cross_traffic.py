"""Priority to the right: who comes, who waits, and what is entered when one does not."""

import pytest

from services.simulator.driver.road_ahead import RoadAhead
from services.simulator.scenario.plan import Scenario
from services.simulator.truth.snapshot import Snapshot
from services.simulator.world import World
from tests.unit.services.simulator._scenes import scenario

JUNCTION = """
[[yields]]
at_m = 150
cars = [{ from_side = "right", speed_kmh = 28, when_ego_within_m = 95 }]
"""


def plan(side: str = "right") -> Scenario:
    return scenario(rest=JUNCTION.replace('"right"', f'"{side}"'), speed=45, road_class="urban")


def drive(world: World, seconds: float) -> list[Snapshot]:
    return [world.step() for _ in range(round(seconds * 20))]


def infractions(snapshots: list[Snapshot]) -> list[str]:
    return [snapshot.fact.infraction for snapshot in snapshots if snapshot.fact.infraction]


def world(misses: float, side: str = "right") -> World:
    found = World(plan(side), 3)
    object.__setattr__(found.driver.profile, "misses_stop", misses)
    return found


def test_an_attentive_driver_lets_him_through_and_goes_on() -> None:
    snapshots = drive(world(0.0), 30.0)
    assert infractions(snapshots) == []
    assert not snapshots[-1].fact.collision
    assert min(snapshot.ego.speed_mps for snapshot in snapshots) < 5.0
    assert snapshots[-1].ego.s_m > 220.0, "nobody waits for ever"


def test_who_comes_is_told_as_a_hazard_before_the_line() -> None:
    snapshots = drive(world(0.0), 14.0)
    hazards = [hazard for snapshot in snapshots for hazard in snapshot.fact.hazards]
    assert {hazard.kind for hazard in hazards} == {"priority"}
    assert hazards[0].distance_m > 5.0
    onset = next(snapshot for snapshot in snapshots if snapshot.fact.hazards)
    assert onset.fact.stop is not None
    assert onset.fact.stop[0] == "yield"


@pytest.mark.parametrize("side", ["right", "left"])
def test_his_car_is_where_the_truth_says(side: str) -> None:
    snapshots = drive(world(0.0, side), 6.0)
    mover = [next(each for each in snapshot.movers if each.actor_id == 481) for snapshot in snapshots]
    actor = [next(each for each in snapshot.scene.actors if each.id == 481) for snapshot in snapshots]
    assert (actor[0].pose.y_m < -40.0) == (side == "right")
    moved = (actor[-1].pose.y_m - actor[-21].pose.y_m) / 1.0
    assert moved == pytest.approx(mover[-1].vy_mps, abs=0.8)


def test_one_who_drives_on_before_him_is_entered_with_wrong_yielding(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(RoadAhead, "person_m", lambda self: None)
    assert infractions(drive(world(1.0), 14.0)) == ["wrong_yield"]


def test_with_nobody_coming_the_junction_is_no_hazard() -> None:
    snapshots = drive(World(scenario(rest="[[yields]]\nat_m = 150", speed=45, road_class="urban"), 3), 14.0)
    assert infractions(snapshots) == []
    assert not any(snapshot.fact.hazards for snapshot in snapshots)
    assert min(snapshot.ego.speed_mps for snapshot in snapshots) > 9.0
