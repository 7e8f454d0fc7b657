"""People put where they are hard to see, on stages drawn at random."""

import math

import numpy as np
import pytest

from services.simulator.scene.scene import Actor, Pose, Scene
from training.dataset.people import FARTHEST_M, with_people
from training.stages.stage import FAMILIES, Split, random_stage


def added(seed: int, split: Split = "train") -> tuple[Scene, tuple[Actor, ...]]:
    scene = random_stage(seed, split)[1]
    fuller = with_people(scene, split, np.random.default_rng(seed))
    assert fuller.actors[: len(scene.actors)] == scene.actors
    return scene, fuller.actors[len(scene.actors) :]


def seen_from(pose: Pose, other: Pose) -> tuple[float, float]:
    dx, dy = other.x_m - pose.x_m, other.y_m - pose.y_m
    c, s = math.cos(pose.yaw_rad), math.sin(pose.yaw_rad)
    return c * dx + s * dy, c * dy - s * dx


def test_they_stand_before_us_and_in_no_vehicle() -> None:
    people = 0
    for seed in range(12):
        scene, new = added(seed)
        people += len(new)
        for person in new:
            assert person.kind == "pedestrian"
            ahead, _ = seen_from(scene.ego, person.pose)
            assert 0.0 < ahead < FARTHEST_M + 8.0
            for vehicle in (actor for actor in scene.actors if actor.kind != "pedestrian"):
                along, across = (abs(each) for each in seen_from(vehicle.pose, person.pose))
                assert along > vehicle.length_m / 2 or across > vehicle.width_m / 2
    assert people > 36


def test_many_stand_close_to_the_line_of_sight_to_a_thing_or_vehicle() -> None:
    close = total = 0
    for seed in range(12):
        scene, new = added(seed)
        things = [item.pose for item in scene.static.scenery if item.kind in ("lamp", "post", "tree", "conifer")]
        things += [post.pose for post in scene.static.signs]
        things += [actor.pose for actor in scene.actors if actor.kind != "pedestrian"]
        for person in new:
            near = [math.hypot(p.x_m - person.pose.x_m, p.y_m - person.pose.y_m) < 5.5 for p in things]
            close += any(near)
            total += 1
    assert close > 0.5 * total


@pytest.mark.parametrize("split", ["train", "test"])
def test_the_held_out_shape_stays_held_out(split: Split) -> None:
    families = {person.mesh_family for seed in range(6) for person in added(seed, split)[1]}
    assert (families == {FAMILIES - 1}) if split == "test" else (FAMILIES - 1 not in families)


def test_every_id_is_its_own_and_the_same_seed_gives_the_same() -> None:
    for seed in range(6):
        scene, new = added(seed)
        ids = [actor.id for actor in (*scene.actors, *new)]
        assert len(set(ids)) == len(ids)
        assert added(seed)[1] == new
