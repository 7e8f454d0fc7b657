"""Renders labelled pictures along scenario drives into the detector's shards: what stands beside real roads, and is not a road user.

`python -m training dataset.drives --out DIR --scenario urb-rain --first 1000 --drives 10` writes
`DIR/train-<scenario>-<seed>.npz`, one file a drive. Road users, letterings and plants of the held-out families are
exchanged for others, and most pictures show another weather than the scenario's. Drives that are measured have seeds
below 1000.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np

from drivemcp.paths import data
from services.simulator.render import FAMILIES
from services.simulator.render.device.resources import CONIFERS, HEDGES, TREES
from services.simulator.scenario.load import load_scenario
from services.simulator.scene.scene import Actor, Scenery, SignPost, StaticWorld
from services.simulator.session import CAMERAS, Session
from training.dataset.shards import Shot, jittered, shot_of, write_shard
from training.labelling import LabellingRenderer
from training.stages.road_course import FONTS
from training.stages.stage import random_stage

OWN_WEATHER = 0.35
PLANTS = {"tree": TREES, "conifer": CONIFERS, "hedge": HEDGES}


def drive_shots(scenario: str, seed: int, seconds: float, every_s: float) -> Iterator[Shot]:
    """Pictures of both cameras along one drive, at the given interval."""
    session = session_of(scenario, seed, seconds)
    rng = np.random.default_rng((78, seed))
    static = held_in(session.world.static)
    renderer = LabellingRenderer(static, seed)
    due_s = float(rng.uniform(0.0, every_s))
    while not session.finished:
        batch = session.advance()
        if not batch.shots or batch.snapshot.time_s < due_s:
            continue
        due_s += every_s
        scene = batch.shots[0].scene
        scene = replace(scene, static=static, actors=tuple(_known_shape(actor) for actor in scene.actors))
        if rng.uniform() > OWN_WEATHER:
            scene = replace(scene, atmosphere=random_stage(int(rng.integers(1 << 30)), "train")[1].atmosphere)
        for camera in CAMERAS.values():
            yield shot_of(renderer, scene, jittered(camera, rng), rng, seed)
    renderer.close()


def session_of(scenario: str, seed: int, seconds: float) -> Session:
    """One drive through a shipped scenario."""
    return Session(
        load_scenario(data(f"scenarios/{scenario}.toml")),
        seed,
        seconds=seconds,
        epoch_ns=1_000_000_000,
        dbc=data("vehicles/sim/sim.dbc"),
        bus="car",
    )


def held_in(static: StaticWorld) -> StaticWorld:
    """The same road without letterings and plants that are kept for testing."""
    return replace(
        static,
        signs=tuple(_known_lettering(post) for post in static.signs),
        scenery=tuple(_known_plant(thing) for thing in static.scenery),
    )


def _known_lettering(post: SignPost) -> SignPost:
    return replace(post, faces=tuple(replace(face, font=face.font % (FONTS - 1)) for face in post.faces))


def _known_plant(thing: Scenery) -> Scenery:
    count = PLANTS.get(thing.kind)
    held_out = count is not None and thing.look_seed % count == count - 1
    return replace(thing, look_seed=thing.look_seed + 1) if held_out else thing


def _known_shape(actor: Actor) -> Actor:
    return replace(actor, mesh_family=actor.mesh_family % (FAMILIES - 1))


def main() -> None:
    """Render drives into shards, printing progress."""
    parser = argparse.ArgumentParser(prog="python -m training dataset.drives", description=__doc__)
    parser.add_argument("--out", type=Path, required=True, help="folder of the shards")
    parser.add_argument("--scenario", required=True)
    parser.add_argument("--first", type=int, default=1000, help="first seed")
    parser.add_argument("--drives", type=int, default=10)
    parser.add_argument("--seconds", type=float, default=60.0)
    parser.add_argument("--every", type=float, default=1.2, metavar="S", help="between two pictures of a camera")
    flags = parser.parse_args()
    if flags.first < 1000:
        parser.error("--first: seeds below 1000 are for measuring")
    flags.out.mkdir(parents=True, exist_ok=True)
    for seed in range(flags.first, flags.first + flags.drives):
        started = time.monotonic()
        shots = list(drive_shots(flags.scenario, seed, flags.seconds, flags.every))
        write_shard(flags.out / f"train-{flags.scenario}-{seed:06d}.npz", shots)
        print(f"{flags.scenario} seed {seed}: {len(shots)} pictures, {time.monotonic() - started:.0f} s", flush=True)  # noqa: T201


if __name__ == "__main__":
    main()
