"""The world as a whole: the same per seed, with the ego on the road and the law of physics above all wishes."""

import hashlib
import math
from itertools import pairwise

import msgspec
import pytest

from drivemcp.paths import data
from proto.decision import BrakeCommand
from services.simulator.car.braking import ENGINE_DRAG_MPS2, FULL_MPS2, Ability
from services.simulator.driver.driver import Advice
from services.simulator.road.furniture import build_signs
from services.simulator.road.route import Route
from services.simulator.scenario.load import load_scenario
from services.simulator.scenario.plan import BendPlan
from services.simulator.truth.snapshot import Snapshot
from services.simulator.world import WRECKED_S, Inputs, World
from tests.unit.services.simulator._scenes import scenario

SHIPPED = ("urb-rain", "cross-border", "dynamic-vsl")


def drive(world: World, seconds: float, inputs: Inputs = Inputs()) -> list[Snapshot]:
    return [world.step(inputs) for _ in range(round(seconds * 20))]


def fingerprint(name: str, seed: int, seconds: float = 5.0) -> str:
    world, digest = World(load_scenario(data(f"scenarios/{name}.toml")), seed), hashlib.sha256()
    for snapshot in drive(world, seconds):
        digest.update(
            repr((snapshot.ego, snapshot.movers, snapshot.fact, snapshot.scene.actors, snapshot.scene.panels)).encode()
        )
    return digest.hexdigest()


@pytest.mark.parametrize("name", SHIPPED)
def test_a_scenario_is_bit_identical_per_seed_and_differs_between_seeds(name: str) -> None:
    assert fingerprint(name, 5) == fingerprint(name, 5)
    assert fingerprint(name, 5, 2.0) != fingerprint(name, 6, 2.0)


@pytest.mark.parametrize("name", SHIPPED)
def test_the_ego_stays_in_its_lane(name: str) -> None:
    world = World(load_scenario(data(f"scenarios/{name}.toml")), 2)
    for snapshot in drive(world, 12.0):
        assert abs(snapshot.ego.d_m - world.ego.lane.line.offset_at(snapshot.ego.s_m)) < 0.2


def test_after_the_border_one_drives_on_the_left() -> None:
    rest = '[[signs]]\nat_m = 200\ncodes = ["border:GBR"]\n[[signs]]\nat_m = 420\ncodes = ["limit:40"]'
    plan = scenario(rest=rest, road="changeover_m = 300", speed=40)
    snapshots = drive(World(plan, 1), 35.0)
    before = [snapshot.ego.d_m for snapshot in snapshots if snapshot.ego.s_m < 200]
    after = [snapshot.ego.d_m for snapshot in snapshots if snapshot.ego.s_m > 380]
    assert after
    assert max(before) < -1.3
    assert min(after) > 1.3


@pytest.mark.parametrize("at_m", [120.0, 121.0, 122.0, 123.0, 124.0])
def test_a_gantry_that_changes_as_it_is_passed_holds_by_what_it_showed_before(at_m: float) -> None:
    """Its change is due while the driver could not read it, and comes once the gantry is passed."""
    gantry = f"""
[[gantries]]
at_m = {at_m}
follow_traffic = false
steps = [{{ at_s = 0, code = "led:80" }}, {{ at_s = 4, code = "led:100" }}]
"""
    snapshots = drive(World(scenario(rest=gantry, road_class="motorway", lanes=2, speed=70), 1), 9.0)
    assert "led:100" in snapshots[-1].scene.panels.values()
    assert {round(3.6 * (each.fact.limit_mps or 0.0)) for each in snapshots if each.ego.s_m > at_m + 1.0} == {80}


def test_lorries_that_meet_in_a_bend_pass_each_other() -> None:
    lorries = """
[[vehicles]]
kind = "lorry"
at_m = 40
speed_kmh = 40
halts = [{ at_m = 110, hold_s = 60 }]
[[vehicles]]
kind = "lorry"
at_m = 330
direction = "oncoming"
speed_kmh = 40
"""
    plan = scenario(rest=lorries, road_class="urban", speed=20)
    bend = BendPlan(length_m=400.0, radius_m=70.0, turn="right")
    world = World(msgspec.structs.replace(plan, road=msgspec.structs.replace(plan.road, bends=(bend,))), 1)
    met = False
    for _ in range(500):
        world.step()
        ours, theirs = sorted(world.traffic.parts, key=lambda car: car.lane_index, reverse=True)
        met = met or abs(ours.s_m - theirs.s_m) < 4.0
        assert not ours.crashed, "it would stand for good"
    assert met


def test_signs_stand_on_the_side_on_which_one_drives_and_face_the_driver() -> None:
    rest = '[[signs]]\nat_m = 150\ncodes = ["limit:70"]\n[[signs]]\nat_m = 500\ncodes = ["limit:50"]'
    right, left = build_signs(Route(scenario(rest=rest, road="changeover_m = 300")), 1)
    assert right.pose.y_m < -3.0
    assert left.pose.y_m > 3.0
    assert math.cos(right.pose.yaw_rad) == pytest.approx(-1.0)


