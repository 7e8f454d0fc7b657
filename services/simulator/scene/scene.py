"""What the world simulation shows the cameras: the contract between world and renderer, as frozen values.

World frame: metres, x and y on the ground with y to the LEFT of x, z up; yaw in radians, anticlockwise, 0 along x.
A polyline is a float array (N, 2) of x, y in metres, in driving direction. Nothing here knows a bus or a graphics
library. Object ids (actors, signs, panels, lights) are unique within a scene and from 1 to 65535.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal

import numpy as np
from numpy.typing import NDArray

ActorKind = Literal["saloon", "estate", "van", "lorry", "bus", "motorcycle", "pedestrian"]
Indicator = Literal["off", "left", "right"]
LightState = Literal["red", "red_amber", "amber", "green", "off"]
Marking = Literal["none", "solid", "dashed", "double", "edge"]
Surface = Literal["asphalt", "concrete", "pavement", "verge"]
SceneryKind = Literal["tree", "conifer", "house", "tower", "lamp", "post", "hedge", "street_furniture"]
Polyline = NDArray[np.float64]


@dataclass(frozen=True, slots=True, kw_only=True)
class Pose:
    """A place and a heading in the world frame."""

    x_m: float
    y_m: float
    z_m: float = 0.0
    yaw_rad: float = 0.0


def in_ego_frame(ego: Pose, x_m: float, y_m: float) -> tuple[float, float]:
    """A world point as seen from the ego: x forward, y left."""
    c, s = math.cos(ego.yaw_rad), math.sin(ego.yaw_rad)
    dx, dy = x_m - ego.x_m, y_m - ego.y_m
    return dx * c + dy * s, dy * c - dx * s


@dataclass(frozen=True, slots=True, kw_only=True)
class Actor:
    """A road user; ``pose`` is the centre of its footprint on the ground, ``look_seed`` paints it.

    ``mesh_family`` chooses the shape within the kind (any int, taken modulo ``render.FAMILIES``).
    ``walk_phase`` is a pedestrian's step cycle in turns (0 to 1, any float is wrapped): 1 per two steps.
    """

    id: int
    kind: ActorKind
    pose: Pose
    length_m: float
    width_m: float
    height_m: float
    look_seed: int = 0
    mesh_family: int = 0
    braking: bool = False
    indicator: Indicator = "off"
    walk_phase: float = 0.0
    lights_on: bool = False


@dataclass(frozen=True, slots=True, kw_only=True)
class SignFace:
    """One drawn face; ``size_m`` is its width, 0 means the true width by ``signart.face_size_m``."""

    country: str
    code: str
    text: str = ""
    size_m: float = 0.0
    font: int = 0
    look_seed: int = 0


@dataclass(frozen=True, slots=True, kw_only=True)
class SignPost:
    """A post with faces stacked downwards; ``pose.yaw_rad`` is the direction in which the faces look.

    ``height_m`` is the height of the centre of the topmost face. Labels carry the post's ``id`` and the face's index.
    """

    id: int
    pose: Pose
    faces: tuple[SignFace, ...]
    height_m: float = 2.5


@dataclass(frozen=True, slots=True, kw_only=True)
class GantryPanel:
    """An LED panel; ``lateral_m`` is left positive as the approaching driver sees it, ``code`` "" is a dark panel."""

    id: int
    lateral_m: float
    country: str
    code: str = ""
    size_m: float = 1.2
    font: int = 0


@dataclass(frozen=True, slots=True, kw_only=True)
class Gantry:
    """A bridge over the road: ``pose`` is the middle of the span on the ground, its yaw is where the panels look."""

    id: int
    pose: Pose
    span_m: float
    panels: tuple[GantryPanel, ...]
    clearance_m: float = 5.2


@dataclass(frozen=True, slots=True, kw_only=True)
class TrafficLight:
    """A three-lamp head on a post at ``pose``; its yaw is where the lamps look, ``height_m`` the head's centre."""

    id: int
    pose: Pose
    height_m: float = 2.7
    state: LightState = "red"
    arm_m: float = 0.0  # the head hangs this far to the approaching driver's left of the post (negative: right)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Lane:
    """A lane's surface is drawn from its centre line; markings lie on its left and right border in its direction."""

    centre_m: Polyline
    width_m: float = 3.5
    left: Marking = "none"
    right: Marking = "none"


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Strip:
    """A ribbon of ground along a centre line: shoulder, pavement (raised, with a kerb), verge."""

    surface: Surface
    centre_m: Polyline
    width_m: float


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Patch:
    """A convex polygon of ground, for example a junction's middle; drawn above lanes and their markings."""

    surface: Surface
    outline_m: Polyline


