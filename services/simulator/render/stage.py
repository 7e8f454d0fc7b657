"""Random stages for training and testing detectors and readers: a scene composed by a seed, nothing driven.

Held out for the split "test" (never seen in "train"): the last mesh family of every actor kind (``FAMILIES - 1``), the
last font (``FONTS - 1``), the last variant of every plant, and the stages' seeds themselves (the split enters the
random stream). "train" uses families 0 to ``FAMILIES - 2``, fonts 0 to ``FONTS - 2``, the other variants; "test" uses
the held-out family and font in every object, so that a score on it is a score on unseen shapes.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Literal, get_args

import numpy as np

from services.simulator.render.kit import CONIFERS, HEDGES, TREES
from services.simulator.render.models import FAMILIES
from services.simulator.scene import (
    Actor,
    ActorKind,
    Atmosphere,
    Gantry,
    GantryPanel,
    Lane,
    LightState,
    Marking,
    Patch,
    Pose,
    Road,
    Scene,
    Scenery,
    SceneryKind,
    SignFace,
    SignPost,
    StaticWorld,
    StopLine,
    Strip,
    TrafficLight,
    Zebra,
)
from services.simulator.signart import CODES, COUNTRIES

Split = Literal["train", "test"]
FONTS = 8
LEFT_HAND = ("GBR",)
ROAD_M = 420.0
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


@dataclass(frozen=True, slots=True)
class Place:
    """The road's course and cross-section: lanes on each side of the middle, in the driver's country."""

    bend_per_m: float
    lane_m: float
    lanes: int  # in each direction
    country: str
    town: bool
    pavement_m: float
    verge_m: float
    side: float  # +1: we drive on the right, so that our kerb lies at negative lateral offsets
    origin: Pose

    def at(self, s: float, lateral: float, turn: float = 0.0, z: float = 0.0) -> Pose:
        """A pose ``s`` metres on, ``lateral`` metres to the left of the middle, turned from the road's course."""
        k = self.bend_per_m
        heading = k * s
        x = math.sin(heading) / k if abs(k) > 1e-9 else s
        y = (1 - math.cos(heading)) / k if abs(k) > 1e-9 else 0.0
        x, y = x - math.sin(heading) * lateral, y + math.cos(heading) * lateral
        c, sn = math.cos(self.origin.yaw_rad), math.sin(self.origin.yaw_rad)
        return Pose(
            x_m=self.origin.x_m + c * x - sn * y,
            y_m=self.origin.y_m + sn * x + c * y,
            z_m=z,
            yaw_rad=self.origin.yaw_rad + heading + turn,
        )

    @property
    def edge_m(self) -> float:
        """Half the carriageway's width."""
        return self.lane_m * self.lanes + 0.35

    def line(self, lateral: float, start: float = -60.0, end: float = ROAD_M) -> np.ndarray:
        """A polyline along the road (N, 2)."""
        poses = [self.at(s, lateral) for s in np.arange(start, end + 0.1, 5.0)]
        return np.array([(pose.x_m, pose.y_m) for pose in poses])