@pytest.mark.parametrize("rain", [0.0, 18.0])
def test_no_braking_exceeds_what_the_road_gives(rain: float) -> None:
    rest = "[[crossers]]\nat_m = 70\nside = 'near'\nwalk_mps = 2.5\nwhen_ego_within_m = 45\nhazard = true"
    snapshots = drive(World(scenario(rest=rest, rain=rain, speed=70), 4), 6.0)
    hardest = min(snapshot.ego.acceleration_mps2 for snapshot in snapshots)
    assert hardest < -3.0
    assert all(snapshot.ego.acceleration_mps2 >= -snapshot.ego.mu * 9.81 - 1e-6 for snapshot in snapshots)


def test_worn_brakes_brake_less() -> None:
    command = BrakeCommand(deceleration_mps2=6.0, jerk_mps3=10.0, grant_id="g")
    sound, worn = (
        min(m.ego.acceleration_mps2 for m in drive(World(scenario(), 1), 2.0, Inputs(brakes=(command,), car=car)))
        for car in (Ability(), Ability(effect=0.3))
    )
    assert sound == pytest.approx(-6.0, abs=0.1)
    assert worn == pytest.approx(-(ENGINE_DRAG_MPS2 + 0.3 * (FULL_MPS2 - ENGINE_DRAG_MPS2)), abs=0.1)


def test_the_driver_s_own_stop_is_longer_with_a_fault_of_the_brakes() -> None:
    rest = "[[stops]]\nat_m = 200"
    sound, lost = (
        drive(World(scenario(rest=rest, speed=70, road_class="urban"), 2), 14.0, Inputs(car=car))
        for car in (Ability(), Ability(effect=0.15))
    )
    assert min(snapshot.ego.speed_mps for snapshot in lost) > min(snapshot.ego.speed_mps for snapshot in sound) + 3.0


def test_a_soft_tyre_lowers_the_grip_in_rain_and_pulls_a_little_to_its_side() -> None:
    soft = Inputs(car=Ability(lacking=(0.5, 0.0, 0.5, 0.0)))
    plan = scenario(rain=15, speed=90)
    sound, pulled = (drive(World(plan, 3), 4.0, inputs)[-1].ego for inputs in (Inputs(), soft))
    assert pulled.mu < 0.9 * sound.mu
    assert 0.01 < pulled.d_m - sound.d_m < 0.5
    assert pulled.road_wheel_rad < sound.road_wheel_rad


def test_advice_slows_the_car_down_and_only_after_the_reaction_time() -> None:
    told, alone = World(scenario(speed=90), 8), World(scenario(speed=90), 8)
    advice = Inputs(advice=(Advice(topic="limit", target_mps=10.0),))
    pairs = [(told.step(advice if step == 20 else Inputs()), alone.step()) for step in range(200)]
    until = 21 + int(told.driver.profile.reaction_s * 20) - 1
    assert all(one.ego.speed_mps == other.ego.speed_mps for one, other in pairs[:until])
    assert pairs[-1][0].ego.speed_mps < pairs[-1][1].ego.speed_mps - 3.0


def test_a_braking_command_slows_the_car_and_lets_go_when_it_expires() -> None:
    command = BrakeCommand(deceleration_mps2=4.0, jerk_mps3=10.0, grant_id="g")
    world = World(scenario(speed=90), 8)
    drive(world, 1.0)
    held = drive(world, 0.5, Inputs(brakes=(command,)))
    after = drive(world, 1.0)
    assert held[-1].brake.applied_mps2 == pytest.approx(4.0)
    assert held[-1].ego.acceleration_mps2 == pytest.approx(-4.0, abs=0.01)
    assert all(snapshot.brake.applied_mps2 == 0.0 for snapshot in after[5:])


def test_somebody_who_steps_out_is_a_hazard_with_an_onset_and_can_be_hit() -> None:
    rest = "[[crossers]]\nat_m = 70\nside = 'near'\nwalk_mps = 1.6\nwhen_ego_within_m = 30\nhazard = true"
    snapshots = drive(World(scenario(rest=rest, speed=100, rain=15), 4), 5.0)
    on = [snapshot for snapshot in snapshots if snapshot.fact.hazards]
    assert on
    assert on[0].fact.hazards[0].onset_s == pytest.approx(on[0].time_s, abs=0.06)
    assert snapshots[-1].fact.collision


def test_the_ego_stops_for_red_and_goes_on_at_green() -> None:
    rest = "[[lights]]\nat_m = 150\nred_on_approach_m = 90\nred_s = 6"
    snapshots = drive(World(scenario(rest=rest, speed=50, road_class="urban"), 2), 30.0)
    assert min(snapshot.ego.speed_mps for snapshot in snapshots) < 0.3
    assert snapshots[-1].ego.s_m > 160
    assert snapshots[-1].fact.infractions == 0 or all(m.fact.infraction != "red_light" for m in snapshots)


