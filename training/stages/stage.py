"""Random stages for training and testing detectors and readers: a scene composed by a seed, nothing driven.

The split "test" holds out the last mesh family of every actor kind (``FAMILIES - 1``), the last font (``FONTS - 1``), the
last variant of every plant and the last style of street furniture. It also holds out the stages' seeds, since the split
enters the random stream. "train" uses the other families, fonts, variants and styles; "test" uses the held-out ones in
every object, so that a score on it is a score on unseen shapes.
"""

from __future__ import annotations

import math

import numpy as np

from services.simulator.render.device.resources import CONIFERS, HEDGES, TREES
from services.simulator.render.models.actors import FAMILIES
from services.simulator.render.models.street_furniture import STYLES
from services.simulator.scene.scene import Atmosphere, Pose, Scene, Scenery, SceneryKind, StaticWorld
from services.simulator.signart import COUNTRIES
from training.stages.road import road
from training.stages.road_course import FONTS, Place, Split
from training.stages.road_users import SIZES, actors
from training.stages.signs import gantries, lights, signs

__all__ = ["FAMILIES", "FONTS", "SIZES", "Place", "Split", "random_stage"]
LEFT_HAND = ("GBR",)


def random_stage(seed: int, split: Split) -> tuple[StaticWorld, Scene]:
    """A composed scene, the same for the same arguments; see the module's note for what each split holds out."""
    rng = np.random.default_rng((2026, seed, 0 if split == "train" else 1))
    place = _place(rng)
    junction = float(rng.uniform(25, 75)) if place.town and rng.uniform() < 0.5 else 0.0
    static = StaticWorld(
        road=road(place, rng, junction),
        signs=signs(place, rng, split),
        gantries=gantries(place, rng, split),
        lights=lights(place, rng, junction),
        scenery=_scenery(place, rng, split, junction) + _street_furniture(place, seed, split),
        seed=int(rng.integers(1 << 30)),
    )
    atmosphere = _atmosphere(rng)
    lane = -place.side * place.lane_m * (0.5 + int(rng.integers(place.lanes)))
    ego = place.at(0.0, lane + float(rng.normal(0, 0.2)), float(rng.normal(0, 0.012)))
    scene = Scene(
        static=static,
        ego=ego,
        actors=actors(place, rng, split, lane, atmosphere),
        atmosphere=atmosphere,
        time_s=float(rng.uniform(0, 100)),
    )
    return static, scene


def _place(rng: np.random.Generator) -> Place:
    country = str(rng.choice(COUNTRIES, p=_country_weights()))
    town = bool(rng.uniform() < 0.62)
    return Place(
        bend_per_m=float(rng.normal(0, 0.0012)) if rng.uniform() < 0.6 else 0.0,
        lane_m=float(rng.uniform(3.0, 3.75)),
        lanes=int(rng.choice([1, 2, 3], p=[0.55, 0.35, 0.10])),
        country=country,
        town=town,
        pavement_m=float(rng.uniform(1.8, 3.5)) if town else 0.0,
        verge_m=float(rng.choice([0.0, 0.6, 1.4])) if town else 1.5,
        side=-1.0 if country in LEFT_HAND else 1.0,
        origin=Pose(
            x_m=float(rng.uniform(-500, 500)), y_m=float(rng.uniform(-500, 500)), yaw_rad=float(rng.uniform(-3, 3))
        ),
    )


def _country_weights() -> np.ndarray:
    weights = np.array([3.0 if country in ("DEU", "GBR") else 1.0 for country in COUNTRIES])
    out: np.ndarray = weights / weights.sum()
    return out