def random_stage(seed: int, split: Split) -> tuple[StaticWorld, Scene]:
    """A composed scene, the same for the same arguments; see the module's note for what each split holds out."""
    rng = np.random.default_rng((2026, seed, 0 if split == "train" else 1))
    place = _place(rng)
    junction = float(rng.uniform(25, 75)) if place.town and rng.uniform() < 0.5 else 0.0
    static = StaticWorld(
        road=_road(place, rng, junction),
        signs=_signs(place, rng, split),
        gantries=_gantries(place, rng, split),
        lights=_lights(place, rng, junction),
        scenery=_scenery(place, rng, split, junction),
        seed=int(rng.integers(1 << 30)),
    )
    atmosphere = _atmosphere(rng)
    lane = -place.side * place.lane_m * (0.5 + int(rng.integers(place.lanes)))
    ego = place.at(0.0, lane + float(rng.normal(0, 0.2)), float(rng.normal(0, 0.012)))
    scene = Scene(
        static=static,
        ego=ego,
        actors=_actors(place, rng, split, lane, atmosphere),
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


def _road(place: Place, rng: np.random.Generator, junction: float) -> Road:
    lanes, strips = [], [Strip(surface="asphalt", centre_m=place.line(0.0), width_m=2 * place.edge_m)]
    middle: Marking = "solid" if rng.uniform() < 0.3 else ("double" if place.lanes > 1 else "dashed")
    border: Marking = "edge" if not place.town or rng.uniform() < 0.6 else "none"
    for sense in (1.0, -1.0):
        for k in range(place.lanes):
            lateral = sense * place.lane_m * (k + 0.5)
            inner: Marking = (middle if sense < 0 else "none") if k == 0 else "dashed"
            outer: Marking = border if k == place.lanes - 1 else "none"
            left, right = (inner, outer) if sense < 0 else (outer, inner)
            lanes.append(Lane(centre_m=place.line(lateral), width_m=place.lane_m, left=left, right=right))
        if place.town:
            offset = sense * (place.edge_m + place.verge_m + place.pavement_m / 2)
            for start, end in _around(junction, place):
                strips.append(
                    Strip(surface="pavement", centre_m=place.line(offset, start, end), width_m=place.pavement_m)
                )
    zebras = (
        [Zebra(pose=place.at(float(rng.uniform(12, 60)), 0.0), span_m=2 * place.edge_m)]
        if place.town and rng.uniform() < 0.3
        else []
    )
    if not junction:
        return Road(lanes=tuple(lanes), strips=tuple(strips), zebras=tuple(zebras))
    return _crossed(place, junction, lanes, strips, zebras)


def _around(junction: float, place: Place) -> list[tuple[float, float]]:
    gap = 5.0 + place.verge_m
    return [(-60.0, junction - gap), (junction + gap, ROAD_M)] if junction else [(-60.0, ROAD_M)]


def _crossed(place: Place, junction: float, lanes: list[Lane], strips: list[Strip], zebras: list[Zebra]) -> Road:
    """The same road with another one across it."""
    half, reach = 3.4, 120.0
    for sense in (1.0, -1.0):
        laterals = np.linspace(place.edge_m - 0.3, place.edge_m + reach, 20) * sense
        points = np.array([(p.x_m, p.y_m) for p in (place.at(junction, lat) for lat in laterals)])
        strips.append(Strip(surface="asphalt", centre_m=points, width_m=2 * half))
        lanes.append(Lane(centre_m=points[2:], width_m=2 * half - 0.2, left="edge", right="edge"))
    corners = [
        (junction - half, -place.edge_m),
        (junction + half, -place.edge_m),
        (junction + half, place.edge_m),
        (junction - half, place.edge_m),
    ]
    outline = np.array([(p.x_m, p.y_m) for p in (place.at(s, lat) for s, lat in corners)])
    width = place.lane_m * place.lanes - 0.2
    stop = StopLine(pose=place.at(junction - half - 1.5, -place.side * place.lane_m * place.lanes / 2), width_m=width)
    return Road(
        lanes=tuple(lanes),
        strips=tuple(strips),
        patches=(Patch(surface="asphalt", outline_m=outline),),
        stop_lines=(stop,),
        zebras=tuple(zebras),
    )


def _font(rng: np.random.Generator, split: Split) -> int:
    return int(rng.integers(FONTS - 1)) if split == "train" else FONTS - 1


def _family(rng: np.random.Generator, split: Split) -> int:
    return int(rng.integers(FAMILIES - 1)) if split == "train" else FAMILIES - 1


def _face(country: str, code: str, rng: np.random.Generator, split: Split) -> SignFace:
    return SignFace(country=country, code=code, font=_font(rng, split), look_seed=int(rng.integers(1000)))


def _signs(place: Place, rng: np.random.Generator, split: Split) -> tuple[SignPost, ...]:
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


def _gantries(place: Place, rng: np.random.Generator, split: Split) -> tuple[Gantry, ...]:
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
                font=_font(rng, split),
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


def _lights(place: Place, rng: np.random.Generator, junction: float) -> tuple[TrafficLight, ...]:
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


def _actor(rng: np.random.Generator, split: Split, id_: int, kind: ActorKind, pose: Pose, lit: bool) -> Actor:
    length, width, height = (float(rng.uniform(*limits)) for limits in SIZES[kind])
    return Actor(
        id=id_,
        kind=kind,
        pose=pose,
        length_m=length,
        width_m=width,
        height_m=height,
        look_seed=int(rng.integers(1 << 20)),
        mesh_family=_family(rng, split),
        braking=bool(rng.uniform() < 0.3),
        indicator=str(rng.choice(["off", "off", "off", "off", "left", "right"])),  # type: ignore[arg-type]
        walk_phase=float(rng.uniform()),
        lights_on=lit,
    )


def _actors(
    place: Place, rng: np.random.Generator, split: Split, own_lane: float, atmosphere: Atmosphere
) -> tuple[Actor, ...]:
    kinds, weights = [kind for kind, _ in TRAFFIC], [weight for _, weight in TRAFFIC]
    lit_share = (
        0.97 if atmosphere.night else (0.7 if atmosphere.rain_mm_h or atmosphere.fog_visibility_m < 500 else 0.3)
    )
    actors: list[Actor] = []
    for sense in (1.0, -1.0):
        for k in range(place.lanes):
            lateral = sense * place.lane_m * (k + 0.5)
            ours = lateral * own_lane > 0
            s = float(rng.uniform(6, 30))
            while s < 110 and len(actors) < 22:
                kind: ActorKind = rng.choice(kinds, p=weights)
                turn = float(rng.normal(0, 0.02)) + (0.0 if ours else math.pi)
                if rng.uniform() < 0.04:
                    turn += float(rng.uniform(-1.2, 1.2))
                lit = bool(rng.uniform() < lit_share)
                reach = SIZES[kind][0][1]  # the longest of its kind: no two overlap
                pose = place.at(s + reach / 2, lateral + float(rng.normal(0, 0.25)), turn)
                actors.append(_actor(rng, split, len(actors) + 1, kind, pose, lit))
                s += reach + float(rng.gamma(2.0, 9.0)) + 1.5
    if place.town and rng.uniform() < 0.5:
        actors += _parked(place, rng, split, len(actors) + 1)
    return tuple(actors + _people(place, rng, split, actors))


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
    count = int(rng.integers(2, 13)) if place.town else int(rng.integers(0, 4))
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


assert set(SIZES) == set(get_args(ActorKind))
