"""A stage's signs, gantries and traffic lights."""

from __future__ import annotations

import math

import numpy as np

from services.simulator.scene.scene import Gantry, GantryPanel, LightState, SignFace, SignPost, TrafficLight
from services.simulator.signart import CODES
from training.stages.road_course import Place, Split, font


def _face(country: str, code: str, rng: np.random.Generator, split: Split) -> SignFace:
    return SignFace(country=country, code=code, font=font(rng, split), look_seed=int(rng.integers(1000)))


def signs(place: Place, rng: np.random.Generator, split: Split) -> tuple[SignPost, ...]:
    """Posts along both sides, some seen from behind."""
    codes = CODES[place.country]
    plates = [code for code in codes if code.startswith("plate:")]
    single = [code for code in codes if not code.startswith(("plate:", "led:"))]
    limits = [code for code in codes if code.startswith("limit:")]
    out = []
    for k in range(int(rng.integers(2, 9))):
        code = str(rng.choice(limits)) if rng.uniform() < 0.45 else str(rng.choice(single))
        faces = [_face(place.country, code, rng, split)]
        if rng.uniform() < 0.3:
            faces.append(_face(place.country, str(rng.choice(plates)), rng, split))
        own = rng.uniform() < 0.75
        lateral = (-place.side if own else place.side) * (place.edge_m + float(rng.uniform(0.5, 2.2)))
        away = 0.0 if rng.uniform() < 0.12 else math.pi  # a few are seen from behind
        pose = place.at(float(rng.uniform(7, 95)), lateral, away + float(rng.normal(0, 0.08)))
        out.append(SignPost(id=1000 + k, pose=pose, faces=tuple(faces), height_m=float(rng.uniform(1.9, 3.0))))
    return tuple(out)


def gantries(place: Place, rng: np.random.Generator, split: Split) -> tuple[Gantry, ...]:
    """Bridges with panels, some dark; seldom in towns."""
    if rng.uniform() > (0.12 if place.town else 0.5):
        return ()
    leds = [code for code in CODES[place.country] if code.startswith("led:") and code != "led:blank"]
    out = []
    for k in range(int(rng.integers(1, 3))):
        pose = place.at(float(rng.uniform(14, 110)), 0.0, math.pi)
        panels = [
            GantryPanel(
                id=2000 + 20 * k + lane,
                lateral_m=-place.side * place.lane_m * (lane + 0.5),
                country=place.country,
                code=str(rng.choice(leds)) if rng.uniform() < 0.85 else "",
                size_m=float(rng.uniform(1.0, 1.5)),
                font=font(rng, split),
            )
            for lane in range(place.lanes)
        ]
        out.append(
            Gantry(
                id=2900 + k,
                pose=pose,
                span_m=2 * place.edge_m + 3,
                panels=tuple(panels),
                clearance_m=float(rng.uniform(4.8, 5.8)),
            )
        )
    return tuple(out)


def lights(place: Place, rng: np.random.Generator, junction: float) -> tuple[TrafficLight, ...]:
    """Heads at a junction, or now and then at a crossing."""
    if not junction and rng.uniform() < 0.85:
        return ()
    s = junction - 5.0 if junction else float(rng.uniform(12, 70))
    state: LightState = rng.choice(["red", "red", "green", "green", "amber", "red_amber", "off"])
    lateral = place.edge_m + float(rng.uniform(0.4, 1.0))
    out = [TrafficLight(id=3000, pose=place.at(s, -place.side * lateral, math.pi), state=state)]
    if rng.uniform() < 0.5:
        arm = place.side * lateral * -1.0 + place.side * place.lane_m / 2
        out.append(
            TrafficLight(
                id=3001, pose=place.at(s, -place.side * (lateral + 0.3), math.pi), state=state, height_m=5.3, arm_m=-arm
            )
        )
    if rng.uniform() < 0.6:
        out.append(TrafficLight(id=3002, pose=place.at(s + 10, place.side * lateral, math.pi), state=state))
    if rng.uniform() < 0.5:
        out.append(TrafficLight(id=3003, pose=place.at(s + 12, place.side * lateral, 0.0), state="green"))
    return tuple(out)