def test_the_ego_holds_its_wheel_while_it_creeps_to_a_stand_in_a_bend() -> None:
    lights = "[[lights]]\nat_m = 150\nred_on_approach_m = 120\nred_s = 9"
    plan = scenario(rest=lights, speed=40, road_class="urban")
    bends = (BendPlan(length_m=60), BendPlan(length_m=120, radius_m=120), BendPlan(length_m=400))
    bent = msgspec.structs.replace(plan, road=msgspec.structs.replace(plan.road, bends=bends))
    egos = [snapshot.ego for snapshot in drive(World(bent, 2), 30.0)]
    swings = [
        abs(now.yaw_rate_radps - before.yaw_rate_radps)
        for before, now in pairwise(egos)
        if 0.0 < before.speed_mps < 0.5
    ]
    assert swings
    assert max(swings) < 0.01


def test_a_drive_ends_soon_after_a_collision_with_a_vehicle() -> None:
    world = World(scenario(), 1)
    assert not world.step(Inputs()).ended
    world.ego.crashed = True
    after = drive(world, 6.0)
    assert after[0].fact.collision
    assert next(k for k, snapshot in enumerate(after) if snapshot.ended) == pytest.approx(WRECKED_S * 20, abs=2)


def test_a_drive_ends_soon_after_the_ego_struck_a_car_out_of_a_side_road() -> None:
    cars = "cars = [{ from_side = 'right', speed_kmh = 36, when_ego_within_m = 58 }]"
    for seed in range(3):
        world = World(scenario(rest=f"[[yields]]\nat_m = 120\n{cars}", speed=45, road_class="urban"), seed, "absent")
        after = drive(world, 15.0)
        struck = next(k for k, snapshot in enumerate(after) if snapshot.fact.collision)
        assert next(k for k, snapshot in enumerate(after) if snapshot.ended) - struck == pytest.approx(
            WRECKED_S * 20, abs=2
        )


def test_traffic_keeps_its_gaps_and_nobody_crashes() -> None:
    world = World(load_scenario(data("scenarios/dynamic-vsl.toml")), 3)
    drive(world, 12.0)
    assert not [car.number for car in world.traffic.cars if car.crashed]


def test_everything_that_moves_or_stands_has_an_id_of_its_own() -> None:
    for name in SHIPPED:
        world = World(load_scenario(data(f"scenarios/{name}.toml")), 1)
        scene, static = world.step().scene, world.static
        ids = [actor.id for actor in scene.actors] + [post.id for post in static.signs]
        ids += [panel.id for gantry in static.gantries for panel in gantry.panels]
        ids += [gantry.id for gantry in static.gantries] + [light.id for light in static.lights]
        assert len(ids) == len(set(ids))
        assert all(0 < each < 65536 for each in ids)


@pytest.mark.parametrize("name", SHIPPED)
def test_no_leaves_hide_a_sign_from_those_who_come_towards_it(name: str) -> None:
    world = World(load_scenario(data(f"scenarios/{name}.toml")), 1)
    spine = world.route.section.spine
    posts = [spine.project(post.pose.x_m, post.pose.y_m) for post in world.static.signs]
    trees = [spine.project(each.pose.x_m, each.pose.y_m) for each in world.static.scenery if each.kind == "tree"]
    for s, d in posts:
        assert not [t for t in trees if 0 < s - t[0] < 40 and t[1] * d > 0 and abs(t[1]) < abs(d) + 1.5]


def test_an_absent_driver_keeps_speed_whatever_is_said_and_the_car_stays_where_it_is_held() -> None:
    def command(deceleration: float) -> BrakeCommand:
        return BrakeCommand(deceleration_mps2=deceleration, jerk_mps3=10.0, grant_id="g", envelope="emergency")

    advice = Advice(topic="limit", target_mps=5.0, warns=True)
    world = World(scenario(speed=50), 1, "absent")
    assert [each.ego.speed_mps for each in drive(world, 2.0, Inputs(advice=(advice,)))][-1] == pytest.approx(50 / 3.6)
    assert drive(world, 8.0, Inputs(brakes=(command(5.0),)))[-1].ego.speed_mps == 0.0


def test_the_brake_unit_gives_what_is_asked_for_as_far_as_weak_brakes_give_it() -> None:
    def hardest(asked: float, car: Ability) -> float:
        command = BrakeCommand(deceleration_mps2=asked, jerk_mps3=10.0, grant_id="g", envelope="emergency")
        return -min(
            each.ego.acceleration_mps2 for each in drive(World(scenario(), 1), 2.0, Inputs(brakes=(command,), car=car))
        )

    weak = Ability(effect=0.5)
    assert hardest(3.0, weak) == pytest.approx(3.0, abs=0.2)
    assert 3.5 < hardest(6.5, weak) < 5.0