def _scenery(place: Place, rng: np.random.Generator, split: Split, junction: float) -> tuple[Scenery, ...]:
    free = place.edge_m + place.verge_m + place.pavement_m
    items: list[Scenery] = []
    for sense in (1.0, -1.0):
        s = float(rng.uniform(-5, 8))
        built = place.town and rng.uniform() < 0.85
        while s < 250:
            if junction and abs(s - junction) < 14:
                s += 6
                continue
            if built and rng.uniform() < 0.55:
                kind: SceneryKind = "tower" if rng.uniform() < 0.12 else "house"
                wide = float(rng.uniform(9, 18))
                depth = float(rng.uniform(8, 12))
                lateral = sense * (free + float(rng.uniform(2.5, 7)) + depth / 2)
                pose = place.at(s + wide / 2, lateral, -sense * math.pi / 2)
                items.append(
                    Scenery(kind=kind, pose=pose, length_m=depth, width_m=wide, look_seed=int(rng.integers(10000)))
                )
                s += wide + float(rng.uniform(1, 10))
            else:
                items.append(_plant(place, rng, split, s, sense * (free + 3.2 + float(rng.exponential(6)))))
                s += float(rng.uniform(2.5, 11))
        items += [
            _plant(place, rng, split, float(rng.uniform(60, 330)), sense * float(rng.uniform(30, 110)))
            for _ in range(18)
        ]
        if rng.uniform() < 0.6:
            items += _lamps(place, rng, sense)
        if not place.town:
            items += [
                Scenery(kind="post", pose=place.at(at, sense * (place.edge_m + 0.8), math.pi))
                for at in np.arange(5.0, 200, 25)
            ]
    return tuple(items)


def _plant(place: Place, rng: np.random.Generator, split: Split, s: float, lateral: float) -> Scenery:
    kind: SceneryKind = rng.choice(["tree", "tree", "tree", "conifer", "hedge"])
    count = {"tree": TREES, "conifer": CONIFERS, "hedge": HEDGES}[kind]
    variant = int(rng.integers(count - 1)) if split == "train" else count - 1
    return Scenery(
        kind=kind,
        pose=place.at(s, lateral, float(rng.uniform(0, 6)) if kind != "hedge" else 0.0),
        look_seed=variant + count * int(rng.integers(100)),
    )


def _street_furniture(place: Place, seed: int, split: Split) -> tuple[Scenery, ...]:
    """Upright things at both sides that a detector may take for people, near and far, from a random stream of their own."""
    rng = np.random.default_rng((2027, seed, 0 if split == "train" else 1))
    if rng.uniform() < 0.3:
        return ()
    items = []
    for _ in range(int(rng.integers(4, 28))):
        style = int(rng.integers(STYLES - 1)) if split == "train" else STYLES - 1
        lateral = place.edge_m + float(rng.choice([0.35, 1.0, 3.0, 8.0])) * float(rng.uniform(0.6, 1.4))
        pose = place.at(float(np.exp(rng.uniform(1.2, 4.9))), float(rng.choice([-1.0, 1.0])) * lateral, math.pi)
        look = style + STYLES * int(rng.integers(10_000))
        items.append(Scenery(kind="street_furniture", pose=pose, look_seed=look))
    return tuple(items)


def _lamps(place: Place, rng: np.random.Generator, sense: float) -> list[Scenery]:
    height, start = float(rng.uniform(6, 9)), float(rng.uniform(0, 20))
    return [
        Scenery(
            kind="lamp", pose=place.at(float(s), sense * (place.edge_m + 0.7), -sense * math.pi / 2), height_m=height
        )
        for s in np.arange(start, 220, 32)
    ]


def _atmosphere(rng: np.random.Generator) -> Atmosphere:
    kind = rng.choice(
        ["clear", "overcast", "rain", "fog", "low", "night", "wet_night"], p=[0.27, 0.16, 0.19, 0.08, 0.06, 0.15, 0.09]
    )
    night = bool(kind in ("night", "wet_night"))
    rain = float(rng.uniform(1, 18)) if kind in ("rain", "wet_night") else 0.0
    fog = float(rng.uniform(50, 250)) if kind == "fog" else (float(rng.uniform(300, 2500)) if rain else 20_000.0)
    return Atmosphere(
        sun_elevation_deg=float(rng.uniform(3, 12) if kind == "low" else rng.uniform(18, 65)),
        sun_azimuth_rad=float(rng.uniform(-math.pi, math.pi)),
        night=night,
        rain_mm_h=rain,
        fog_visibility_m=fog,
        wetness=float(rng.uniform(0.5, 1.0)) if rain or rng.uniform() < 0.15 else 0.0,
        cloud=float(rng.uniform(0.0, 0.5) if kind in ("clear", "low") else rng.uniform(0.4, 1.0)),
    )
