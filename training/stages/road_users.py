"""A stage's road users: traffic in the lanes, parked cars, people."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import get_args

import numpy as np

from services.simulator.scene.scene import Actor, ActorKind, Atmosphere, Pose
from training.stages.road_course import Place, Split, family

SIZES: dict[ActorKind, tuple[tuple[float, float], tuple[float, float], tuple[float, float]]] = {
    "saloon": ((4.0, 4.9), (1.70, 1.90), (1.38, 1.52)),
    "estate": ((4.2, 4.9), (1.74, 1.95), (1.45, 1.75)),
    "van": ((4.6, 6.0), (1.85, 2.05), (1.90, 2.65)),
    "lorry": ((7.0, 12.0), (2.35, 2.55), (3.0, 3.9)),
    "bus": ((10.0, 13.0), (2.45, 2.55), (2.95, 3.3)),
    "motorcycle": ((1.95, 2.3), (0.75, 0.9), (1.55, 1.7)),
    "pedestrian": ((0.5, 0.5), (0.5, 0.5), (1.5, 1.92)),
}
TRAFFIC: tuple[tuple[ActorKind, float], ...] = (
    ("saloon", 0.36), ("estate", 0.24), ("van", 0.14), ("lorry", 0.10), ("bus", 0.07), ("motorcycle", 0.09),
)  # fmt: skip
assert set(SIZES) == set(get_args(ActorKind))


def drawn(rng: np.random.Generator, split: Split, id_: int, kind: ActorKind, pose: Pose) -> Actor:
    """An actor of a kind: a size and a look that the split may use, all lamps off."""
    length, width, height = (float(rng.uniform(*limits)) for limits in SIZES[kind])
    return Actor(
        id=id_,
        kind=kind,
        pose=pose,
        length_m=length,
        width_m=width,
        height_m=height,
        look_seed=int(rng.integers(1 << 20)),
        mesh_family=family(rng, split),
    )


def _actor(rng: np.random.Generator, split: Split, id_: int, kind: ActorKind, pose: Pose, lit: bool) -> Actor:
    return replace(
        drawn(rng, split, id_, kind, pose),
        braking=bool(rng.uniform() < 0.3),
        indicator=str(rng.choice(["off", "off", "off", "off", "left", "right"])),  # type: ignore[arg-type]
        walk_phase=float(rng.uniform()),
        lights_on=lit,
    )


def actors(
    place: Place, rng: np.random.Generator, split: Split, own_lane: float, atmosphere: Atmosphere
) -> tuple[Actor, ...]:
    """All road users of a place; ``own_lane`` is the ego's lateral offset in metres."""
    kinds, weights = [kind for kind, _ in TRAFFIC], [weight for _, weight in TRAFFIC]
    lit_share = (
        0.97 if atmosphere.night else (0.7 if atmosphere.rain_mm_h or atmosphere.fog_visibility_m < 500 else 0.3)
    )
    out: list[Actor] = []
    for sense in (1.0, -1.0):
        for k in range(place.lanes):
            lateral = sense * place.lane_m * (k + 0.5)
            ours = lateral * own_lane > 0
            s = float(rng.uniform(6, 30))
            while s < 110 and len(out) < 22:
                kind: ActorKind = rng.choice(kinds, p=weights)
                turn = float(rng.normal(0, 0.02)) + (0.0 if ours else math.pi)
                if rng.uniform() < 0.04:
                    turn += float(rng.uniform(-1.2, 1.2))
                lit = bool(rng.uniform() < lit_share)
                reach = SIZES[kind][0][1]  # the longest of its kind: no two overlap
                pose = place.at(s + reach / 2, lateral + float(rng.normal(0, 0.25)), turn)
                out.append(_actor(rng, split, len(out) + 1, kind, pose, lit))
                s += reach + float(rng.gamma(2.0, 9.0)) + 1.5
    if place.town and rng.uniform() < 0.5:
        out += _parked(place, rng, split, len(out) + 1)
    return tuple(out + _people(place, rng, split, out))


def _parked(place: Place, rng: np.random.Generator, split: Split, first: int) -> list[Actor]:
    """Cars along one kerb, half on the pavement, lamps off."""
    sense = float(rng.choice([-1.0, 1.0]))
    out: list[Actor] = []
    s = float(rng.uniform(4, 25))
    while s < 80 and len(out) < 8:
        kind: ActorKind = rng.choice(["saloon", "estate", "van"], p=[0.5, 0.35, 0.15])
        turn = 0.0 if sense * place.side < 0 else math.pi
        pose = place.at(s + 2.5, sense * (place.edge_m + place.verge_m + 0.3), turn + float(rng.normal(0, 0.03)))
        out.append(replace(_actor(rng, split, first + len(out), kind, pose, False), braking=False, indicator="off"))
        s += 6.0 + float(rng.exponential(5.0))
    return out


def _people(place: Place, rng: np.random.Generator, split: Split, vehicles: list[Actor]) -> list[Actor]:
    most = 2 if split == "train" else 1  # the weakest class gets more to learn from
    count = int(rng.integers(2, 13 * most)) if place.town else int(rng.integers(0, 4 * most))
    out: list[Actor] = []
    for _ in range(count):
        sense = float(rng.choice([-1.0, 1.0]))
        raised = 0.11 if place.town else 0.0
        if rng.uniform() < 0.28:  # on the road
            lateral, turn, raised = float(rng.uniform(-place.edge_m, place.edge_m)), sense * math.pi / 2, 0.0
        else:
            lateral = sense * (place.edge_m + place.verge_m + float(rng.uniform(0.3, max(place.pavement_m, 1.5) - 0.3)))
            turn = float(rng.choice([0.0, math.pi]) + rng.normal(0, 0.5))
        pose = place.at(float(rng.uniform(5, 55)), lateral, turn, raised)
        if all(_clear(pose, vehicle) for vehicle in vehicles):
            out.append(_actor(rng, split, len(vehicles) + len(out) + 1, "pedestrian", pose, False))
    return out


def _clear(pose: Pose, vehicle: Actor) -> bool:
    dx, dy = pose.x_m - vehicle.pose.x_m, pose.y_m - vehicle.pose.y_m
    c, s = math.cos(vehicle.pose.yaw_rad), math.sin(vehicle.pose.yaw_rad)
    return abs(c * dx + s * dy) > vehicle.length_m / 2 + 0.5 or abs(c * dy - s * dx) > vehicle.width_m / 2 + 0.4
