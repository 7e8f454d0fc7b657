"""A small world with one of everything, drawn once per kind of weather so that no shader is compiled while driving."""

from __future__ import annotations

import math
from typing import get_args

import numpy as np

from services.simulator.scene import (
    Actor,
    ActorKind,
    Atmosphere,
    CameraSpec,
    Gantry,
    GantryPanel,
    Lane,
    Pose,
    Road,
    Scene,
    Scenery,
    SceneryKind,
    SignFace,
    SignPost,
    StaticWorld,
    Strip,
    TrafficLight,
)

PEEPHOLE = CameraSpec(id="peephole", width_px=64, height_px=36, fov_deg=90.0)
WEATHERS = (
    Atmosphere(cloud=0.2),
    Atmosphere(wetness=1.0, cloud=0.2),
    Atmosphere(rain_mm_h=5.0),
    Atmosphere(night=True),
    Atmosphere(night=True, wetness=1.0),
    Atmosphere(night=True, rain_mm_h=5.0),
)  # every combination of traits that programs are compiled for


def showcase() -> tuple[Scene, ...]:
    """The same scene in each weather."""
    static, actors = _static(), _actors()
    return tuple(
        Scene(static=static, ego=Pose(x_m=0, y_m=0), actors=actors, atmosphere=weather) for weather in WEATHERS
    )


def _static() -> StaticWorld:
    line = np.array([(float(x), 0.0) for x in range(-20, 101, 10)])
    lane = Lane(centre_m=line, left="dashed", right="edge")
    face = SignFace(country="DEU", code="limit:50")
    panel = GantryPanel(id=101, lateral_m=1.0, country="DEU", code="led:80")
    kinds: tuple[SceneryKind, ...] = get_args(SceneryKind)
    return StaticWorld(
        road=Road(
            lanes=(lane,), strips=(Strip(surface="pavement", centre_m=line + np.array([0.0, 5.0]), width_m=2.0),)
        ),
        signs=(SignPost(id=100, pose=Pose(x_m=9, y_m=-3, yaw_rad=math.pi), faces=(face,)),),
        gantries=(Gantry(id=102, pose=Pose(x_m=30, y_m=0, yaw_rad=math.pi), span_m=12, panels=(panel,)),),
        lights=(TrafficLight(id=103, pose=Pose(x_m=10, y_m=3, yaw_rad=math.pi)),),
        scenery=tuple(
            Scenery(kind=kind, pose=Pose(x_m=20.0 + 6 * k, y_m=14.0 * (-1) ** k)) for k, kind in enumerate(kinds)
        ),
    )


def _actors() -> tuple[Actor, ...]:
    kinds: tuple[ActorKind, ...] = get_args(ActorKind)
    return tuple(
        Actor(
            id=k + 1,
            kind=kind,
            pose=Pose(x_m=8.0 + 3 * k, y_m=3.0 * (-1) ** k),
            length_m=4.0,
            width_m=1.8,
            height_m=1.7,
            lights_on=True,
            braking=True,
        )
        for k, kind in enumerate(kinds)
    )
