"""Random stages: reproducible, legal, with their hold-outs kept."""

import pytest

from services.simulator.render.device.resources import TREES
from services.simulator.render.models.actors import FAMILIES
from services.simulator.render.models.street_furniture import STYLES
from services.simulator.signart import CODES
from training.stages.stage import FONTS, Split, random_stage

SEEDS = range(12)


def test_a_stage_depends_on_its_seed_and_split_alone() -> None:
    first, again = random_stage(4, "train")[1], random_stage(4, "train")[1]
    assert first.actors == again.actors
    assert first.actors != random_stage(5, "train")[1].actors
    assert first.actors != random_stage(4, "test")[1].actors


@pytest.mark.parametrize(("split", "families"), [("train", set(range(FAMILIES - 1))), ("test", {FAMILIES - 1})])
def test_mesh_families_are_held_out(split: Split, families: set[int]) -> None:
    used = {actor.mesh_family for seed in SEEDS for actor in random_stage(seed, split)[1].actors}
    assert used == families


@pytest.mark.parametrize(("split", "fonts"), [("train", set(range(FONTS - 1))), ("test", {FONTS - 1})])
def test_fonts_are_held_out(split: Split, fonts: set[int]) -> None:
    used = {face.font for seed in SEEDS for post in random_stage(seed, split)[0].signs for face in post.faces}
    assert used <= fonts


@pytest.mark.parametrize(("split", "held"), [("train", False), ("test", True)])
def test_tree_variants_are_held_out(split: Split, held: bool) -> None:
    for seed in SEEDS:
        trees = [item for item in random_stage(seed, split)[0].scenery if item.kind == "tree"]
        assert all((item.look_seed % TREES == TREES - 1) is held for item in trees)


@pytest.mark.parametrize(("split", "styles"), [("train", set(range(STYLES - 1))), ("test", {STYLES - 1})])
def test_styles_of_street_furniture_are_held_out(split: Split, styles: set[int]) -> None:
    things = [
        item for seed in range(30) for item in random_stage(seed, split)[0].scenery if item.kind == "street_furniture"
    ]
    assert {item.look_seed % STYLES for item in things} == styles


def test_every_sign_can_be_drawn_and_ids_are_unique() -> None:
    for seed in SEEDS:
        static, scene = random_stage(seed, "train")
        assert all(face.code in CODES[face.country] for post in static.signs for face in post.faces)
        ids = [actor.id for actor in scene.actors] + [post.id for post in static.signs]
        ids += [light.id for light in static.lights] + [p.id for gantry in static.gantries for p in gantry.panels]
        assert len(ids) == len(set(ids))