@dataclass(frozen=True, slots=True, kw_only=True)
class StopLine:
    """A solid bar across a lane; ``pose`` is its middle, its yaw the driving direction."""

    pose: Pose
    width_m: float = 3.3
    depth_m: float = 0.5


@dataclass(frozen=True, slots=True, kw_only=True)
class Zebra:
    """A crossing; ``pose`` is its middle, its yaw the road's direction; people walk along ``span_m``."""

    pose: Pose
    span_m: float
    depth_m: float = 3.5


@dataclass(frozen=True, slots=True, kw_only=True)
class Road:
    """All that lies flat; drawn in this order: strips, lanes, markings, patches, stop lines, zebras."""

    lanes: tuple[Lane, ...] = ()
    strips: tuple[Strip, ...] = ()
    patches: tuple[Patch, ...] = ()
    stop_lines: tuple[StopLine, ...] = ()
    zebras: tuple[Zebra, ...] = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class Scenery:
    """A thing beside the road; ``length_m`` along its yaw, ``width_m`` across; 0 lets the look seed decide.

    A house or tower looks (its front) along its yaw.
    """

    kind: SceneryKind
    pose: Pose
    height_m: float = 0.0
    length_m: float = 0.0
    width_m: float = 0.0
    look_seed: int = 0


@dataclass(frozen=True, slots=True, kw_only=True)
class Atmosphere:
    """Weather and light. ``wetness`` and ``cloud`` run from 0 to 1; the sun's azimuth is in the world frame."""

    sun_elevation_deg: float = 45.0
    sun_azimuth_rad: float = 2.2
    night: bool = False
    rain_mm_h: float = 0.0
    fog_visibility_m: float = 20_000.0
    wetness: float = 0.0
    cloud: float = 0.4


@dataclass(frozen=True, slots=True, kw_only=True)
class CameraSpec:
    """A pinhole camera on the ego: mount in the ego frame (origin: centre of the ego on the ground), looking ahead.

    ``pitch_rad`` is positive upwards. Pixels follow OpenCV: u right, v down, pixel centres at half-integers.
    """

    id: str
    width_px: int = 640
    height_px: int = 360
    fov_deg: float = 70.0
    x_m: float = 0.6
    y_m: float = 0.0
    z_m: float = 1.35
    pitch_rad: float = 0.0

    @property
    def focal_px(self) -> float:
        """Focal length in pixels, the same in u and v."""
        return self.width_px / 2 / math.tan(math.radians(self.fov_deg) / 2)


FRONT = CameraSpec(id="front", fov_deg=70.0, pitch_rad=math.radians(-2.0))
TELE = CameraSpec(id="tele", fov_deg=18.0, pitch_rad=math.radians(1.0))


@dataclass(frozen=True, slots=True, kw_only=True)
class StaticWorld:
    """What never moves in a scenario; built once, uploaded once."""

    road: Road
    signs: tuple[SignPost, ...] = ()
    gantries: tuple[Gantry, ...] = ()
    lights: tuple[TrafficLight, ...] = ()
    scenery: tuple[Scenery, ...] = ()
    seed: int = 0


@dataclass(frozen=True, slots=True, kw_only=True)
class Scene:
    """One moment of the world as the cameras see it. The ego itself carries the cameras and is not drawn.

    ``panels`` (panel id to code, "" dark) and ``lights`` (light id to state) override the static values.
    """

    static: StaticWorld
    ego: Pose
    actors: tuple[Actor, ...] = ()
    panels: Mapping[int, str] = field(default_factory=dict)
    lights: Mapping[int, LightState] = field(default_factory=dict)
    atmosphere: Atmosphere = Atmosphere()
    time_s: float = 0.0


@dataclass(frozen=True, slots=True)
class Box:
    """A body that stands on the ground, in the world frame; `foot_m` is how high it begins."""

    pose: Pose
    length_m: float
    width_m: float
    height_m: float
    foot_m: float = 0.0

    @classmethod
    def of(cls, actor: Actor) -> Box:
        """The body of a road user."""
        return cls(actor.pose, actor.length_m, actor.width_m, actor.height_m)
