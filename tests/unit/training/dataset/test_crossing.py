"""Vehicles put across our way, on stages drawn at random."""

import math

import numpy as np
import pytest

from services.simulator.scene.scene import Actor, Scene, in_ego_frame
from training.dataset.crossing import FARTHEST_M, NEAREST_M, WIDE, with_crossing
from training.stages.stage import FAMILIES, Split, random_stage

SEEDS = range(12)


def added(seed: int, split: Split = "train") -> tuple[Scene, tuple[Actor, ...]]:
    scene = random_stage(seed, split)[1]
    fuller = with_crossing(scene, split, np.random.default_rng(seed))
    assert fuller.actors[: len(scene.actors)] == scene.actors
    return scene, fuller.actors[len(scene.actors) :]


def test_they_stand_before_us_and_show_their_flank() -> None:
    turned = []
    for seed in SEEDS:
        scene, new = added(seed)
        for vehicle in new:
            ahead, aside = in_ego_frame(scene.ego, vehicle.pose.x_m, vehicle.pose.y_m)
            assert math.hypot(ahead, aside) > NEAREST_M
            assert 0.0 < ahead <= FARTHEST_M
            assert abs(aside) <= WIDE * ahead + 1e-6
            turned.append(abs(math.sin(vehicle.pose.yaw_rad - scene.ego.yaw_rad)))
    assert len(turned) > 12
    assert float(np.median(turned)) > 0.9


def test_no_two_vehicles_overlap() -> None:
    for seed in SEEDS:
        scene, new = added(seed)
        for number, vehicle in enumerate(new):
            for other in (*scene.actors, *new[:number]):
                apart = math.dist((vehicle.pose.x_m, vehicle.pose.y_m), (other.pose.x_m, other.pose.y_m))
                assert apart > (vehicle.length_m + other.length_m) / 2


@pytest.mark.parametrize("split", ["train", "test"])
def test_the_held_out_shape_stays_held_out(split: Split) -> None:
    families = {vehicle.mesh_family for seed in SEEDS for vehicle in added(seed, split)[1]}
    assert (families == {FAMILIES - 1}) if split == "test" else (FAMILIES - 1 not in families)


def test_every_id_is_its_own_and_the_same_seed_gives_the_same() -> None:
    for seed in SEEDS:
        scene, new = added(seed)
        ids = [actor.id for actor in (*scene.actors, *new)]
        assert len(set(ids)) == len(ids)
        assert added(seed)[1] == new
