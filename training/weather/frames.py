"""Renders the front camera's pictures in drawn weathers, with the truth beside each, for training and measuring the weather reader.

`python -m training weather.frames --out DIR --split train --stages 250` writes shards as
`training.dataset.shards` does, without objects; several processes may fill one folder with different seeds. Stages of
the split "test" have plants, shapes and seeds that "train" never shows. `--scenario NAME` renders along drives instead:
seeds below 1000 with `--split test`, from 1000 on with `train`. Exposure, white balance, lens and nodding vary with the weather's
own random stream. Nothing of it is committed.
"""

from __future__ import annotations

import argparse
import math
import time
from collections.abc import Iterator
from dataclasses import replace
from itertools import islice
from pathlib import Path
from typing import get_args

import numpy as np
from numpy.typing import NDArray

from services.simulator.render import Renderer
from services.simulator.render.drawing.light import KOSCHMIEDER, extinction_per_m, light_of
from services.simulator.scene.scene import FRONT, Atmosphere, CameraSpec, Scene
from training.dataset.drives import held_in, session_of
from training.dataset.shards import Shot, coded, further_along, jittered, write_shard
from training.lens import through_lens
from training.stages.stage import Split, random_stage

KINDS = ("clear", "overcast", "low_sun", "rain", "fog", "after_rain", "night", "night_wet", "night_rain", "night_fog")
SHARES = (0.15, 0.10, 0.08, 0.22, 0.15, 0.11, 0.06, 0.04, 0.06, 0.03)
NOD_DEG = 0.25
"""The car nods on its springs, so that the calibrated pitch is a little wrong."""
LENS_SHARE = 0.25
VIEWS = 4
SHOTS_PER_SHARD = 80
Rng = np.random.Generator


def draw_weather(rng: Rng) -> tuple[str, Atmosphere]:
    """A kind and its atmosphere; kinds overlap: fog may come with a wet road, rain with fog."""
    kind = str(rng.choice(KINDS, p=SHARES))
    rain = float(np.exp(rng.uniform(math.log(0.3), math.log(25.0)))) if "rain" in kind and kind != "after_rain" else 0.0
    fog = "fog" in kind or (rain > 0.0 and rng.uniform() < 0.2)
    far = float(np.exp(rng.uniform(math.log(1500.0), math.log(25_000.0))))
    near = float(np.exp(rng.uniform(math.log(50.0), math.log(1200.0))))
    return kind, Atmosphere(
        sun_elevation_deg=float(rng.uniform(2, 12) if kind == "low_sun" else rng.uniform(12, 65)),
        sun_azimuth_rad=float(rng.uniform(-math.pi, math.pi)),
        night=kind.startswith("night"),
        rain_mm_h=rain,
        fog_visibility_m=near if fog else far,
        wetness=_wetness(kind, rain, rng),
        cloud=float(rng.uniform(0.0, 0.5) if kind in ("clear", "low_sun") else rng.uniform(0.2, 1.0)),
    )


def _wetness(kind: str, rain_mm_h: float, rng: Rng) -> float:
    """0 to 1. It lags behind the rain, a road dries slowly, and fog leaves some roads damp."""
    if rain_mm_h > 0.0:
        return (1.0 - math.exp(-0.9 * rain_mm_h**0.65)) * float(rng.uniform(0.3, 1.0))
    if kind in ("after_rain", "night_wet"):
        return float(rng.uniform(0.1, 1.0))
    return float(rng.uniform(0.05, 0.6)) if "fog" in kind and rng.uniform() < 0.4 else 0.0


class Skies:
    """Draws weathers; each stays for `hold` pictures, a sequence that carries one number in its notes."""

    def __init__(self, rng: Rng, hold: int, place: str) -> None:
        self._rng, self._hold, self._place, self._taken = rng, hold, place, 0
        self._drawn = draw_weather(rng)

    def next(self) -> tuple[str, Atmosphere, str]:
        """Kind, atmosphere and the sequence's name."""
        if self._taken and self._taken % self._hold == 0:
            self._drawn = draw_weather(self._rng)
        self._taken += 1
        return *self._drawn, f"{self._place} {(self._taken - 1) // self._hold}"


def stage_shots(seed: int, split: Split, hold: int, renderer: Renderer | None) -> tuple[Renderer, list[Shot]]:
    """Some views of one stage."""
    static, first = random_stage(seed, split)
    rng = np.random.default_rng((79, seed, split == "test"))
    renderer, skies = renderer or Renderer(static, seed), Skies(rng, hold, f"{split} stage {seed}")
    return renderer, [shot_of(renderer, _further(first, rng), skies, rng) for _ in range(VIEWS)]


def _further(scene: Scene, rng: Rng) -> Scene:
    ego = further_along(scene.ego, float(rng.uniform(0.0, 40.0)), rng)
    actors = tuple(a for a in scene.actors if math.hypot(a.pose.x_m - ego.x_m, a.pose.y_m - ego.y_m) > 8.0)
    return replace(scene, ego=ego, actors=actors, time_s=float(rng.uniform(0, 100)))


