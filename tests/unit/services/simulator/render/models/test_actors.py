"""Actor meshes: true to size, reproducible, lit as they should be."""

from typing import get_args

import numpy as np
import pytest

from services.simulator.render.models.actors import FAMILIES, build_model, lamp_levels, world_points
from services.simulator.render.models.mesh import Material
from services.simulator.scene.scene import Actor, ActorKind, Indicator, Pose
from training.stages.stage import SIZES

KINDS: tuple[ActorKind, ...] = get_args(ActorKind)


def actor(kind: ActorKind = "saloon", family: int = 0, seed: int = 1, **more: object) -> Actor:
    length, width, height = (sum(limits) / 2 for limits in SIZES[kind])
    pose = Pose(x_m=0.0, y_m=0.0)
    fields = {"id": 1, "kind": kind, "pose": pose, "length_m": length, "width_m": width, "height_m": height}
    return Actor(**(fields | {"look_seed": seed, "mesh_family": family} | more))  # type: ignore[arg-type]


@pytest.mark.parametrize("family", range(FAMILIES))
@pytest.mark.parametrize("kind", [kind for kind in KINDS if kind != "pedestrian"])
def test_a_vehicle_is_as_large_as_its_actor_says(kind: ActorKind, family: int) -> None:
    subject = actor(kind, family)
    points = world_points(build_model(subject), subject)
    extent = points.max(axis=0) - points.min(axis=0)
    assert extent[0] == pytest.approx(subject.length_m, abs=0.25)
    assert extent[1] == pytest.approx(subject.width_m, abs=0.65)  # mirrors stand out
    assert extent[2] == pytest.approx(subject.height_m, rel=0.12)
    assert points[:, 2].min() == pytest.approx(0.0, abs=0.06)


@pytest.mark.parametrize("family", range(FAMILIES))
def test_a_pedestrian_stands_on_the_ground_at_full_height(family: int) -> None:
    subject = actor("pedestrian", family, walk_phase=0.0)
    points = world_points(build_model(subject), subject)
    assert points[:, 2].max() == pytest.approx(subject.height_m, rel=0.05)
    assert abs(points[:, 2].min()) < 0.1


def test_a_walking_pedestrian_s_feet_are_apart_in_mid_step_and_together_in_passing() -> None:
    def spread(phase: float) -> float:
        subject = actor("pedestrian", walk_phase=phase)
        points = world_points(build_model(subject), subject)
        return float(np.ptp(points[points[:, 2] < 0.3][:, 0]))

    assert spread(0.25) > spread(0.0) + 0.2


def test_the_same_look_gives_the_same_mesh_and_another_seed_another() -> None:
    first, again, other = (build_model(actor(seed=seed)).mesh.vertices.tobytes() for seed in (1, 1, 2))
    assert first == again
    assert first != other


def test_families_differ_in_shape() -> None:
    shapes = {build_model(actor(family=family)).points.tobytes() for family in range(FAMILIES)}
    assert len(shapes) == FAMILIES


@pytest.mark.parametrize("kind", ["saloon", "estate", "van", "lorry", "bus"])
def test_cars_have_lamps_on_both_sides_and_tail_lamps_shine_backwards(kind: ActorKind) -> None:
    lamps = build_model(actor(kind)).lamps
    tails = [lamp for lamp in lamps if lamp.material == Material.TAIL]
    assert sorted(np.sign(lamp.y_m) for lamp in tails) == [-1.0, 1.0]
    assert all(lamp.sense < 0 and lamp.x_m < 0 for lamp in tails)
    assert all(lamp.sense > 0 for lamp in lamps if lamp.material == Material.HEAD)


def test_braking_brightens_the_tail_lamps_by_day() -> None:
    assert lamp_levels(actor(), 0.0, night=False)[Material.TAIL] == 0.0
    assert lamp_levels(actor(braking=True), 0.0, night=False)[Material.TAIL] > 1.0


@pytest.mark.parametrize(("indicator", "lit", "dark"), [("left", "LEFT", "RIGHT"), ("right", "RIGHT", "LEFT")])
def test_an_indicator_blinks_on_its_own_side_only(indicator: Indicator, lit: str, dark: str) -> None:
    levels = [lamp_levels(actor(indicator=indicator), t, night=False) for t in (0.0, 0.5)]
    assert {float(level[Material[lit]]) for level in levels} == {0.0, 1.6}
    assert all(level[Material[dark]] == 0.0 for level in levels)