def drive_shots(scenario: str, seed: int, seconds: float, every_s: float, hold: int) -> Iterator[Shot]:
    """Pictures along one drive."""
    session = session_of(scenario, seed, seconds)
    rng = np.random.default_rng((80, seed))
    static = held_in(session.world.static) if seed >= 1000 else session.world.static
    renderer, skies = Renderer(static, seed), Skies(rng, hold, f"{scenario} {seed}")
    due_s = float(rng.uniform(0.0, every_s))
    while not session.finished:
        batch = session.advance()
        if batch.shots and batch.snapshot.time_s >= due_s:
            due_s += every_s
            scene = replace(batch.shots[0].scene, static=static)
            yield shot_of(renderer, scene, skies, rng)
    renderer.close()


def shot_of(renderer: Renderer, scene: Scene, skies: Skies, rng: Rng) -> Shot:
    """One picture as a camera of another car gives it, with the weather's truth and the calibration that is told."""
    kind, atmosphere, place = skies.next()
    night = atmosphere.night
    actors = tuple(replace(actor, lights_on=actor.lights_on or night) for actor in scene.actors)
    camera = jittered(FRONT, rng)
    picture = renderer.render(replace(scene, atmosphere=atmosphere, actors=actors), camera)
    seen = through_lens(exposed(picture, rng), rng, LENS_SHARE)
    jpeg = coded(seen, int(rng.integers(65, 96)))
    objects = np.zeros((0, 8), dtype=np.float32)
    return Shot(jpeg, objects, _note(kind, atmosphere, camera, place, rng))


def _note(kind: str, atmosphere: Atmosphere, camera: CameraSpec, place: str, rng: Rng) -> dict[str, str | float]:
    return {
        "kind": kind,
        "place": place,
        "night": float(atmosphere.night),
        "sun_deg": atmosphere.sun_elevation_deg,
        "rain_mm_h": atmosphere.rain_mm_h,
        "visibility_m": KOSCHMIEDER / extinction_per_m(atmosphere),
        "wetness": light_of(atmosphere).wet,
        "focal_px": camera.focal_px,
        "z_m": camera.z_m,
        "pitch_rad": camera.pitch_rad + math.radians(float(rng.normal(0, NOD_DEG))),
    }


def exposed(picture: NDArray[np.uint8], rng: Rng) -> NDArray[np.uint8]:
    """The same light through another exposure and white balance; the renderer's own are fixed."""
    gain = math.exp(float(rng.normal(0, 0.25))) * np.exp(rng.normal(0, 0.03, size=3))
    linear = np.square(picture.astype(np.float32)) * gain
    return np.sqrt(np.minimum(linear, 255.0**2)).astype(np.uint8)


def _stages(first: int, count: int, split: Split, hold: int) -> Iterator[Shot]:
    renderer: Renderer | None = None
    for seed in range(first, first + count):
        renderer, shots = stage_shots(seed, split, hold, renderer)
        yield from shots


def main() -> None:
    """Render into shards, printing progress."""
    parser = argparse.ArgumentParser(prog="python -m training weather.frames", description=__doc__)
    parser.add_argument("--out", type=Path, required=True, help="folder of the shards")
    parser.add_argument("--split", choices=get_args(Split), default="train")
    parser.add_argument("--stages", type=int, default=250)
    parser.add_argument("--scenario", default="", help="render along a drive of this scenario instead")
    parser.add_argument("--first", type=int, default=0, help="first seed; give processes that share a folder their own")
    parser.add_argument("--seconds", type=float, default=60.0, help="length of a drive")
    parser.add_argument("--hold", type=int, default=1, metavar="N", help="pictures in a row that share a weather")
    parser.add_argument("--every", type=float, default=0.6, metavar="S", help="between two pictures of a drive")
    flags = parser.parse_args()
    if flags.scenario and (flags.first >= 1000) != (flags.split == "train"):
        parser.error("--first: drives to train on have seeds from 1000 on, drives to measure on seeds below")
    flags.out.mkdir(parents=True, exist_ok=True)
    shots = (
        drive_shots(flags.scenario, flags.first, flags.seconds, flags.every, flags.hold)
        if flags.scenario
        else _stages(flags.first, flags.stages, flags.split, flags.hold)
    )
    started, done = time.monotonic(), 0
    while batch := list(islice(shots, SHOTS_PER_SHARD)):
        write_shard(flags.out / f"{flags.split}-{flags.scenario or 'stage'}-{flags.first:04d}-{done:05d}.npz", batch)
        done += len(batch)
        print(f"{flags.split}: {done} pictures, {done / (time.monotonic() - started):.1f} a second", flush=True)  # noqa: T201


if __name__ == "__main__":
    main()
